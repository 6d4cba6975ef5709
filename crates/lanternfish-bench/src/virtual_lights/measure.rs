//! Renders and times every configuration, and compares its image.

use lanternfish_cli::{error::CliError, parse::Size, report::grouped};
use lanternfish_papers::{VirtualLights, indirect::virtual_lights::MapSize};

use super::{
    cases::{WITH_STEPS, ranges_alone},
    steps::{PAPERS_LIGHTS, Steps},
};
use crate::{
    bench::Timed,
    case::Case,
    one_bounce::OneBounce,
    table::{DASH, Row},
    times::counter,
    view::View,
};

/// A row of the table, without its errors.
pub fn row(case: &Case, timed: &Timed) -> Row {
    let count = |name: &str| counter(&timed.image.report, &format!("virtual_lights/{name}"));
    let arriving = count("flux_arriving");
    // Fraction of the arriving flux that arrives within ranges; `None` if flux is not counted.
    let in_range = (arriving > 0).then(|| count("flux_in_range") as f64 / arriving as f64);
    let steps = Steps::of_timed(timed);
    let times = steps.steps;
    Row::default()
        .text("name", "", &case.name)
        .data("has_steps", WITH_STEPS.contains(&&*case.name))
        .data("steps", times)
        .fixed("frame", "frame, ms", 0, steps.frame)
        .shown("map", format_args!("{:.1}", times[3]))
        .shown("lights built", format_args!("{:.1}", times[4]))
        .shown("lists", format_args!("{:.1}", times[5]))
        .shown("gathered", format_args!("{:.0}", times[6]))
        .fixed("shadow_rays", "of these: shadow rays", 0, steps.shadow_rays)
        .fixed("range_rays", "range rays", 1, steps.range_rays)
        .said_as(format_args!("{:.2} %", 100.0 * steps.range_rays / steps.frame))
        .data("ranges", steps.ranges)
        .data("build_ms", steps.build())
        .data("total_ms", steps.total())
        .data("map_texels", case.settings.indirect.get::<VirtualLights>().map(|lights| lights.map.texels().pow(2)))
        .count("unique", "unique", count("unique"))
        .count("listed", "listed", count("listed"))
        .count("too_small", "too small", count("too_small"))
        .count("too_large", "too large", count("too_large"))
        .maybe("in_range", "in range", 2, in_range)
}

/// How many texels of the map become lights, and how many of these are listed, of rows whose steps stand beside the paper's; with his.
pub fn lights(rows: &[Row]) -> Vec<Row> {
    let row = |name: &str, counts: [Option<u64>; 5]| {
        let with = |row: Row, ((key, heading), count): ((&'static str, &str), Option<u64>)| {
            row.optional(key, heading, count).said_as(count.map_or(DASH.to_owned(), grouped))
        };
        LIGHTS.into_iter().zip(counts).fold(Row::default().text("name", "", name), with)
    };
    let ours = rows.iter().filter(|row| *row.get("has_steps") == true);
    let ours: Vec<_> =
        ours.map(|of| row(of.words_of("name"), LIGHTS.map(|(key, _)| Some(of.f64(key) as u64)))).collect();
    let his = PAPERS_LIGHTS
        .iter()
        .map(|(name, [map, unique, listed])| row(name, [Some(*map), Some(*unique), Some(*listed), None, None]));
    if ours.is_empty() { ours } else { ours.into_iter().chain(his).collect() }
}

/// Columns of the table of lights.
const LIGHTS: [(&str, &str); 5] = [
    ("map_texels", "texels of the map"),
    ("unique", "unique"),
    ("listed", "listed"),
    ("too_small", "too small"),
    ("too_large", "too large"),
];

#[test]
fn lights_of_the_papers_rows_stand_beside_his() {
    let row = |name: &str, has_steps| {
        let row = Row::default().text("name", "", name).data("has_steps", has_steps);
        LIGHTS.into_iter().zip(1u64..).fold(row, |row, ((key, heading), n)| row.count(key, heading, 1000 * n))
    };
    let table = crate::table::to_markdown(&lights(&[row("none", false), row("ours", true)]));
    assert!(table.ends_with(
        "| ours | 1,000 | 2,000 | 3,000 | 4,000 | 5,000 |\n| Archer: Atrium | 65,536 | 20,000 | 2,000 | – | – |\n\
         | Archer: Rungholt | 65,536 | 20,000 | 8,000 | – | – |\n"
    ));
    assert_eq!(lights(&[row("none", false)]), []);
}

/// Times of [Archer2019, table 3], ms, by map width in texels: Atrium and Rungholt with rays, and random ranges.
const RANGES: [(u32, [f64; 3]); 4] =
    [(256, [0.5, 0.6, 0.04]), (512, [1.8, 2.1, 0.14]), (1024, [6.0, 6.9, 0.5]), (2048, [20.2, 23.5, 2.1])];

/// Times of computing ranges for a map of this size: with rays through deep images and through the BVH, and for random ranges.
pub fn ranges(of: &OneBounce, map: MapSize) -> Result<Row, CliError> {
    // A small image, because only ranges are timed.
    let small = View { size: Size { width: 64, height: 36 }, ..of.view.clone() };
    let timed = |ranges| of.bench.timed(&small, &ranges_alone(&of.view.look, map, ranges));
    let deep = timed("vpl-ranges average")?;
    let [bvh, random] = ["vpl-ranges average, vpl-range-tracer bvh", "vpl-ranges random"].map(timed);
    let (bvh, random) = (Steps::of_timed(&bvh?), Steps::of_timed(&random?));
    let (lights, deep) = (counter(&deep.image.report, "virtual_lights/unique"), Steps::of_timed(&deep));
    let ms = [deep.range_rays + deep.ranges, bvh.range_rays + bvh.ranges, random.ranges];
    Ok(range_row(map.texels(), lights, deep.build(), ms))
}

/// `lights`: that rays were cast from; `build`: milliseconds of building deep images.
fn range_row(map: u32, lights: u64, build: f64, [deep, bvh, random]: [f64; 3]) -> Row {
    let rate = |ms: f64| format!("{:.2}", 6.0 * lights as f64 / ms / 1e3);
    let paper = RANGES.iter().find(|(width, _)| *width == map);
    let row = Row::default()
        .number("map", "map", map)
        .said_as(format_args!("{map}²"))
        .data("lights", lights)
        .shown("rays", grouped(6 * lights))
        .fixed("deep_images_ms", "deep images, ms", 1, deep)
        .shown("M rays/s", rate(deep))
        .fixed("build_ms", "with their build, ms", 1, build)
        .said_as(format_args!("{:.1}", build + deep))
        .fixed("bvh_ms", "BVH, ms", 1, bvh)
        .shown("M rays/s", rate(bvh))
        .fixed("random_ms", "random, ms", 2, random);
    let names = ["Atrium", "Rungholt", "random"].into_iter().enumerate();
    names.fold(row, |row, (i, name)| row.shown(name, paper.map_or(DASH.to_owned(), |(_, ms)| ms[i].to_string())))
}

#[test]
fn his_figures_stand_beside_the_map_that_they_are_of() {
    let row = |map| crate::table::to_markdown(&[range_row(map, 1000, 7.0, [2.0, 3.0, 0.5])]);
    assert!(row(512).ends_with("\n| 512² | 6,000 | 2.0 | 3.00 | 9.0 | 3.0 | 2.00 | 0.50 | 1.8 | 2.1 | 0.14 |\n"));
    assert!(row(64).ends_with("| – | – | – |\n"));
}
