//! `[Archer2019, §4]`: compound deep images, and virtual lights whose ranges they give.

use super::{
    claims::{Figure, Judged, Rule, Unit, claim},
    niessner::{by_triangles, slower},
    page::{Section, Table, measured},
    reports::{Found, Node, Reports},
};
use crate::{table::Row, virtual_lights::PAPER as STEPS};

/// Table 2, ms: Atrium and Rungholt by directions.
const DIRECTIONS: [(u32, f64, f64); 5] =
    [(8, 1.5, 18.0), (16, 1.8, 18.4), (32, 2.0, 18.6), (64, 3.2, 19.7), (128, 4.7, 21.3)];
/// Table 3, ms: Atrium, Rungholt and random ranges, by texels across the map.
const RANGES: [(u32, [f64; 3]); 4] =
    [(256, [0.5, 0.6, 0.04]), (512, [1.8, 2.1, 0.14]), (1024, [6.0, 6.9, 0.5]), (2048, [20.2, 23.5, 2.1])];
/// How many times as long a pass for each of 169 directions takes as one pass: Atrium and Rungholt.
const SINGLE_PASS: [f64; 2] = [22.0, 104.0];

pub fn section(reports: &Reports) -> Section {
    Section {
        title: "Archer 2019: virtual lights with ranges from deep images",
        theirs: "The paper: Sponza's atrium (280,000 triangles) and Rungholt (7 million), 1920 x 1080, NVIDIA GeForce GTX 1060, 169 directions of \
                 64².",
        comparable: format!(
            "Here: lights in {} and {}; images of {} and {}. Comparable: ratios of times, counts, memory and light. Not comparable: milliseconds \
             and rays a second. Rungholt is not to be had: the Bistro and demo:street stand for it.",
            reports.scene_of("virtual-lights"),
            reports.scene_of("virtual-lights-many-triangles"),
            reports.scene_of("deep-images"),
            reports.scene_of("deep-images-many-triangles")
        ),
        claims: claims(reports),
        tables: vec![
            Table { key: "archer_table_1", heading: "Table 1: steps, ms", rows: steps(reports) },
            Table {
                key: "archer_table_2",
                heading: "Table 2: building deep images by directions, ms",
                rows: directions(reports),
            },
            Table {
                key: "archer_table_3",
                heading: "Table 3: rays for ranges and random ranges, ms",
                rows: ranges(reports),
            },
        ],
    }
}

const PARTS: [&str; 2] = ["virtual-lights", "virtual-lights-many-triangles"];
const IMAGES: [&str; 2] = ["deep-images", "deep-images-many-triangles"];

/// Lights as in the paper.
fn papers_lights<'a>(reports: &'a Reports, part: &str) -> Found<Node<'a>> {
    reports.part(part)?.row("rows", "as in the paper")
}

/// A step of table 1.
fn step(row: &Node<'_>, i: usize) -> Found<f64> {
    row.f64(&format!("steps/{i}"))
}

/// All steps of table 1.
fn total(reports: &Reports, part: &str) -> Found<f64> {
    let row = papers_lights(reports, part)?;
    (0..STEPS.len()).map(|i| step(&row, i)).sum()
}

/// The part of ranges in the frame, building images among it.
fn range_share(reports: &Reports) -> Found<Figure> {
    let row = papers_lights(reports, PARTS[0])?;
    let ranges = row.f64("range_rays")? + row.f64("ranges")?;
    let frame = row.f64("frame")?;
    let without = format!("{:.2} % without building images", 100.0 * ranges / frame);
    Ok(Figure::of(ranges / (frame + step(&row, 0)? + step(&row, 1)?), without))
}

/// Images of so many directions by this builder, of his set where there are such, else of any.
fn built<'a>(reports: &'a Reports, part: &str, builder: &str, directions: u32) -> Found<Node<'a>> {
    let rows = reports.part(part)?.rows("built")?;
    let is = |row: &&Node<'_>| {
        row.words("builder") == builder
            && row.is("directions", directions)
            && row.is("resolution", 64)
            && row.is("supersampling", 1)
    };
    let mut rows = rows.iter().filter(is);
    let first = rows.clone().next().cloned();
    let his =
        rows.find(|row| row.words("set").starts_with("stacks") || row.words("images").contains("stacks")).cloned();
    his.or(first).ok_or_else(|| format!("{part}, table `built`: no {directions} directions of 64² by {builder}"))
}

