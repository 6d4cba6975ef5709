//! `[Aalund2015, §5]`: ambient occlusion and photons through layered depth maps.

use super::{
    claims::{Figure, Judged, Rule, Unit, claim},
    page::{Section, Table, measured},
    reports::{Found, Node, Reports},
};
use crate::table::Row;

/// Steps of photons, by their keys.
const STEPS: [&str; 5] = ["emit", "trace", "keep", "lists", "splat"];

/// Fig. 10: its two views, ms in all, and of tracing.
const PHOTONS: [(&str, f64, f64); 2] = [("fig. 10 (a)", 2413.0, 2062.0), ("fig. 10 (c)", 1716.0, 1434.0)];

/// Figs 8 and 9, 512 maps of 200² and of 50²: MB of Sponza's.
const MEGABYTES: [f64; 2] = [805.5, 204.1];
/// Fig. 9: Sponza's and the hairball's ms, building and occlusion; the first by [Archer2019, §4].
const OCCLUSION_MS: [f64; 2] = [373.0, 1174.0];

pub fn section(reports: &Reports) -> Section {
    Section {
        title: "Aalund 2015: occlusion and photons through layered depth maps",
        theirs: "The paper: Crytek Sponza and a hairball, 800 x 800, 512 maps of 200² or 50², NVIDIA GTX 780 Ti.",
        comparable: format!(
            "Here: {}. Comparable: parts of the time, errors against a path tracer, and ratios of memory. Not comparable: milliseconds, and the \
             number of photons, which the paper does not state. The hairball is not to be had. His text calls splatting the bottleneck (§5.2) \
             and his figure has 85 % tracing (fig. 10): the figure is taken.",
            reports.scene_of("photons")
        ),
        claims: claims(reports),
        tables: vec![
            Table {
                key: "aalund_figures_8_9",
                heading: "Figs 8 and 9: ambient occlusion, 512 maps",
                rows: occlusion(reports),
            },
            Table { key: "aalund_figure_10", heading: "Fig. 10: photons, 512 maps of 200²", rows: photons(reports) },
        ],
    }
}

/// Photons as in the paper.
fn papers_photons(reports: &Reports) -> Found<Node<'_>> {
    reports.part("photons")?.row("rows", "as in the paper")
}

/// The first row of occlusion whose name has all these words and none of those.
fn of_occlusion<'a>(reports: &'a Reports, words: &[&str], none_of: &[&str]) -> Found<Node<'a>> {
    let is = |row: &Node<'_>| {
        let name = row.words("name");
        words.iter().all(|word| name.contains(word)) && !none_of.iter().any(|word| name.contains(word))
    };
    reports.part("photons")?.find("occlusion", &words.join(", "), is)
}

/// Words of rows that end at a distance, which others are not compared with.
const ENDS: &[&str] = &["d_max", "distance", "28 %"];

/// Unbounded occlusion through 512 maps with `texels` texels each, by Aalund's algorithm if it was measured.
fn unattenuated<'a>(reports: &'a Reports, texels: &str) -> Found<Node<'a>> {
    let name = format!("512 x {texels}");
    of_occlusion(reports, &["plain", &name], ENDS).or_else(|_| of_occlusion(reports, &["deep", &name], ENDS))
}

/// Milliseconds of all steps.
fn all_ms(row: &Node<'_>) -> Found<f64> {
    STEPS.iter().map(|step| row.f64(&format!("times/{step}"))).sum()
}

/// Milliseconds from the lights to the surfaces that split photons come to.
fn traced_ms(row: &Node<'_>) -> Found<f64> {
    Ok(row.f64("times/emit")? + row.f64("times/trace")?)
}

fn traced_share(reports: &Reports) -> Found<f64> {
    let row = papers_photons(reports)?;
    Ok(traced_ms(&row)? / all_ms(&row)?)
}

