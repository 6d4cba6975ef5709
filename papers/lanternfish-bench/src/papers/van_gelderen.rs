//! `[VanGelderen2020, ch. 6]`: clusters by shape and size, one grid around two eyes, and the number of lights.

use serde::Deserialize;

use super::{
    claims::{Figure, Judged, Rule, Unit, claim},
    page::{Section, Table, measured},
    reports::{Found, Node, Reports},
};
use crate::{
    clustered::{
        cases::Views,
        figures::{Figures, Played, mean, page::plotted},
    },
    document::Document,
    table::Row,
};

/// The shape that the thesis judges best of each kind, and the figure in which it is tuned [VanGelderen2020, figs 6.2 to 6.4].
const TUNED: [(&str, &str, &str); 3] =
    [("persp", "Persp 64", "persp:64"), ("ortho", "Ortho 4", "ortho:4"), ("displ", "Displ 64 32", "displ:64:32")];

/// Numbers of virtual lights of appendix B, and their scenes.
const VIRTUAL_LIGHTS: [(u32, &str); 2] = [(5000, "Bistro"), (1000, "Sun Temple")];

/// Steps that the thesis counts as clustering.
const CLUSTERING: [&str; 6] = ["prepass", "mark", "compact", "tree", "count", "write"];

pub fn section(reports: &Reports) -> Section {
    Section {
        title: "Van Gelderen 2020: clustered shading for two eyes",
        theirs: "The thesis: Bistro (3.0 M triangles) and Sun Temple (1.6 M), 680 frames of 1280 x 720, far plane at 100, 1,000 to 100,000 \
                 falling lights, GeForce GTX 1070 Ti. Its figures are plots without tables; the numbers here are those of its text.",
        comparable: format!(
            "Here: one view of {}, and the track {}. Comparable: counts, ratios between configurations, and how steady times are. Not \
             comparable: milliseconds. Lights are found through a tree, which the thesis leaves to future work; rows by brute force are as the \
             thesis has them. Sun Temple is not to be had; the Bistro that is has 1.8 M triangles and nothing blended.",
            reports.scene_of("clustered"),
            reports.scene_of("clustered-track")
        ),
        claims: claims(reports),
        tables: vec![
            Table {
                key: "van_gelderen_stereo",
                heading: "Fig. 6.5: one grid around two eyes over a grid each",
                rows: stereo(reports),
            },
            Table {
                key: "van_gelderen_appendix_b",
                heading: "App. B: virtual lights in clusters",
                rows: virtual_lights(reports),
            },
        ],
    }
}

/// The figures of the track.
fn figures(reports: &Reports) -> Found<Figures> {
    let report = reports.part("clustered-track")?;
    Figures::deserialize(report.json).map_err(|error| format!("clustered-track: {error}"))
}

/// Adds the figures that are plots.
pub fn plot(page: &mut Document, reports: &Reports) {
    page.subheading("Fig. A.1: attenuation functions");
    match reports.part("attenuation") {
        Ok(plot) => page.html(plot.json.as_str().unwrap_or_default().to_owned()),
        Err(reason) => page.paragraph(format!("Not measured, because {reason}.")),
    }
    match figures(reports) {
        Ok(figures) => plotted(page, &figures, Document::subheading),
        Err(reason) => page.paragraph(format!("Figures 6.2 to 6.10: not measured, because {reason}.")),
    }
}

fn clustering_ms(row: &Node<'_>) -> Found<f64> {
    CLUSTERING.iter().map(|step| row.f64(&format!("ms/{step}"))).sum()
}

fn frame_ms(row: &Node<'_>) -> Found<f64> {
    Ok(clustering_ms(row)? + row.f64("ms/shading")? + row.f64("ms/other")?)
}

