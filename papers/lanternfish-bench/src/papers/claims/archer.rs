//! [Archer2019]: compound deep images from one pass, and virtual lights with ranges from them.

use super::{
    COUNT, Claim, Figure, Found, MEGABYTES, MILLION_RAYS, MS, PERCENT, Reports, TIMES, at_least, at_most, claim,
};
use crate::papers::{faults::Fault, measure::Measure, rows::Node, tables::About};

pub const ABOUT: About = About {
    title: "Archer 2019: virtual lights with ranges from deep images",
    theirs: "The paper: Sponza's atrium (280,000 triangles) and Rungholt (7 million), 1920 x 1080, NVIDIA GeForce GTX 1060, 169 directions of 64².",
    comparable: "Here: lights in <virtual-lights> and <virtual-lights-many-triangles>; images of <deep-images> and \
        <deep-images-many-triangles>. Comparable: ratios of times, counts, memory and light. Not comparable: milliseconds and rays a second. \
        Rungholt is not to be had: the Bistro and demo:street stand for it.",
};

const DEEP: &str = "deep-images";
const LIGHTS: &str = "virtual-lights";
const MANY: &str = "virtual-lights-many-triangles";
const HIS: &str = "as in Archer 2019";
const PAPER: &str = "as in the paper";
/// The images of one pass are drawn direction by direction.
const A_DRAW_EACH: Fault =
    Fault::made("a-draw-each", DEEP, "Directions: as in Archer 2019", "deep-builder per_direction");
/// Three of his images.
const THREE: &str = "Directions: single_pass_literal, cube:1";
const SIZES: &str =
    "ranges up to 0.15 of the scene are kept and 10 % of the larger ones, so that 2,000 lights are listed";

fn built<'a>(all: &'a Reports, group: &str, is: impl Fn(&Node<'_>) -> bool) -> Found<Node<'a>> {
    all.row(DEEP, "built", |row| row.is("group", group) && is(row))
}

fn traced<'a>(all: &'a Reports, group: &str, tracer: &str, is: impl Fn(&Node<'_>) -> bool) -> Found<Node<'a>> {
    all.row(DEEP, "traced", |row| row.is("group", group) && row.is("structure", tracer) && is(row))
}

/// His images of so many directions, from one pass.
fn one_pass(all: &Reports, directions: u32) -> Found<Node<'_>> {
    built(all, "Directions", |row| row.is("images", HIS) && row.is("directions", directions))
}

/// Images in his directions that differ from his in one thing, in whose words these are.
fn his_but<'w>(words: &'w str) -> impl Fn(&Node<'_>) -> bool + use<'w> {
    move |row| row.words("images").contains("stacks") && row.words("images").contains(words)
}

fn is_his(row: &Node<'_>) -> bool {
    row.is("images", HIS)
}

fn lights<'a>(all: &'a Reports, part: &str) -> Found<Node<'a>> {
    all.named(part, "rows", PAPER)
}

/// Ranges of the largest map; those of smaller ones are before it.
fn ranges<'a>(all: &'a Reports, part: &str) -> Found<Node<'a>> {
    Ok(all.rows(part, "ranges", |_| true)?.pop().expect("at least one"))
}

fn range_rays(all: &Reports) -> Found<Figure> {
    let lights = lights(all, LIGHTS)?;
    let rays = lights.times(["range_rays", "ranges"])?;
    let note = format!("{:.2} % without building images", 100.0 * rays.value / lights.f64("frame")?);
    Ok((rays / lights.times(["frame", "steps/0", "steps/1"])?).noted(note))
}

fn fragments(all: &Reports) -> Found<Figure> {
    let is = |row: &Node<'_>| row.is("builder", "single_pass_literal") && row.is("directions", 169);
    let row = built(all, "Builders", is)?;
    let alike = built(all, "Builders", |row| row.is("builder", "per_direction") && row.is("directions", 169))?;
    let note = format!(
        "of fragments {:.2} ×. A triangle that faces up has 1.57 × the fragments of 13 x 13 draws, one that faces aside 2.46 ×: the loop of \
            fig. 3 cannot have 1.25",
        row.f64("holes/fragments")?
    );
    Ok((row.count("bytes")? / alike.count("bytes")?).noted(note))
}

