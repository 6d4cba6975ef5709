//! The bench's results as a page.

use std::fmt::Write;

use lanternfish::settings::Tracer;

use super::{
    Report,
    build::{Built, HoleShares},
    trace::Traced,
};
use lanternfish_cli::report::grouped;

pub fn to_markdown(report: &Report) -> String {
    let mut page = String::new();
    // Writing to a String cannot fail.
    let mut line = |text: &str| writeln!(page, "{text}").expect("String");
    line(&format!("# Deep images: {}\n", report.scene));
    line(&format!(
        "{} triangles; {} on {}, Lanternfish {}. Times: the least of {} runs (of one, where it takes ten seconds), to be compared \
         within this page only. Counts are exact.\n",
        grouped(report.triangles as u64),
        report.adapter,
        report.driver,
        report.version,
        report.runs
    ));
    for ratio in builder_ratios(&report.built).into_iter().chain(tracer_ratios(&report.traced)) {
        line(&format!("- {ratio}"));
    }
    for group in report.built.chunk_by(|a, b| a.group == b.group) {
        line(&format!("\n## Building: {}\n", group[0].group.to_lowercase()));
        line(
            "| images | directions | texels | sample | gather | scan | fill | sort | compact | all, ms | a direction, ms \
             | draw passes | drawn | kept | MB |",
        );
        line("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
        for built in group {
            line(&built_row(built));
        }
    }
    if report.built.iter().any(|built| built.holes.is_some()) {
        line(
            "\n## Holes\n\nSurfaces that images miss of those of a draw for each direction, and those that they have besides: fragments \
             without a partner within a texel of depth in the list of the same texel. By the cosine between a surface's normal and \
             the image's axis.\n",
        );
        line(
            "| images | directions | texels | fragments, of a direction's | missing | to 1/4 | to 1/2 | to 3/4 | to 1 | spurious |",
        );
        line("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
        for row in report.built.iter().filter_map(holes_row) {
            line(&row);
        }
    }
    line(
        "\n## Tracing\n\nRays from surfaces in all directions; the error is that of the distance to the first hit, relative to an \
         exact ray along the ray's own direction (images have their own).",
    );
    for group in report.traced.chunk_by(|a, b| a.group == b.group) {
        line(&format!("\n### {}\n", group[0].group));
        line(
            "| images | directions | texels | structure | rays | random, M/s | by direction, M/s | error, median | 95 % | missed \
             | false |",
        );
        line("|---|---:|---:|---|---:|---:|---:|---:|---:|---:|---:|");
        for traced in group {
            line(&traced_row(traced));
        }
    }
    if !report.left_out.is_empty() {
        line("\n## Left out\n");
    }
    for left_out in &report.left_out {
        line(&format!("- {}: {}", left_out.what, left_out.reason));
    }
    page
}

/// How much longer the other builders take than the single pass, at equal directions and raster.
fn builder_ratios(built: &[Built]) -> Vec<String> {
    let others = built.iter().filter(|row| row.builder != "single_pass");
    let ratio = |row: &Built| {
        let single = built.iter().find(|other| {
            other.builder == "single_pass"
                && other.group == row.group
                && (other.directions, other.resolution) == (row.directions, row.resolution)
        })?;
        let times = row.total_ms / single.total_ms;
        let (directions, resolution) = (row.directions, row.resolution);
        Some(format!("{} / single_pass, {directions} directions of {resolution}², time: {times:.1}", row.builder))
    };
    others.filter_map(ratio).collect()
}

/// How many times as many rays a second go through images as through the BVH that was timed beside them.
fn tracer_ratios(traced: &[Traced]) -> Vec<String> {
    let ratio = |row: &Traced| {
        let bvh = traced.iter().find(|other| {
            other.structure == Tracer::Bvh.name()
                && other.group == row.group
                && (other.directions, other.resolution) == (row.directions, row.resolution)
        })?;
        let (random, by_direction) = (row.rate_random / bvh.rate_random, row.rate_by_direction / bvh.rate_by_direction);
        let Traced { structure, directions, resolution, .. } = row;
        Some(format!(
            "{structure} / BVH, {directions} x {resolution}², rays a second: {random:.1} random, {by_direction:.1} by direction"
        ))
    };
    let others = traced.iter().filter(|row| row.structure != Tracer::Bvh.name());
    others.filter_map(ratio).collect()
}

fn holes_row(built: &Built) -> Option<String> {
    let HoleShares { missing, spurious, missing_by_cosine, fragments } = built.holes?;
    let percent = |share: f64| format!("{:.3} %", 100.0 * share);
    let classes = missing_by_cosine.map(percent).join(" | ");
    let Built { images, directions, resolution, .. } = built;
    Some(format!(
        "| {images} | {directions} | {resolution}² | {fragments:.3} | {} | {classes} | {} |",
        percent(missing),
        percent(spurious)
    ))
}

fn built_row(built: &Built) -> String {
    format!(
        "| {} | {} | {}² | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.2} | {} | {} | {} | {:.1} |",
        built.images,
        built.directions,
        built.resolution,
        built.sample_ms,
        built.gather_ms,
        built.scan_ms,
        built.fill_ms,
        built.sort_ms,
        built.compact_ms,
        built.total_ms,
        built.total_ms / built.directions as f64,
        built.draw_passes,
        grouped(built.drawn),
        grouped(built.kept),
        built.bytes as f64 / 1e6
    )
}

fn traced_row(traced: &Traced) -> String {
    format!(
        "| {} | {} | {}² | {} | {} | {:.2} | {:.2} | {:.2} % | {:.1} % | {:.2} % | {:.2} % |",
        traced.images,
        traced.directions,
        traced.resolution,
        traced.structure,
        grouped(traced.rays as u64),
        traced.rate_random,
        traced.rate_by_direction,
        100.0 * traced.error_median,
        100.0 * traced.error_p95,
        100.0 * traced.missed,
        100.0 * traced.false_hits
    )
}
