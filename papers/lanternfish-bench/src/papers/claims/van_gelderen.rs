//! [VanGelderen2020]: clusters for two eyes, and other shapes of clusters.

use std::collections::BTreeSet;

use lanternfish_cli::timed::Timed;

use super::{Claim, Figure, Found, PERCENT, Reports, TIMES, at_least, at_most, claim};
use crate::papers::{
    faults::Fault,
    measure::Measure,
    rows::{Node, least, sum},
    tables::About,
};

pub const ABOUT: About = About {
    title: "Van Gelderen 2020: clustered shading for two eyes",
    theirs: "The thesis: Bistro (3.0 M triangles) and Sun Temple (1.6 M), 680 frames of 1280 x 720, far plane at 100, 1,000 to 100,000 falling \
        lights, GeForce GTX 1070 Ti. Its figures are plots without tables; the numbers here are those of its text.",
    comparable: "Here: one view of <clustered>, and the track <clustered-track>; times of shapes are those of the stored report of an NVIDIA \
        H200, one view of demo:atrium at 1280 x 720 (nvidia-h200/clustered.json), where this adapter is software. Comparable: counts, and \
        ratios between configurations. Not comparable: milliseconds. Rows by brute force are as the thesis has them; the tree is its future \
        work. Sun Temple is not to be had; the Bistro that is has 1.8 M triangles and nothing blended.",
};

const PART: &str = "clustered";
const TRACK: &str = "clustered-track";
const CARD: &str = "nvidia-h200/clustered";
/// Each eye has a grid of its own in the rows of one grid.
const TWO_GRIDS: Fault = Fault::made("two-grids", PART, "enclosed", "cluster-views individual");
const A_PYRAMID: &str = "it is geometry: a pyramid is a third of its box, whatever the scene";
const NO_TREE: Fault = Fault::made("no-tree", PART, "individual, hierarchy", "light-assignment brute_force");

/// Passes of clustering; as in the thesis, the depth pass is among them.
const CLUSTERING: [&str; 6] = ["ms/prepass", "ms/mark", "ms/compact", "ms/tree", "ms/count", "ms/write"];
const OF_CARD: [&str; 5] = ["visibility", "compact", "sort_tree", "count", "write"];

/// Each row with one grid around two eyes, and the one with a grid each.
pub fn pairs<'a>(all: &'a Reports, part: &str) -> Found<Vec<(Node<'a>, Node<'a>)>> {
    let [one, two] = if part == CARD {
        ["stereo, enclosed", "stereo, individual"]
    } else {
        ["stereo-enclosed", "stereo-individual"]
    };
    let with_own = |enclosed: Node<'a>| {
        let alike =
            |row: &Node<'_>| ["clusters", "lights", "assignment"].iter().all(|key| row.json[key] == enclosed.json[key]);
        let own = all.row(part, "rows", |row| row.is("views", two) && alike(row)).ok()?;
        Some((enclosed, own))
    };
    Ok(all.rows(part, "rows", |row| row.is("views", one))?.into_iter().filter_map(with_own).collect())
}

/// The sum of a figure with one grid, of clusters of this kind or of any, over the sum with two; and the range of the ratios.
fn enclosed(
    all: &Reports,
    part: &str,
    kind: &str,
    of: impl Fn(&Node<'_>) -> Found<Measure>,
) -> Found<(Measure, String)> {
    let mut pairs = pairs(all, part)?;
    pairs.retain(|(enclosed, _)| enclosed.words("clusters").starts_with(kind));
    let ratio = |(enclosed, own): &(Node<'_>, Node<'_>)| Ok::<_, String>(of(enclosed)?.value / of(own)?.value);
    let ratios = pairs.iter().map(ratio).collect::<Found<Vec<_>>>()?;
    let [low, high] = [f64::min, f64::max].map(|of| ratios.iter().copied().reduce(of).unwrap_or_default());
    let total = sum(pairs.iter().map(|pair| of(&pair.0)))? / sum(pairs.iter().map(|pair| of(&pair.1)))?;
    Ok((total, format!("sums of {} rows; single ones {low:.2} to {high:.2}", ratios.len())))
}

fn noted((measure, note): (Measure, String)) -> Figure {
    measure.noted(note)
}

/// Frames of one view on a card over those of persp:64, his best, with as many lights by the same assignment: the least of the sizes of a kind.
fn over_perspective(all: &Reports, kind: &str) -> Found<Figure> {
    let is_mono = |row: &Node<'_>| row.is("views", "mono") && row.is("assignment", "brute_force");
    let base = all.rows(CARD, "rows", |row| is_mono(row) && row.is("clusters", "persp:64"))?;
    let (mut ratios, mut said) = (Vec::new(), Vec::new());
    for base in base {
        let of_kind = |row: &Node<'_>| {
            is_mono(row) && row.words("clusters").starts_with(kind) && row.json["lights"] == base.json["lights"]
        };
        let frames =
            all.rows(CARD, "rows", of_kind)?.into_iter().map(|row| Ok(row.time("frame_ms")? / base.time("frame_ms")?));
        let ratio = least(frames.collect::<Found<Vec<_>>>()?).ok_or("no such clusters")?;
        said.push(format!("{} lights: {:.2}", base.f64("lights")?, ratio.value));
        ratios.push(ratio);
    }
    let best = least(ratios).ok_or("no rows by brute force")?;
    Ok(best.noted(format!("NVIDIA H200, stored; {}", said.join(", "))))
}