/// By the single pass, or by the default builder where there is no such row.
fn built_by_any<'a>(reports: &'a Reports, part: &str, directions: u32) -> Found<Node<'a>> {
    built(reports, part, "single_pass", directions).or_else(|_| built(reports, part, "per_triangle", directions))
}

/// How many times as long a pass for each direction takes as the single pass.
fn brute_force(reports: &Reports) -> Found<f64> {
    let ms = |builder| built(reports, IMAGES[0], builder, 169)?.f64("total_ms");
    Ok(ms("per_direction")? / ms("single_pass")?)
}

/// The part of the surfaces of a pass for each direction that the single pass misses.
fn missing(reports: &Reports) -> Found<f64> {
    let is = |row: &Node<'_>| {
        row.words("builder") == "single_pass" && row.is("directions", 169) && row.f64("holes/missing").is_ok()
    };
    reports.part(IMAGES[0])?.find("built", "of 169 directions by single_pass with its holes", is)?.f64("holes/missing")
}

/// How many times as long 128 directions take as 8.
fn many_directions(reports: &Reports) -> Found<Figure> {
    let [few, many] = [8, 128].map(|directions| built_by_any(reports, IMAGES[0], directions));
    let (few, many) = (few?, many?);
    Ok(Figure::of(many.f64("total_ms")? / few.f64("total_ms")?, many.words("builder")))
}

/// Million rays a second of the largest map.
fn rate(reports: &Reports) -> Found<Figure> {
    let rows = reports.part(PARTS[0])?.rows("ranges")?;
    let row = rows.last().ok_or("virtual-lights, table `ranges`: no rows")?;
    let (rays, ms) = (6.0 * row.f64("lights")?, row.f64("deep_images_ms")?);
    Ok(Figure::of(rays / ms / 1e3, format!("{rays:.0} rays, a map of {}²", row.f64("map")?)))
}

/// Rays for ranges over random ranges, of the largest map.
fn over_random(reports: &Reports) -> Found<f64> {
    let rows = reports.part(PARTS[0])?.rows("ranges")?;
    let row = rows.last().ok_or("virtual-lights, table `ranges`: no rows")?;
    Ok(row.f64("deep_images_ms")? / row.f64("random_ms")?)
}

fn claims(reports: &Reports) -> Vec<Judged> {
    let is_software = reports.is_software;
    let lights = |key: &str| papers_lights(reports, PARTS[0])?.f64(key);
    let totals = ["Atrium", "Rungholt"].into_iter().zip(PARTS).zip([20.15, 43.0]).map(|((scene, part), paper)| {
        let claim =
            claim(format!("all steps, {scene}"), "[Archer2019, table 1]", Unit::MS.show(paper)).of_a_card(is_software);
        claim.confirmed_if("the sum of all steps", Unit::MS, Rule::AtMost(paper)).judged(total(reports, part))
    });
    let mut all = vec![
        claim(
            "a single pass is 22 to 104 times faster than a pass for each direction",
            "[Archer2019, §4]",
            "22 to 104 ×",
        )
        .confirmed_if("a pass for each of 169 directions over one pass", Unit::TIMES, Rule::half_of(SINGLE_PASS[0]))
        .judged(brute_force(reports)),
        claim("the single pass gives the same result", "[Archer2019, §4]", "no difference")
            .confirmed_if("the part of surfaces that it misses", Unit::PERCENT, Rule::AtMost(0.001))
            .judged(missing(reports)),
        claim("many directions take little more time than few", "[Archer2019, table 2]", "3.13 ×, Atrium")
            .confirmed_if("128 directions over 8", Unit::TIMES, Rule::AtMost(2.0 * 3.13))
            .judged(many_directions(reports)),
        claim(
            "rays are at most 10 % slower with 20 times the triangles",
            "[Archer2019, §4]",
            "1.10 ×; 1.15–1.20 × in table 3",
        )
        .confirmed_if(
            "rays a second with few triangles over those with many, as in his table,",
            Unit::TIMES,
            Rule::AtMost(1.2),
        )
        .judged(slower(by_triangles(reports, "within-texel", "rate_random"), 20.0)),
        claim("ranges cost 1 % of the frame", "[Archer2019, table 1]", "1 %")
            .confirmed_if("their part of the frame, building images among it,", Unit::PERCENT, Rule::AtMost(0.02))
            .judged(range_share(reports)),
        claim("1.25 thousand million rays a second", "[Archer2019, table 3]", "1,250 M rays/s")
            .of_a_card(is_software)
            .confirmed_if("the rate of rays for ranges", Unit::MILLION_RAYS, Rule::AtLeast(1250.0))
            .judged(rate(reports)),
        claim("rays for ranges take ten times as long as random ranges", "[Archer2019, table 3]", "10 ×")
            .confirmed_if("their time over that of random ranges, largest map,", Unit::TIMES, Rule::within_twice(10.0))
            .judged(over_random(reports)),
        claim("the result is similar to one bounce", "[Archer2019, fig. 7]", "similar")
            .confirmed_if("the energy of indirect light over the path tracer's", Unit::TIMES, Rule::Between(0.8, 1.25))
            .judged(lights("indirect_energy")),
        claim("20,000 of 65,536 lights are unique", "[Archer2019, §4]", "20,000")
            .confirmed_if("their number", Unit::COUNT, Rule::within_twice(20_000.0))
            .judged(lights("unique")),
        claim("2,000 lights are listed after those of other sizes are discarded", "[Archer2019, §4]", "2,000")
            .confirmed_if("their number", Unit::COUNT, Rule::within_twice(2000.0))
            .judged(lights("listed")),
        claim("169 images take 18 MB", "[Archer2019, §4]", "18 MB")
            .confirmed_if("their memory", Unit::MEGABYTES, Rule::within_twice(18e6))
            .judged(built_by_any(reports, IMAGES[0], 169).and_then(|row| row.f64("bytes"))),
    ];
    all.extend(totals);
    all
}

