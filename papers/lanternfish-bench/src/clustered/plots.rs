//! Plots of the clustered benchmark.

use lanternfish_cli::{
    plot::{Axis, Curve, bars, curves},
    report::grouped,
    scene::SceneName,
};

use super::{cases::Views, measure::Measured, steps};

/// One hue per kind of cluster; smaller clusters are darker.
const COLORS: [(&str, &[&str]); 3] = [
    ("persp", &["#08306b", "#2171b5", "#6baed6", "#b3d3e8"]),
    ("ortho", &["#7f2704", "#d94801", "#fd8d3c", "#fdc38d"]),
    ("displ", &["#00441b", "#41ab5d", "#a1d99b"]),
];

const STEP_COLORS: [&str; 8] = ["#888888", "#56b4e9", "#0072b2", "#009e73", "#e69f00", "#d55e00", "#f0e442", "#cccccc"];

/// File names and SVG texts of all plots.
pub fn plots(scene: &SceneName, rows: &[Measured]) -> Vec<(&'static str, String)> {
    let mono: Vec<&Measured> =
        rows.iter().filter(|row| row.views == Views::Mono && row.assignment == "hierarchy").collect();
    let most_lights = mono.iter().map(|row| row.lights).max().unwrap_or(0);
    let most: Vec<&Measured> = mono.iter().copied().filter(|row| row.lights == most_lights).collect();
    let named = |what: &str| format!("{what}: {scene}, {} lights, one view", grouped(most_lights as u64));
    let histogram = |title: &str, label: &str, of: fn(&Measured) -> &Vec<u64>| {
        let curves_of: Vec<Curve> = most.iter().map(|row| distribution(row, &most, of(row))).collect();
        let bins = most.iter().map(|row| of(row).len()).max().unwrap_or(1) + 1;
        let highest = curves_of.iter().flat_map(|c| &c.points).map(|(_, fraction)| *fraction).fold(0.1, f64::max);
        let ticks = (0..bins).step_by(bins.div_ceil(10)).map(|bin| (bin as f64, bin_name(bin)));
        let x = Axis::of(label, [0.0, (bins - 1) as f64], ticks.collect());
        let y = Axis::of("fraction of visible clusters", [0.0, highest], fractions(highest));
        curves(&named(title), &x, &y, &curves_of)
    };
    vec![
        ("light-tests.svg", light_tests(scene, &mono)),
        ("steps.svg", steps_of(&named("Steps of a frame"), &most)),
        (
            "clusters-by-lights.svg",
            histogram("Lights of a cluster", "lights listed, from", |row| &row.counts.clusters_by_lights),
        ),
        (
            "clusters-by-fragments.svg",
            histogram("Fragments of a cluster", "visible fragments, from", |row| &row.counts.clusters_by_fragments),
        ),
    ]
}

fn color(clusters: &str, rows: &[&Measured]) -> &'static str {
    let kind = clusters.split(':').next().unwrap_or_default();
    let mut names: Vec<&str> = rows.iter().map(|row| row.clusters.as_str()).filter(|n| n.starts_with(kind)).collect();
    names.dedup();
    let index = names.iter().position(|name| *name == clusters).unwrap_or(0);
    let hues = COLORS.iter().find(|(name, _)| *name == kind).map_or(COLORS[0].1, |(_, hues)| hues);
    // A single one takes the middle shade.
    if names.len() == 1 { hues[1] } else { hues[index.min(hues.len() - 1)] }
}

fn light_tests(scene: &SceneName, mono: &[&Measured]) -> String {
    let mut names: Vec<&str> = mono.iter().map(|row| row.clusters.as_str()).collect();
    names.dedup();
    let lights = || mono.iter().map(|row| row.lights as f64);
    let tests = || mono.iter().map(|row| row.counts.light_tests.max(1) as f64);
    let least = 10f64.powf(tests().fold(f64::MAX, f64::min).clamp(1.0, 1e18).log10().floor());
    let most = 10f64.powf(tests().fold(10.0 * least, f64::max).log10().ceil());
    let decades = |low: f64, high: f64| {
        let decade = |k: i32| (10f64.powi(k), grouped(10u64.pow(k.unsigned_abs())));
        (low.log10().round() as i32..=high.log10().round() as i32).map(decade).collect::<Vec<_>>()
    };
    let x_ends = [lights().fold(1e9, f64::min), lights().fold(1.0, f64::max)];
    let x_ends = if x_ends[0] < x_ends[1] { x_ends } else { [1.0, 1e6] };
    let x = Axis {
        label: "lights, at a constant number per point",
        ends: x_ends,
        logarithmic: true,
        ticks: decades(x_ends[0], x_ends[1]),
    };
    let ticks = decades(least, most).into_iter().map(|(at, _)| (at, format!("10^{}", at.log10().round()))).collect();
    let y = Axis { label: "tests of lights and nodes", ends: [least, most], logarithmic: true, ticks };
    let curve = |name: &&str| Curve {
        name: (*name).to_owned(),
        color: color(name, mono),
        dashed: false,
        marked: true,
        points: mono
            .iter()
            .filter(|row| row.clusters == *name)
            .map(|row| (row.lights as f64, row.counts.light_tests as f64))
            .collect(),
    };
    let title = format!("Light tests with the hierarchy: {scene}, one view");
    curves(&title, &x, &y, &names.iter().map(curve).collect::<Vec<_>>())
}

fn steps_of(title: &str, most: &[&Measured]) -> String {
    let parts: Vec<_> = steps::NAMES.into_iter().zip(STEP_COLORS).collect();
    let rows: Vec<_> = most.iter().map(|row| (row.clusters.clone(), row.ms.0.to_vec())).collect();
    bars(title, "milliseconds", &parts, &rows)
}

fn distribution(row: &Measured, rows: &[&Measured], bins: &[u64]) -> Curve {
    let sum = row.counts.visible_clusters.max(1) as f64;
    Curve {
        name: row.clusters.clone(),
        color: color(&row.clusters, rows),
        dashed: false,
        marked: true,
        // A zero after the last bin closes the curve.
        points: bins.iter().chain([&0]).enumerate().map(|(bin, count)| (bin as f64, *count as f64 / sum)).collect(),
    }
}

/// Label of a bin: its least value.
fn bin_name(bin: usize) -> String {
    grouped(if bin == 0 { 0 } else { 1 << (bin - 1) })
}

/// Axis ticks up to `highest`, every 10 % or 20 %.
fn fractions(highest: f64) -> Vec<(f64, String)> {
    let step = if highest > 0.5 { 0.2 } else { 0.1 };
    let count = (highest / step) as usize;
    (0..=count).map(|i| (i as f64 * step, format!("{:.0} %", 100.0 * i as f64 * step))).collect()
}