/// Each row with one grid around two eyes, and the one with a grid each.
fn pairs(reports: &Reports) -> Found<Vec<(Node<'_>, Node<'_>)>> {
    let rows = reports.part("clustered")?.rows("rows")?;
    let pair = |enclosed: &Node<'_>| {
        let is = |row: &&Node<'_>| {
            row.words("views") == "stereo-individual"
                && row.words("clusters") == enclosed.words("clusters")
                && row.f64("lights") == enclosed.f64("lights")
        };
        rows.iter().find(is).cloned()
    };
    let enclosed = rows.iter().filter(|row| row.words("views") == "stereo-enclosed");
    let pairs: Vec<_> = enclosed.filter_map(|row| Some((row.clone(), pair(row)?))).collect();
    if pairs.is_empty() { Err("clustered, table `rows`: no rows of two eyes".to_owned()) } else { Ok(pairs) }
}

/// The mean of enclosed over individual, of clusters whose names begin so.
fn enclosed(reports: &Reports, kind: &str, of: impl Fn(&Node<'_>) -> Found<f64>) -> Found<Figure> {
    let pairs = pairs(reports)?.into_iter().filter(|(enclosed, _)| enclosed.words("clusters").starts_with(kind));
    let ratios = pairs.map(|(enclosed, own)| Ok(of(&enclosed)? / of(&own)?)).collect::<Found<Vec<f64>>>()?;
    let ratios: Vec<f64> = ratios.into_iter().filter(|ratio| ratio.is_finite()).collect();
    if ratios.is_empty() {
        return Err("clustered: there is nothing to divide by".to_owned());
    }
    let [least, most] = [f64::min, f64::max].map(|of| ratios.iter().copied().reduce(of).unwrap_or_default());
    Ok(Figure::of(mean(&ratios), format!("mean of {}, from {least:.2} to {most:.2}", ratios.len())))
}

/// How many times as many tests of lights brute force makes with the most lights as with the fewest, for each time as many lights.
fn linear(reports: &Reports) -> Found<Figure> {
    let rows = reports.part("clustered")?.rows("rows")?;
    let brute: Vec<_> = rows.iter().filter(|row| row.words("assignment") == "brute_force").collect();
    let missing = || "clustered: no two numbers of lights by brute force".to_owned();
    for few in &brute {
        let alike = brute.iter().filter(|row| row.words("clusters") == few.words("clusters"));
        let Some(many) = alike.max_by(|a, b| lights(a).total_cmp(&lights(b))) else { continue };
        if lights(many) > lights(few) {
            let grown = lights(many) / lights(few);
            let tests = many.f64("counts/light_tests")? / few.f64("counts/light_tests")?;
            let times = ["count", "write"].map(|step| format!("ms/{step}"));
            let ms = |row: &Node<'_>| times.iter().map(|step| row.f64(step)).sum::<Found<f64>>();
            let note =
                format!("{grown:.0} × the lights: {tests:.1} × the tests, {:.1} × the time", ms(many)? / ms(few)?);
            return Ok(Figure::of(tests / grown, note));
        }
    }
    Err(missing())
}

fn lights(row: &Node<'_>) -> f64 {
    row.f64("lights").unwrap_or_default()
}

/// The deviation of the frame time along the track, over its mean.
fn unsteadiness(played: &Played) -> f64 {
    let frames = played.frame_ms();
    let mean = mean(&frames);
    let squares: f64 = frames.iter().map(|ms| (ms - mean).powi(2)).sum();
    (squares / frames.len().max(1) as f64).sqrt() / mean
}

/// One view: the row of the best cluster size of each shape at the image's height, for each number of lights.
fn tuned(figures: &Figures) -> Vec<[&Played; 3]> {
    let best = crate::clustered::cases::shapes(figures.size[1], true).into_iter().map(|shape| shape.to_string());
    let best: Vec<String> = best.collect();
    let find = |lights: u32, name: &str| {
        let is = |played: &&Played| played.views == Views::Mono && played.lights == lights && played.clusters == name;
        figures.played.iter().find(is)
    };
    let mut counts: Vec<u32> = figures.played.iter().map(|played| played.lights).collect();
    counts.dedup();
    let of = |lights: u32| Some([find(lights, &best[0])?, find(lights, &best[1])?, find(lights, &best[2])?]);
    counts.into_iter().filter_map(of).collect()
}

/// In which part of the numbers of lights the displaced clusters are the steadiest.
fn steadiest(reports: &Reports) -> Found<Figure> {
    let figures = figures(reports)?;
    let tuned = tuned(&figures);
    let deviations: Vec<[f64; 3]> = tuned.iter().map(|played| played.map(unsteadiness)).collect();
    if deviations.iter().flatten().any(|deviation| !deviation.is_finite()) || deviations.is_empty() {
        return Err("clustered-track: no times of the tuned three".to_owned());
    }
    let held = deviations.iter().filter(|[persp, ortho, displ]| displ < persp && displ < ortho).count();
    let said = tuned.iter().zip(&deviations).map(|([first, ..], deviations)| {
        let [persp, ortho, displ] = deviations.map(|deviation| format!("{:.0}", 100.0 * deviation));
        format!("{} lights: {persp}, {ortho}, {displ} %", first.lights)
    });
    let note = format!("persp, ortho, displ: {}", said.collect::<Vec<_>>().join("; "));
    Ok(Figure::of(held as f64 / deviations.len() as f64, note))
}

/// The most fragments of a perspective cluster, over the pixels of its tile.
fn fullest(reports: &Reports) -> Found<Figure> {
    let figures = figures(reports)?;
    let most = |played: &Played| {
        let pixels = f64::from(played.clusters.strip_prefix("persp:")?.parse::<u32>().ok()?);
        let most =
            played.report.frames.iter().filter_map(|frame| Some(frame.clusters.as_ref()?.most_fragments)).max()?;
        Some((f64::from(most) / (pixels * pixels), most, pixels))
    };
    let fullest = figures.played.iter().filter(|played| played.views == Views::Mono).filter_map(most);
    let fullest = fullest.max_by(|a, b| a.0.total_cmp(&b.0)).ok_or("clustered-track: no perspective clusters")?;
    let (ratio, most, pixels) = fullest;
    Ok(Figure::of(ratio, format!("{most} fragments in tiles of {pixels} x {pixels}")))
}

/// In which part of the numbers of lights the size with the least frame time is the thesis'.
fn best_size(reports: &Reports, kind: &str, best: &str) -> Found<Figure> {
    let figures = figures(reports)?;
    let mono = figures.played.iter().filter(|played| played.views == Views::Mono && played.clusters.starts_with(kind));
    let mut by_lights: Vec<Vec<&Played>> = Vec::new();
    for played in mono {
        match by_lights.iter_mut().find(|known| known[0].lights == played.lights) {
            Some(known) => known.push(played),
            None => by_lights.push(vec![played]),
        }
    }
    by_lights.retain(|sizes| sizes.len() > 1 && sizes.iter().all(|played| !played.frame_ms().is_empty()));
    if by_lights.is_empty() {
        return Err("clustered-track: one size of each kind".to_owned());
    }
    let fastest = |sizes: &Vec<&Played>| {
        let fastest = sizes.iter().min_by(|a, b| mean(&a.frame_ms()).total_cmp(&mean(&b.frame_ms())));
        fastest.map_or_else(String::new, |played| played.clusters.clone())
    };
    let fastest: Vec<String> = by_lights.iter().map(fastest).collect();
    let held = fastest.iter().filter(|name| *name == best).count();
    Ok(Figure::of(held as f64 / fastest.len() as f64, fastest.join(", ")))
}

fn claims(reports: &Reports) -> Vec<Judged> {
    let stereo = |what, paper, quantity, rule, found| {
        claim(what, "[VanGelderen2020, fig. 6.5]", paper).confirmed_if(quantity, Unit::TIMES, rule).judged(found)
    };
    let count = |key: &'static str| move |row: &Node<'_>| row.f64(key);
    let mut all = vec![
        stereo(
            "one grid around two eyes halves the visible clusters",
            "halved",
            "enclosed over individual",
            Rule::Between(0.4, 0.6),
            enclosed(reports, "", count("counts/visible_clusters")),
        ),
        stereo(
            "one grid around two eyes shortens clustering",
            "lower",
            "enclosed over individual, prepass included,",
            Rule::AtMost(1.0),
            enclosed(reports, "", clustering_ms),
        ),
        stereo(
            "one grid around two eyes takes fewer lighting operations, of perspective clusters",
            "seems to decrease",
            "enclosed over individual",
            Rule::AtMost(1.0),
            enclosed(reports, "persp", count("counts/lighting_operations")),
        ),
        stereo(
            "the frame gains little by one grid around two eyes",
            "marginal",
            "the frame, enclosed over individual,",
            Rule::Between(0.9, 1.0),
            enclosed(reports, "", frame_ms),
        ),
        claim(
            "displaced clusters have the steadiest frame time",
            "[VanGelderen2020, fig. 6.6]",
            "more stable than either",
        )
        .confirmed_if(
            "the part of the numbers of lights in which they deviate least",
            Unit::PERCENT,
            Rule::AtLeast(1.0),
        )
        .judged(steadiest(reports)),
        claim(
            "a cluster of Persp 64 has at most 64² fragments",
            "[VanGelderen2020, fig. 6.10]",
            "4,096, all of a tile",
        )
        .confirmed_if("the most fragments, over the pixels of a tile,", Unit::TIMES, Rule::AtMost(1.0))
        .judged(fullest(reports)),
        claim(
            "the cost of finding lights is linear in their number",
            "[VanGelderen2020, §5.2]",
            "each against each cluster",
        )
        .confirmed_if("the growth of tests over that of lights, by brute force,", Unit::TIMES, Rule::Between(0.9, 1.1))
        .judged(linear(reports)),
    ];
    all.extend(TUNED.map(|(kind, paper, best)| {
        claim(format!("the best size of {kind} clusters"), "[VanGelderen2020, §6.2]", paper)
            .confirmed_if(
                "the part of the numbers of lights in which it has the least frame time",
                Unit::PERCENT,
                Rule::AtLeast(1.0),
            )
            .judged(best_size(reports, kind, best))
    }));
    all
}

fn stereo(reports: &Reports) -> Vec<Row> {
    let row = |(enclosed, own): (Node<'_>, Node<'_>)| {
        let ratio = |of: &dyn Fn(&Node<'_>) -> Found<f64>| Ok(of(&enclosed)? / of(&own)?);
        let row = Row::default().text("clusters", "clusters", enclosed.words("clusters"));
        let row = row.count("lights", "lights", lights(&enclosed) as u64);
        let row = measured(row, "visible", "visible clusters", 2, ratio(&|row| row.f64("counts/visible_clusters")));
        let row = measured(row, "listed", "lights listed", 2, ratio(&|row| row.f64("counts/lights_listed")));
        let row = measured(row, "clustering", "clustering time", 2, ratio(&clustering_ms));
        let row =
            measured(row, "operations", "lighting operations", 2, ratio(&|row| row.f64("counts/lighting_operations")));
        measured(row, "frame", "frame time", 2, ratio(&frame_ms))
    };
    pairs(reports).unwrap_or_default().into_iter().map(row).collect()
}

fn virtual_lights(reports: &Reports) -> Vec<Row> {
    let row = |(count, scene): (u32, &str)| {
        // By the thesis' own ranges, where there are rows of both.
        let found = || {
            let name = format!("app. B, vpl-count {count}");
            let is = |row: &Node<'_>| row.words("name").starts_with(&name);
            reports.part("virtual-lights")?.find("rows", &name, is)
        };
        let row = Row::default().number("lights", "virtual lights", count).text("scene", "thesis' scene", scene);
        let row = measured(row, "frame_ms", "frame, ms", 1, found().and_then(|row| row.f64("frame")));
        let row =
            measured(row, "energy", "energy of indirect light", 3, found().and_then(|row| row.f64("indirect_energy")));
        measured(row, "flip", "FLIP", 4, found().and_then(|row| row.f64("flip")))
    };
    VIRTUAL_LIGHTS.into_iter().map(row).collect()
}