/// A figure of maps of 50² over that of maps of 200².
fn coarse_over_fine(reports: &Reports, key: &str) -> Found<f64> {
    Ok(unattenuated(reports, "50²")?.f64(key)? / unattenuated(reports, "200²")?.f64(key)?)
}

/// Rows of occlusion from the view's depth, with their distance where they have one.
fn hbao(reports: &Reports) -> Found<Vec<Node<'_>>> {
    let rows = reports.part("photons")?.rows("occlusion")?;
    Ok(rows.into_iter().filter(|row| row.words("name").starts_with("hbao") && row.f64("distance").is_ok()).collect())
}

/// How many times as long occlusion from the view's depth takes at the largest distance as at the smallest.
fn hbao_slows(reports: &Reports) -> Found<Figure> {
    let rows = hbao(reports)?;
    let by =
        |a: &&Node<'_>, b: &&Node<'_>| a.f64("distance").unwrap_or(0.0).total_cmp(&b.f64("distance").unwrap_or(0.0));
    let (Some(near), Some(far)) = (rows.iter().min_by(by), rows.iter().max_by(by)) else {
        return Err("photons, table `occlusion`: no rows of HBAO at several distances".to_owned());
    };
    if near.f64("distance") == far.f64("distance") {
        return Err("photons, table `occlusion`: HBAO at one distance alone".to_owned());
    }
    let note = format!("{} over {}", far.words("name"), near.words("name"));
    Ok(Figure::of(far.f64("occlusion_ms")? / near.f64("occlusion_ms")?, note))
}

/// The error of maps over that of HBAO, both up to the same distance.
fn against_hbao(reports: &Reports) -> Found<Figure> {
    let end = |row: &Node<'_>| row.f64("distance");
    let rows = hbao(reports)?;
    let ends: Vec<f64> = rows.iter().filter_map(|row| end(row).ok()).collect();
    let is = |row: &Node<'_>| row.words("name").starts_with("deep") && end(row).is_ok_and(|far| ends.contains(&far));
    let what = "of maps up to a distance of HBAO";
    let deep = reports.part("photons")?.find("occlusion", what, is)?;
    let other = rows.iter().find(|row| end(row) == end(&deep)).ok_or("photons: no HBAO as far")?;
    let note = format!("{} over {}", deep.words("name"), other.words("name"));
    Ok(Figure::of(deep.f64("flip")? / other.f64("flip")?, note))
}

fn claims(reports: &Reports) -> Vec<Judged> {
    let is_software = reports.is_software;
    let mut all = vec![
        claim("most of the time of photons is tracing", "[Aalund2015, fig. 10]", "85 %")
            .confirmed_if("the part of tracing, within ten points,", Unit::PERCENT, Rule::AtLeast(0.75))
            .judged(traced_share(reports)),
        claim(
            "maps of 50² instead of 200² suffice for unattenuated ambient occlusion",
            "[Aalund2015, fig. 9]",
            "an image",
        )
        .confirmed_if("the FLIP to the path tracer at 50² over that at 200²", Unit::TIMES, Rule::AtMost(1.25))
        .judged(coarse_over_fine(reports, "flip")),
        claim("HBAO slows down as the distance grows", "[Aalund2015, §5.1]", "it drops")
            .confirmed_if("its time at the largest distance over that at the smallest", Unit::TIMES, Rule::AtLeast(1.5))
            .judged(hbao_slows(reports)),
        claim("maps are nearer to the reference than HBAO for a large distance", "[Aalund2015, fig. 8]", "an image")
            .confirmed_if("the FLIP of maps over that of HBAO", Unit::TIMES, Rule::AtMost(1.0))
            .judged(against_hbao(reports)),
        claim("a sixteenth of the texels takes a quarter of the memory", "[Aalund2015, figs 8 and 9]", "0.25 ×")
            .confirmed_if("the memory of 50² over that of 200²", Unit::TIMES, Rule::Between(0.125, 0.5))
            .judged(coarse_over_fine(reports, "bytes")),
    ];
    all.extend(PHOTONS.map(|(name, ms, _)| {
        let claim = claim(format!("indirect light by photons, {name}"), "[Aalund2015, fig. 10]", Unit::MS.show(ms));
        let claim = claim.of_a_card(is_software).confirmed_if("the time of all steps", Unit::MS, Rule::AtMost(ms));
        claim.judged(papers_photons(reports).and_then(|row| all_ms(&row)))
    }));
    let ms = || {
        let row = unattenuated(reports, "50²")?;
        Ok(row.f64("deep_images_ms")? + row.f64("occlusion_ms")?)
    };
    let claim = claim(
        "occlusion of Sponza by 512 maps of 50², building among it",
        "[Aalund2015, fig. 9]",
        Unit::MS.show(OCCLUSION_MS[0]),
    );
    let claim = claim.of_a_card(is_software).confirmed_if("the time", Unit::MS, Rule::AtMost(OCCLUSION_MS[0]));
    all.push(claim.judged(ms()));
    all
}