pub fn claims() -> Vec<Claim> {
    vec![
        claim("a single pass is 20 to 100 times faster than a pass for each direction")
            .says("[Archer2019, §4]", "20 to 100 ×")
            .rule("a pass for each of 169 directions over one pass", TIMES, at_least(10.0))
            .lost_by(A_DRAW_EACH)
            .by(|all| {
                let is = |row: &Node<'_>| {
                    row.is("builder", "per_direction")
                        && row.words("set").starts_with("stacks")
                        && row.is("directions", 169)
                };
                Ok((built(all, "Directions", is)?.time("total_ms")? / one_pass(all, 169)?.time("total_ms")?).into())
            }),
        claim("the single pass gives the same indirect light")
            .says("[Archer2019, §4]", "no difference")
            .rule("its energy over that with a draw for each direction", TIMES, 0.98..=1.02)
            .lost_by(Fault::made("other-ranges", LIGHTS, "light: as in the paper, a draw", "vpl-most-range 0.3"))
            .by(|all| {
                let row = lights(all, LIGHTS)?;
                let ours = all.named(LIGHTS, "rows", "as in the paper, single_pass")?.f64("builder_energy")?;
                let note = format!("FLIP {:.4}, our single pass {ours:.2} ×", row.f64("builder_flip")?);
                Ok(row.count("builder_energy")?.noted(note))
            }),
        claim("many directions take little more time than few")
            .says("[Archer2019, table 2]", "3.13 ×, Atrium")
            .rule("128 directions over 8, at most twice his,", TIMES, at_most(6.26))
            .lost_by(A_DRAW_EACH)
            .by(|all| Ok((one_pass(all, 128)?.time("total_ms")? / one_pass(all, 8)?.time("total_ms")?).into())),
        claim("rays are at most 10 % slower with 20 times the triangles")
            .says("[Archer2019, §4]", "1.10 ×; 1.15–1.20 × in table 3")
            .rule(
                "rays for ranges a second with few triangles over those with many, as in his table,",
                TIMES,
                at_most(1.2),
            )
            .untestable("no scene of 20 times the triangles is at hand")
            .by(|all| {
                let [few, many] = [ranges(all, LIGHTS)?, ranges(all, MANY)?];
                Ok((few.time("deep_images_rate")? / many.time("deep_images_rate")?).into())
            }),
        claim("ranges cost 1 % of the frame")
            .says("[Archer2019, §4]", "1 %")
            .rule("their part of the frame, building images among it,", PERCENT, at_most(0.02))
            .fitted(SIZES)
            .by(range_rays),
        claim("arrays take at most twice as long to build as linked lists")
            .says("[Archer2019, §3.1]", "up to 2 ×")
            .rule("building arrays over linked lists", TIMES, at_most(2.0))
            .lost_by(Fault::made("slow-arrays", DEEP, "Stores: as in Archer 2019", "deep-builder per_direction"))
            .by(|all| {
                let lists = built(all, "Stores", his_but(", linked_list"))?;
                Ok((built(all, "Stores", is_his)?.time("total_ms")? / lists.time("total_ms")?).into())
            }),
        claim("rays through arrays are faster than through linked lists")
            .says("[Archer2019, §3.1]", "much faster")
            .rule("the rate of rays in random order over that through sorted linked lists", TIMES, at_least(1.5))
            .lost_by(Fault::made("two-lists", DEEP, "Stores: as in Archer 2019", "deep-store linked_list"))
            .by(|all| {
                let lists = traced(all, "Stores", "within-texel", his_but(", sorted_linked_list"))?;
                Ok((traced(all, "Stores", "within-texel", is_his)?.time("rate_random")? / lists.time("rate_random")?)
                    .into())
            }),
        claim("steps from fragment to fragment are faster than bisection")
            .says("[Archer2019, §3.2]", "binary search is slower")
            .rule("the rate of rays in random order over that of bisection", TIMES, at_least(1.0))
            .lost_by(Fault::made("both-bisect", DEEP, "Searches: as in Archer 2019", "deep-search bisection"))
            .by(|all| {
                let rate = |steps: &str| {
                    all.row(CARD, "traced", |row| {
                        row.is("group", "Searches") && row.is("structure", "within-texel") && row.is("images", steps)
                    })?
                    .f64("random_m_s")
                };
                let card = rate("per_triangle, linear steps")? / rate("per_triangle")?;
                let bisected = traced(all, "Searches", "within-texel", |row| row.words("images").contains("stacks"))?;
                let ratio = traced(all, "Searches", "within-texel", is_his)?.time("rate_random")?
                    / bisected.time("rate_random")?;
                Ok(ratio.noted(format!("NVIDIA H200, stored, 8 directions: {card:.2}")))
            }),
        claim("sorting in blocks of registers is faster than in memory")
            .says("[Archer2019, §3.1]", "very fast")
            .rule("sorting by selection over sorting in blocks", TIMES, at_least(1.0))
            .lost_by(Fault::made("both-select", DEEP, "Sorts: as in Archer 2019", "deep-sort selection"))
            .by(|all| {
                let selected =
                    built(all, "Sorts", |row| row.is("sort", "selection") && row.words("set").starts_with("stacks"))?;
                Ok((selected.time("sort_ms")? / built(all, "Sorts", is_his)?.time("sort_ms")?).into())
            }),
        claim("a single pass adds at most 25 % of memory")
            .says("[Archer2019, §3.1]", "up to 25 %")
            .rule("its bytes over those of a pass for each direction", TIMES, at_most(1.25))
            .lost_by(Fault::made(
                "more-samples",
                DEEP,
                "Builders: single_pass_literal, 169",
                "deep-builder per_triangle",
            ))
            .by(fragments),
        claim("rays within texels of many directions are faster than across texels of three")
            .says("[Archer2019, §1]", "few images are slow to raycast")
            .rule("the rate through 169 images of 64² over that through three of as many texels", TIMES, at_least(1.0))
            .lost_by(Fault::made("coarse-three", DEEP, "Directions: per_triangle, cube:1", "deep-resolution 8"))
            .by(|all| {
                let three =
                    traced(all, "Directions", "across-texels", |row| row.words("images") == "per_triangle, cube:1")?;
                let many = traced(all, "Directions", "within-texel", |row| is_his(row) && row.is("directions", 169))?;
                let wrong = |row: &Node<'_>| {
                    let [error, missed] = [row.f64("error_median")?, row.f64("missed")?].map(|part| 100.0 * part);
                    Ok::<_, String>(format!("{error:.1} % of the distance, {missed:.1} % miss"))
                };
                let note = format!("the answers differ: median error {}; of three {}", wrong(&many)?, wrong(&three)?);
                Ok((many.time("rate_random")? / three.time("rate_random")?).noted(note))
            }),
        claim("few images are faster to build than many")
            .says("[Archer2019, §1]", "few images are fast to build")
            .rule("three images of as many texels over 169, both by his pass, store and sort,", TIMES, at_most(1.0))
            .lost_by(Fault::made("three-are-many", DEEP, THREE, "deep-directions stacks:13x13, deep-resolution 64"))
            .by(|all| {
                let three = built(all, "Directions", |row| {
                    row.is("set", "cube:1") && row.is("builder", "single_pass_literal")
                })?;
                Ok((three.time("total_ms")? / one_pass(all, 169)?.time("total_ms")?).into())
            }),
        claim("1,250 million rays a second")
            .says("[Archer2019, table 3]", "1,250 M rays/s")
            .rule(
                "the rate of rays within a texel of 169 images of 64², in random order,",
                MILLION_RAYS,
                at_least(1250.0),
            )
            .lost_by(Fault::swapped("across-texels", CARD, "structure", ["within-texel", "across-texels"]))
            .by(|all| {
                let is = |row: &Node<'_>| {
                    row.is("group", "Resolution") && row.is("directions", 169) && row.is("resolution", 64)
                };
                let rate = all
                    .row(CARD, "traced", |row| is(row) && row.is("structure", "within-texel"))?
                    .time("random_m_s")?;
                Ok(rate.noted("NVIDIA H200, stored; rays alone, demo:atrium; his card is a GTX 1060"))
            }),
        claim("rays for ranges take ten times as long as random ranges")
            .says("[Archer2019, §4]", "10 ×")
            .rule("their time over that of random ranges, of every map, half to twice his,", TIMES, 5.0..=20.0)
            .lost_by(Fault::made("random-too", LIGHTS, "ranges by deep images", "vpl-ranges random"))
            .by(|all| {
                let ratio = |row: &Node<'_>| Ok(row.f64("deep_images_ms")? / row.f64("random_ms")?);
                let ratios = all.rows(LIGHTS, "ranges", |_| true)?.iter().map(ratio).collect::<Found<Vec<f64>>>()?;
                let (largest, count) = (ratios[ratios.len() - 1], ratios.len());
                // The maps repeat one another: between them lies what a margin stands for elsewhere.
                Ok(Measure::time(largest, ratios, 1.0, None).noted(format!("largest of {count} maps")))
            }),
        claim("the result is similar to one bounce")
            .says("[Archer2019, §4, fig. 7]", "similar")
            .rule("the energy of indirect light over the path tracer's", TIMES, 0.8..=1.25)
            .untestable("the scale of his weight by the number of lights is not stated, and it decides the energy")
            .by(|all| Ok(lights(all, LIGHTS)?.error("indirect_energy")?.into())),
        claim("20,000 of 65,536 lights are unique")
            .says("[Archer2019, §4]", "20,000")
            .rule("their number, half to twice his,", COUNT, 10_000.0..=40_000.0)
            .fitted("lights are merged within a distance of 0.02, so that 20,000 are left")
            .by(|all| Ok(lights(all, LIGHTS)?.count("unique")?.into())),
        claim("2,000 lights are listed after those of other sizes are discarded")
            .says("[Archer2019, §4]", "2,000")
            .rule("their number, half to twice his,", COUNT, 1000.0..=4000.0)
            .fitted(SIZES)
            .by(|all| {
                let row = lights(all, LIGHTS)?;
                Ok(row.count("listed")?.noted(format!(
                    "too small {}, too large {}",
                    row.f64("too_small")?,
                    row.f64("too_large")?
                )))
            }),
        claim("169 images take 18 MB")
            .says("[Archer2019, §4]", "18 MB")
            .rule("their memory, half to twice his,", MEGABYTES, 9e6..=36e6)
            .lost_by(Fault::made("finer-images", DEEP, "Directions: as in Archer 2019, 169", "deep-resolution 128"))
            .by(|all| {
                let row = one_pass(all, 169)?;
                Ok(row.count("bytes")?.noted(format!("{} fragments", row.f64("drawn")?)))
            }),
        total("all steps, Atrium", ["slow-images", LIGHTS], "20.6 ms", 20.6),
        total("all steps, Rungholt", ["slow-images-many", MANY], "43.5 ms", 43.5),
    ]
}

const CARD: &str = "nvidia-h200/deep-images";

/// The sum of all steps as it is printed; the rows sum to 20.15 and 43.0.
fn total(what: &'static str, [fault, part]: [&'static str; 2], paper: &'static str, most: f64) -> Claim {
    claim(what)
        .says("[Archer2019, table 1]", paper)
        .rule("the sum of all steps", MS, at_most(most))
        .lost_by(Fault::made(fault, part, "light: as in the paper", "deep-builder per_direction"))
        .of_a_card()
        .by(move |all| Ok(lights(all, part)?.time("steps/*")?.into()))
}