fn steps(reports: &Reports) -> Vec<Row> {
    let cells = |name: &'static str, [atrium, rungholt]: [f64; 2], ours: &dyn Fn(&str) -> Found<f64>| {
        let row = Row::default().text("step", "", name).number("paper_atrium", "his: Atrium", atrium);
        let row =
            measured(row, "atrium", "here", 2, ours(PARTS[0])).number("paper_rungholt", "his: Rungholt", rungholt);
        measured(row, "rungholt", "here, many triangles", 2, ours(PARTS[1]))
    };
    let row = |(i, (name, atrium, rungholt)): (usize, (&'static str, f64, f64))| {
        cells(name, [atrium, rungholt], &|part| papers_lights(reports, part).and_then(|row| step(&row, i)))
    };
    let mut rows: Vec<Row> = STEPS.into_iter().enumerate().map(row).collect();
    rows.push(cells("Total", [20.15, 43.0], &|part| total(reports, part)));
    rows
}

fn directions(reports: &Reports) -> Vec<Row> {
    let row = |(count, atrium, rungholt): (u32, f64, f64)| {
        let ours = |part: &str| built_by_any(reports, part, count);
        let builder = ours(IMAGES[0]).map_or_else(|_| "–".to_owned(), |row| row.words("images").to_owned());
        let row =
            Row::default().number("directions", "directions", count).number("paper_atrium", "his: Atrium", atrium);
        let row = measured(row, "atrium", "here", 2, ours(IMAGES[0]).and_then(|row| row.f64("total_ms")));
        let row = row.number("paper_rungholt", "his: Rungholt", rungholt);
        let row =
            measured(row, "rungholt", "here, many triangles", 2, ours(IMAGES[1]).and_then(|row| row.f64("total_ms")));
        row.text("builder", "built by", builder)
    };
    DIRECTIONS.into_iter().map(row).collect()
}

fn ranges(reports: &Reports) -> Vec<Row> {
    let row = |(map, [atrium, rungholt, random]): (u32, [f64; 3])| {
        let ours = |part: &str, key: &str| {
            reports.part(part)?.find("ranges", &format!("of a map of {map}²"), |row| row.is("map", map))?.f64(key)
        };
        let row = Row::default().number("map", "map", map).said_as(format_args!("{map}²"));
        let row = row.number("paper_atrium", "his: Atrium", atrium);
        let row = measured(row, "atrium", "here", 2, ours(PARTS[0], "deep_images_ms")).number(
            "paper_rungholt",
            "his: Rungholt",
            rungholt,
        );
        let row = measured(row, "rungholt", "here, many triangles", 2, ours(PARTS[1], "deep_images_ms"));
        let row = row.number("paper_random", "his: random", random);
        measured(row, "random", "here: random", 2, ours(PARTS[0], "random_ms"))
    };
    RANGES.into_iter().map(row).collect()
}