/// The deviation of a frame's tests and lighting operations along the track, over their mean.
fn unsteadiness(row: &Node<'_>) -> Found<f64> {
    let frames = row.json["report"]["frames"].as_array().ok_or("no frames")?;
    let cost = |frame: &serde_json::Value| {
        let [visible, operations] = ["visible", "lighting_operations"].map(|key| frame["clusters"][key].as_f64());
        Some(visible? * row.f64("lights").ok()? + operations?)
    };
    let costs: Vec<f64> = frames.iter().filter_map(cost).collect();
    let count = costs.len().max(1) as f64;
    let mean = costs.iter().sum::<f64>() / count;
    Ok((costs.iter().map(|cost| (cost - mean).powi(2)).sum::<f64>() / count).sqrt() / mean)
}

/// The least deviation of the tuned perspective and orthographic clusters over that of displaced ones, at the worst number of lights.
fn steadiest(all: &Reports) -> Found<Figure> {
    let mono = all.rows(TRACK, "played", |row| row.is("views", "mono"))?;
    let frames = mono[0].json["report"]["frames"].as_array().map_or(0, Vec::len);
    let (mut ratios, mut said) = (Vec::new(), Vec::new());
    for displaced in mono.iter().filter(|row| row.words("clusters").starts_with("displ")) {
        let others = mono.iter().filter(|row| {
            row.json["lights"] == displaced.json["lights"] && row.json["clusters"] != displaced.json["clusters"]
        });
        let others = others.map(unsteadiness).collect::<Found<Vec<f64>>>()?;
        let ratio = others.into_iter().fold(f64::INFINITY, f64::min) / unsteadiness(displaced)?;
        said.push(format!("{} lights: {ratio:.2}", displaced.f64("lights")?));
        ratios.push(Measure::exact(ratio));
    }
    let worst = least(ratios).ok_or("no displaced clusters")?;
    Ok(worst.noted(format!("light tests and lighting operations of {frames} frames; {}", said.join(", "))))
}