fn occlusion(reports: &Reports) -> Vec<Row> {
    let rows = reports.part("photons").and_then(|part| part.rows("occlusion")).unwrap_or_default();
    let row = |row: Node<'_>| {
        let name = row.words("name");
        let is_deep = name.contains("512 x");
        let his = [(200, MEGABYTES[0]), (50, MEGABYTES[1])]
            .into_iter()
            .find(|(texels, _)| name.contains(&format!("512 x {texels}²")));
        let ms = if name.contains("512 x 50²") { OCCLUSION_MS[0].to_string() } else { "–".to_owned() };
        let cells = Row::default().text("name", "", name);
        let cells =
            cells.optional("paper_megabytes", "his MB", his.filter(|_| is_deep).map(|(_, megabytes)| megabytes));
        let cells = measured(cells, "bytes", "MB", 1, row.f64("bytes").map(|bytes| bytes / 1e6)).shown("his ms", ms);
        let cells = measured(cells, "deep_images_ms", "maps, ms", 0, row.f64("deep_images_ms"));
        let cells = measured(cells, "occlusion_ms", "occlusion, ms", 1, row.f64("occlusion_ms"));
        measured(cells, "flip", "FLIP to the path tracer", 4, row.f64("flip"))
    };
    let mut rows: Vec<Row> = rows.into_iter().map(row).collect();
    if !rows.is_empty() {
        let missing = || Err(String::new());
        let hairball = Row::default().text("name", "", "hairball, 512 x 50², his").optional(
            "paper_megabytes",
            "his MB",
            Some(295.5),
        );
        let hairball = measured(hairball, "bytes", "MB", 1, missing()).shown("his ms", OCCLUSION_MS[1]);
        let hairball = measured(hairball, "deep_images_ms", "maps, ms", 0, missing());
        let hairball = measured(hairball, "occlusion_ms", "occlusion, ms", 1, missing());
        rows.push(measured(hairball, "flip", "FLIP to the path tracer", 4, missing()));
    }
    rows
}

fn photons(reports: &Reports) -> Vec<Row> {
    let ours = |of: fn(&Node<'_>) -> Found<f64>| papers_photons(reports).and_then(|row| of(&row));
    let row = |(name, ms, traced): (&'static str, f64, f64)| {
        let row = Row::default().text("name", "", name).number("paper_ms", "his: all, ms", ms);
        let row = row.number("paper_traced_ms", "his: tracing", traced).percent("paper_share", "part", 0, traced / ms);
        let row = measured(row, "ms", "here: all, ms", 1, ours(all_ms));
        let row = measured(row, "traced_ms", "here: tracing", 1, ours(traced_ms));
        let row = measured(row, "share", "part, %", 0, traced_share(reports).map(|share| 100.0 * share));
        measured(row, "energy", "energy of indirect light", 3, ours(|row| row.f64("indirect_energy")))
    };
    PHOTONS.into_iter().map(row).collect()
}
