//! The bench's results as a page.

use std::fmt::Write;

use super::{Places, Results, measure::Row};
use lanternfish_cli::report::grouped;

pub fn to_markdown(results: &Results) -> String {
    let mut page = String::new();
    // Writing to a String cannot fail.
    let mut line = |text: &str| writeln!(page, "{text}").expect("String");
    let Results { width, height, eye_width, .. } = results;
    line(&format!("# Clustered light culling: {}\n", results.scene));
    let places = match results.lights {
        Places::Rain => "light rain",
        Places::Random => "lights at random",
    };
    line(&format!(
        "{width} x {height}, each eye {eye_width} x {height} (HTC Vive, 63 mm apart); {places}, seed {}, whose radius lets 12 lights reach \
         a point whatever their number; no shadows. {} on {}, Lanternfish {}. Times: medians of {}, to be compared within this page \
         only. Counts are exact.\n",
        results.seed, results.adapter, results.driver, results.version, results.runs
    ));
    schemes(results, &mut line);
    if results.rows.is_empty() && results.left_out.is_empty() {
        left_out(results, &mut line);
        return page;
    }
    line("\n## Clusters\n");
    line(&format!(
        "Clusters are named as `--clusters` has them: as wide as 16, 32, 64 and 128 pixels are in 720 rows, or cubes of 1 to 8 m, or displaced \
             by 8 and 32 m, and reach at least {} m from the eye.\n",
        results.depth
    ));
    for promise in &results.promises {
        line(&format!("- {}", promise.line()));
    }
    let mut counts: Vec<usize> = results.rows.iter().map(|row| row.lights).collect();
    counts.sort_unstable();
    counts.dedup();
    for lights in counts {
        line(&format!("\n## {} lights\n", grouped(lights as u64)));
        line(
            "| clusters | views | assignment | visible clusters | of | lights listed | light tests | lighting operations | a fragment \
             | KiB | visibility | compact | sort + tree | count | write | shading | frame ms |",
        );
        line("|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
        for row in results.rows.iter().filter(|row| row.lights == lights) {
            line(&table_row(row));
        }
    }
    line(
        "\nVisibility: the depth pass and counting fragments, as in fig. 6.8. Lighting operations: lights of its cluster's list, summed over all fragments. Plots: light tests by the number of lights \
         (`light-tests.svg`), steps of a frame (`steps.svg`, fig. 6.7 and 6.8), clusters by their lights and by their fragments \
         (`clusters-by-*.svg`, fig. 6.9 and 6.10).",
    );
    left_out(results, &mut line);
    page
}

/// What has no figures.
fn left_out(results: &Results, line: &mut impl FnMut(&str)) {
    if !(results.left_out.is_empty() && results.schemes_left_out.is_empty()) {
        line("\n## Left out\n");
    }
    for row in &results.left_out {
        let lights = grouped(row.lights as u64);
        line(&format!("- {}, {lights} lights, {}, {}: {}", row.clusters, row.views, row.assignment, row.reason));
    }
    for row in &results.schemes_left_out {
        line(&format!("- {}, {} lights: {}", row.scheme, grouped(row.lights as u64), row.reason));
    }
}

/// Schemes of light culling beside each other.
fn schemes(results: &Results, line: &mut impl FnMut(&str)) {
    line("\n## Schemes, one view\n");
    line("| lights | scheme | lights listed | light tests | KiB | building ms | shading ms |");
    line("|---:|---|---:|---:|---:|---:|---:|");
    let mut rows: Vec<_> = results.schemes.iter().collect();
    rows.sort_by_key(|row| row.lights);
    for row in rows {
        let [lights, listed, tests, kib] =
            [row.lights as u64, row.lights_listed, row.light_tests, row.bytes / 1024].map(grouped);
        let (building, shading) = (row.building_ms, row.shading_ms);
        line(&format!("| {lights} | {} | {listed} | {tests} | {kib} | {building:.2} | {shading:.2} |", row.scheme));
    }
    line(
        "\nLists and tests are those for the surfaces; building is for blended ones too, of which `tiled` and `raster-grid` make lists of \
         their own. KiB: cells, lists, and what they are made from.",
    );
}

fn table_row(row: &Row) -> String {
    let (counts, ms) = (&row.counts, &row.ms);
    let numbers = [
        counts.visible_clusters,
        counts.clusters,
        counts.lights_listed,
        counts.light_tests,
        counts.lighting_operations,
    ];
    let mut text = format!("| {} | {} | {} |", row.clusters, row.views, row.assignment);
    for number in numbers {
        text += &format!(" {} |", grouped(number));
    }
    text += &format!(" {:.1} |", counts.lighting_operations as f64 / counts.fragments.max(1) as f64);
    text += &format!(" {} |", grouped(counts.bytes / 1024));
    for ms in [ms.visibility(), ms.compact, ms.tree, ms.count, ms.write, ms.shading, ms.frame()] {
        text += &format!(" {ms:.2} |");
    }
    text
}
