//! `[Elagabani2025, ch. 5]`: what each way to save shadow rays saves, tiles, normals from depth.

use super::{
    claims::{Figure, Judged, Rule, Unit, claim},
    page::{Section, Table, measured},
    reports::{Found, Node, Reports},
};
use crate::table::Row;

/// Table 5.1: rows of the bench, and the thesis' frame time, ms.
const CONFIGURATIONS: [(&str, f64); 6] =
    [(NONE, 16.0), ("light culling", 11.52), (AABB, 10.93), (NAIVE, 9.59), (IMPROVED, 9.67), (FACING, 13.55)];
const NONE: &str = "no optimisations";
const AABB: &str = "light culling + AABB";
const NAIVE: &str = "light culling + AABB + naive normals";
const IMPROVED: &str = "light culling + AABB + improved normals";
const FACING: &str = "improved normals";

/// Its tables: as the lights of the scene are, and with ranges by the thesis' eq. 4.1.
const TABLES: [&str; 2] = ["configurations", "configurations_at_paper_threshold"];

/// Table 5.2, ms.
const TILES: [(&str, f64); 3] = [("8 x 8", 9.44), ("16 x 16", 9.56), ("32 x 32", 9.99)];

/// Fig. 5.3: mean FLIP of normals from depth.
const NORMALS: [(&str, f64); 2] = [("naive", 0.07975), ("improved", 0.02264)];

pub fn section(reports: &Reports) -> Section {
    Section {
        title: "Elagabani 2025: hybrid Forward+",
        theirs: "The thesis: Sponza, ten point lights whose ranges were set by hand, 1920 x 1080, Nvidia RTX 2060 SUPER, Ryzen 7 3700X, \
                 rays in hardware. Frame times are means over a second.",
        comparable: format!(
            "Here: {}. Comparable: how a frame's time and its number of rays change from one configuration to the next, and how the memory of \
             lists grows. Not comparable: milliseconds, and the thesis' lights, which it does not list. Rays go through the BVH in compute \
             shaders, so that the shadow pass costs more than in hardware. FLIP of normals depends on the size of the image.",
            reports.scene_of("forward-plus")
        ),
        claims: claims(reports),
        tables: vec![
            Table {
                key: "elagabani_table_5_1",
                heading: "Table 5.1: optimisations, tiles of 8 x 8",
                rows: optimisations(reports, TABLES[0]),
            },
            Table {
                key: "elagabani_table_5_1_threshold",
                heading: "The same at the threshold of 0.02 of eq. 4.1, if the lights above end elsewhere",
                rows: optimisations(reports, TABLES[1]),
            },
            Table { key: "elagabani_table_5_2", heading: "Table 5.2: sizes of tiles", rows: tiles(reports) },
            Table { key: "elagabani_figure_5_3", heading: "Fig. 5.3: normals from depth", rows: normals(reports) },
        ],
    }
}

/// A row of table 5.1. With normals the thesis culls rays by facing alone: rows that are culled by range too, as reports without false
/// positives have them, are others.
fn configuration<'a>(reports: &'a Reports, table: &str, name: &str) -> Found<Node<'a>> {
    let row = reports.part("forward-plus")?.row(table, name)?;
    if name.ends_with("normals") && row.f64("false_positives").is_err() {
        return Err(format!("forward-plus: rays of the row {name} are culled by range too"));
    }
    Ok(row)
}

/// How a figure changes from no optimisations to these.
fn change(reports: &Reports, table: &str, name: &str, key: &str) -> Found<f64> {
    Ok(configuration(reports, table, name)?.f64(key)? / configuration(reports, table, NONE)?.f64(key)? - 1.0)
}

/// The saving of frame time, with that of rays.
fn saving(reports: &Reports, name: &str) -> Found<Figure> {
    let change = |key| change(reports, TABLES[0], name, key);
    Ok(Figure::of(-change("frame_ms")?, format!("rays {:+.1} %", 100.0 * change("rays")?)))
}

/// Bytes of the lists of a size of tiles: as counted, or a word for each listed light and the start of each tile's list.
fn list_bytes(reports: &Reports, name: &str, pixels: f64) -> Found<f64> {
    let report = reports.part("forward-plus")?;
    let row = report.row("tile_sizes", name)?;
    let tiles = (report.f64("width")? / pixels).ceil() * (report.f64("height")? / pixels).ceil();
    row.f64("list_bytes").or_else(|_| Ok(4.0 * (row.f64("listed_lights")? + tiles + 1.0)))
}

/// The part of the frame that shadow rays take, the mean of the thesis' configurations.
fn shadow_share(reports: &Reports) -> Found<f64> {
    let share = |(name, _): &(&str, f64)| {
        let row = configuration(reports, TABLES[0], name).ok()?;
        Some(row.f64("shadow_ms").ok()? / row.f64("frame_ms").ok()?)
    };
    configuration(reports, TABLES[0], NONE)?;
    let shares: Vec<f64> = CONFIGURATIONS.iter().filter_map(share).filter(|share| *share > 0.0).collect();
    if shares.is_empty() {
        Err("passes were not timed".to_owned())
    } else {
        Ok(shares.iter().sum::<f64>() / shares.len() as f64)
    }
}