pub fn claims() -> Vec<Claim> {
    let of_eyes = |what, paper| claim(what).says("[VanGelderen2020, fig. 6.5]", paper).lost_by(TWO_GRIDS);
    vec![
        of_eyes("one grid around two eyes halves the visible clusters", "halved")
            .rule("enclosed over individual", TIMES, 0.4..=0.6)
            .by(|all| {
                // A shape has as many visible clusters with any number of lights.
                let (mut pairs, mut shapes) = (pairs(all, PART)?, BTreeSet::new());
                pairs.retain(|(enclosed, _)| shapes.insert(enclosed.words("clusters")));
                let visible = |row: &Node<'_>| row.count("counts/visible_clusters");
                let ratios = pairs.iter().map(|(one, two)| Ok((visible(one)? / visible(two)?).value));
                let ratios = Timed { runs: ratios.collect::<Found<_>>()? };
                let [low, high] = [ratios.least(), ratios.most()];
                Ok(Measure::exact(ratios.median())
                    .noted(format!("median of {} shapes; single ones {low:.2} to {high:.2}", ratios.runs.len())))
            }),
        of_eyes("one grid around two eyes shortens clustering", "lower")
            .rule("its passes, enclosed over individual, the depth pass among them,", TIMES, at_most(0.99))
            .by(|all| {
                let (card, _) = enclosed(all, CARD, "", |row| row.times(OF_CARD))?;
                let (ours, note) = enclosed(all, PART, "", |row| row.times(CLUSTERING))?;
                Ok(ours.noted(format!("{note}; NVIDIA H200, stored: {:.2}", card.value)))
            }),
        of_eyes(
            "one grid around two eyes takes fewer lighting operations, of perspective clusters",
            "seems to decrease",
        )
        .rule("enclosed over individual", TIMES, at_most(0.99))
        .by(|all| Ok(noted(enclosed(all, PART, "persp", |row| row.count("counts/lighting_operations"))?))),
        of_eyes("the frame gains little by one grid around two eyes", "marginal")
            .rule("the frame, enclosed over individual,", TIMES, 0.9..=1.0)
            .lost_by(NO_TREE)
            .by(|all| Ok(noted(enclosed(all, PART, "", |row| row.time("ms/*"))?))),
        claim("one grid gains less if finding lights is accelerated")
            .says("[VanGelderen2020, §5.3]", "larger benefits by brute force")
            .rule("clustering, enclosed over individual, with a tree over by brute force", TIMES, at_least(1.0))
            .lost_by(Fault::made("all-brute", PART, "hierarchy", "light-assignment brute_force"))
            .by(|all| {
                let of = |assignment: &'static str| {
                    let is =
                        move |row: &Node<'_>| row.is("views", "stereo, enclosed") && row.is("assignment", assignment);
                    let rows = all.rows(PART, "grids", is)?;
                    Ok::<_, String>(
                        sum(rows.iter().map(|row| row.time("culling")))? / Measure::exact(rows.len() as f64),
                    )
                };
                Ok((of("hierarchy")? / of("brute_force")?).into())
            }),
        claim("two thirds of an orthographic grid are outside of the view")
            .says("[VanGelderen2020, §4.2]", "2/3")
            .rule("the part of its volume", PERCENT, 0.6..=0.7)
            .untestable(A_PYRAMID)
            .by(|_| Err(A_PYRAMID.to_owned())),
        claim("orthographic clusters can be faster than perspective ones")
            .says("[VanGelderen2020, §1.4]", "can outperform")
            .rule("the least frame of any size and number of lights over that of persp:64", TIMES, at_most(0.99))
            .lost_by(Fault::swapped("ortho-is-persp", CARD, "clusters", ["ortho:1", "persp:64"]))
            .by(|all| over_perspective(all, "ortho")),
        claim("displaced clusters can be faster than perspective ones")
            .says("[VanGelderen2020, §1.4]", "can outperform")
            .rule("the least frame of any size and number of lights over that of persp:64", TIMES, at_most(0.99))
            .lost_by(Fault::swapped("displ-is-persp", CARD, "clusters", ["displ:64:8", "persp:64"]))
            .by(|all| over_perspective(all, "displ")),
        claim("displaced clusters have the steadiest frame")
            .says("[VanGelderen2020, fig. 6.6]", "more stable than either")
            .rule(
                "the least deviation of the other two over theirs, at the worst number of lights,",
                TIMES,
                at_least(1.0),
            )
            .lost_by(Fault::made("displ-is-ortho", TRACK, "displ", "clusters ortho:4"))
            .by(steadiest),
        claim("the cost of finding lights is linear in their number")
            .says("[VanGelderen2020, §5.3]", "grows linearly")
            .rule(
                "the growth of the time of counting by brute force over that of lights, 10,000 to 100,000,",
                TIMES,
                0.9..=1.1,
            )
            .lost_by(Fault::swapped("tree-is-brute", CARD, "assignment", ["hierarchy", "brute_force"]))
            .by(|all| {
                let is = |row: &Node<'_>, lights| {
                    row.is("views", "mono") && row.is("clusters", "persp:64") && row.is("lights", lights)
                };
                let count = |lights| {
                    all.row(CARD, "rows", |row| is(row, lights) && row.is("assignment", "brute_force"))?.time("count")
                };
                Ok((count(100_000)? / count(10_000)? / Measure::exact(10.0)).noted("NVIDIA H200, stored"))
            }),
        claim("the best sizes are Persp 64, Ortho 4 and Displ 64 32")
            .says("[VanGelderen2020, §6.2]", "all three")
            .rule("the least frame of other perspective sizes over that of persp:64", TIMES, at_least(1.0))
            .untestable("the best size is that of a scene, and frames of the Bistro on a card are not stored")
            .by(|all| over_perspective(all, "persp")),
    ]
}
