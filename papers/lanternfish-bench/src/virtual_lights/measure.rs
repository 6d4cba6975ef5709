//! Renders and times every configuration, and compares its image.

use lanternfish::settings::Tracer;
use lanternfish_cli::{error::CliError, parse::Size, report::grouped};
use lanternfish_papers::{
    VirtualLights, WITHIN_TEXEL,
    indirect::virtual_lights::{MapSize, Ranges},
};

use super::{
    cases::{WITH_STEPS, ranges_alone},
    steps::{PAPERS_LIGHTS, Steps},
};
use crate::{
    one_bounce::{Bench, Case, Rendered},
    run::counter,
    table::{DASH, Row},
};

/// Measures a row of the table, and returns it with its steps if they are compared with the paper's.
pub fn row(bench: &Bench, case: &Case) -> Result<(Row, Option<(String, Steps)>), CliError> {
    let (rendered, errors) = bench.row(case)?;
    let count = |name: &str| counter(&rendered.rendering.report, &format!("virtual_lights/{name}"));
    let arriving = count("flux_arriving");
    // Fraction of the arriving flux that arrives within ranges; `None` if flux is not counted.
    let in_range = (arriving > 0).then(|| count("flux_in_range") as f64 / arriving as f64);
    let steps = steps(&rendered);
    let has_steps = WITH_STEPS.contains(&&*case.name);
    let times = steps.steps;
    let row = Row::default()
        .text("name", "", &case.name)
        .data("has_steps", has_steps)
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
        .optional("in_range", "in range", in_range)
        .said_as(in_range.map_or(DASH.to_owned(), |ratio| format!("{ratio:.2}")));
    Ok((row.and(errors.row()), has_steps.then(|| (case.name.clone(), steps))))
}

/// How many texels of the map become lights, and how many of these are listed, of rows whose steps stand beside the paper's; with his.
pub fn lights(rows: &[Row]) -> Vec<Row> {
    let ours = rows.iter().filter(|row| *row.get("has_steps") == true).map(|row| {
        let count =
            |row: Row, (key, heading): (&'static str, &str), of: &Row| row.count(key, heading, of.f64(key) as u64);
        LIGHTS
            .into_iter()
            .fold(Row::default().text("name", "", row.words_of("name")), |made, key| count(made, key, row))
    });
    let his = PAPERS_LIGHTS.iter().map(|(name, counts)| {
        let counts = counts.iter().map(|count| Some(*count)).chain([None; 2]);
        LIGHTS.into_iter().zip(counts).fold(Row::default().text("name", "", name), |row, ((key, heading), count)| {
            row.optional(key, heading, count).said_as(count.map_or(DASH.to_owned(), grouped))
        })
    });
    let ours: Vec<_> = ours.collect();
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

fn steps(rendered: &Rendered) -> Steps {
    let mut steps = Steps::of(&rendered.rendering.report.passes);
    steps.steps[..2].copy_from_slice(&Steps::of(&rendered.first).steps[..2]);
    steps
}

/// Times of [Archer2019, table 3], ms, by map width in texels: Atrium and Rungholt with rays, and random ranges.
const RANGES: [(u32, [f64; 3]); 4] =
    [(256, [0.5, 0.6, 0.04]), (512, [1.8, 2.1, 0.14]), (1024, [6.0, 6.9, 0.5]), (2048, [20.2, 23.5, 2.1])];

/// Times of computing ranges for a map of this size: with rays through deep images and through the BVH, and for random ranges.
pub fn ranges(bench: &Bench, map: MapSize) -> Result<Row, CliError> {
    let of = |ranges, tracer| {
        // A small image, because only ranges are timed.
        bench.render(&ranges_alone(&bench.look, map, ranges, tracer), Size { width: 64, height: 36 })
    };
    let deep = of(Ranges::Average, WITHIN_TEXEL)?;
    let bvh = steps(&of(Ranges::Average, Tracer::BVH)?);
    let random = steps(&of(Ranges::Random, WITHIN_TEXEL)?);
    let lights = counter(&deep.rendering.report, "virtual_lights/unique");
    let deep = steps(&deep);
    Ok(range_row(
        map.texels(),
        lights,
        deep.build(),
        [deep.range_rays + deep.ranges, bvh.range_rays + bvh.ranges, random.ranges],
    ))
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