fn claims(reports: &Reports) -> Vec<Judged> {
    let saves = |what, paper, gain, name| {
        let rule = claim(what, "[Elagabani2025, table 5.1]", paper);
        rule.confirmed_if("the saving of frame time", Unit::PERCENT, Rule::half_of(gain)).judged(saving(reports, name))
    };
    let frame = |name| configuration(reports, TABLES[0], name)?.f64("frame_ms");
    let tile = |name: &str| reports.part("forward-plus")?.row("tile_sizes", name)?.f64("frame_ms");
    let flip = |name: &str| reports.part("forward-plus")?.row("normals", name)?.f64("mean_flip");
    let grown = |from, to| Ok(list_bytes(reports, to, 8.0)? / list_bytes(reports, from, 16.0)?);
    let normals = |(name, paper): (&str, f64)| {
        let claim =
            claim(format!("error of {name} normals from depth"), "[Elagabani2025, fig. 5.3]", format!("FLIP {paper}"));
        claim.confirmed_if("the mean FLIP", Unit::FLIP, Rule::within_twice(paper)).judged(flip(name))
    };
    let times = |numerator: Found<f64>, denominator: Found<f64>| Ok(numerator? / denominator?);
    let mut all = vec![
        saves("all optimisations shorten the frame", "saves 39.56 %", 0.3956, IMPROVED),
        saves("light culling alone shortens the frame", "saves 28.00 %", 0.28, "light culling"),
        saves("light culling with the AABB test shortens the frame", "saves 31.69 %", 0.3169, AABB),
        saves("culling rays by facing alone shortens the frame", "saves 15.31 %", 0.1531, FACING),
        claim("the AABB test shortens the frame", "[Elagabani2025, ch. 5]", "saves 5.12 %")
            .confirmed_if("the saving of frame time", Unit::PERCENT, Rule::half_of(0.0512))
            .judged(times(frame(AABB), frame("light culling")).map(|ratio| 1.0 - ratio)),
        claim("improved normals take little longer than naive ones", "[Elagabani2025, ch. 5]", "+0.8 %")
            .confirmed_if("the time of a frame over that with naive normals", Unit::TIMES, Rule::AtMost(1.05))
            .judged(times(frame(IMPROVED), frame(NAIVE))),
        claim("shadow rays take most of the frame", "[Elagabani2025, ch. 5]", "92 %")
            .confirmed_if("their part of the frame, within ten points,", Unit::PERCENT, Rule::AtLeast(0.82))
            .judged(shadow_share(reports)),
        claim("halving the size of tiles quadruples the memory of lists", "[Elagabani2025, ch. 5]", "4 ×")
            .confirmed_if("the memory at 8 x 8 over that at 16 x 16", Unit::TIMES, Rule::Between(3.0, 5.0))
            .judged(grown("16 x 16", "8 x 8")),
        claim("smaller tiles shorten the frame to a small degree", "[Elagabani2025, table 5.2]", "0.99 ×")
            .confirmed_if("the frame at 8 x 8 over that at 16 x 16", Unit::TIMES, Rule::Between(0.9, 1.0))
            .judged(times(tile("8 x 8"), tile("16 x 16"))),
    ];
    all.extend(NORMALS.map(normals));
    let factor = claim("improved normals have less error than naive ones", "[Elagabani2025, fig. 5.3]", "3.52 ×");
    let factor =
        factor.confirmed_if("the error of naive normals over that of improved ones", Unit::TIMES, Rule::half_of(3.52));
    all.push(factor.judged(times(flip("naive"), flip("improved"))));
    all
}

fn percent(change: f64) -> String {
    format!("{:+.2} %", 100.0 * change)
}

fn optimisations(reports: &Reports, table: &str) -> Vec<Row> {
    let row = |(name, paper): &(&'static str, f64)| {
        let ours = |key: &str| configuration(reports, table, name)?.f64(key);
        let changed = |key: &str| change(reports, table, name, key).map(|ratio| 100.0 * ratio);
        let row = Row::default().text("name", "", name).number("paper_ms", "thesis: frame ms", *paper);
        let row = row.shown("thesis: change", percent(paper / CONFIGURATIONS[0].1 - 1.0));
        let row = measured(row, "frame_ms", "frame ms", 2, ours("frame_ms"));
        let row = measured(row, "frame_change", "change, %", 2, changed("frame_ms"));
        let row = measured(row, "rays", "rays", 0, ours("rays"));
        let row = measured(row, "rays_change", "change, %", 2, changed("rays"));
        let row =
            measured(row, "shadow_part", "shadow rays, % of frame", 1, ours("shadow_part").map(|part| 100.0 * part));
        measured(row, "false_positives", "false positives, %", 1, ours("false_positives").map(|part| 100.0 * part))
    };
    CONFIGURATIONS.iter().map(row).collect()
}

fn tiles(reports: &Reports) -> Vec<Row> {
    let row = |((name, paper), pixels): ((&'static str, f64), f64)| {
        let ours = |key: &str| reports.part("forward-plus")?.row("tile_sizes", name)?.f64(key);
        let row = Row::default().text("name", "tiles", name).number("paper_ms", "thesis: frame ms", paper);
        let row = measured(row, "frame_ms", "frame ms", 2, ours("frame_ms"));
        let row = measured(row, "listed_lights", "listed lights", 0, ours("listed_lights"));
        measured(row, "list_bytes", "bytes of lists", 0, list_bytes(reports, name, pixels))
    };
    TILES.into_iter().zip([8.0, 16.0, 32.0]).map(row).collect()
}

fn normals(reports: &Reports) -> Vec<Row> {
    let row = |(name, paper): (&'static str, f64)| {
        let ours = |key: &str| reports.part("forward-plus")?.row("normals", name)?.f64(key);
        let row = Row::default().text("name", "", name).number("paper_flip", "thesis: mean FLIP", paper);
        let row = measured(row, "mean_flip", "mean FLIP", 5, ours("mean_flip"));
        measured(row, "mean_degrees", "mean angle, degrees", 2, ours("mean_degrees"))
    };
    NORMALS.into_iter().map(row).collect()
}
