//! The bench's results as a page.

use std::fmt::Write;

use super::forward_plus::{Results, Row};
use lanternfish_cli::report::grouped;

/// Report as Markdown: the thesis' tables with its figures beside ours.
pub fn to_markdown(results: &Results) -> String {
    let mut page = String::new();
    let Results { width, height, .. } = results;
    // Writing to a String cannot fail.
    let mut line = |text: String| writeln!(page, "{text}").expect("String");
    line(format!("# Forward+ with ray-traced shadows: {}\n", results.scene));
    line(format!(
        "{width} x {height}, {} lights (threshold of ranges {}), {} on {}, Lanternfish {}. Times: median of {} runs, to be \
         compared within this table only. Counts are exact.\n",
        results.light_count, results.range_threshold, results.adapter, results.driver, results.version, results.runs
    ));
    line("The thesis' figures: Sponza, ten lights, 1920 x 1080, Ryzen 7 3700X and Nvidia RTX 2060 SUPER.\n".to_owned());

    line("## Optimisations (table 5.1), tiles of 8 x 8\n".to_owned());
    line(
        "| | frame ms | change | shadow rays ms | rays | change | light tests | listed lights | pixels that differ | \
         thesis: frame ms | change |"
            .to_owned(),
    );
    line("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|".to_owned());
    for row in &results.configurations {
        line(table_row(row, &results.configurations[0]));
    }
    line("\nPixels may differ only where normals are rebuilt from depth.\n".to_owned());

    line("## Tile sizes (table 5.2): culling, AABB test, improved normals\n".to_owned());
    line("| tile | frame ms | shadow rays ms | rays | light tests | listed lights | thesis: frame ms |".to_owned());
    line("|---|---:|---:|---:|---:|---:|---:|".to_owned());
    for row in &results.tile_sizes {
        line(format!(
            "| {} | {:.2} | {:.2} | {} | {} | {} | {} |",
            row.name,
            row.frame_ms,
            row.shadow_ms,
            grouped(row.rays),
            grouped(row.light_tests),
            grouped(row.listed_lights),
            paper(row.paper_ms)
        ));
    }

    line("\n## Normals from depth (fig. 5.3)\n".to_owned());
    line("| | mean FLIP | mean angle | over 10° | thesis: mean FLIP |".to_owned());
    line("|---|---:|---:|---:|---:|".to_owned());
    for normals in &results.normals {
        line(format!(
            "| {} | {:.5} | {:.2}° | {:.2} % | {:.5} |",
            normals.name,
            normals.mean_flip,
            normals.mean_degrees,
            100.0 * normals.share_over_ten_degrees,
            normals.paper_flip
        ));
    }
    line("\n## Pictures\n".to_owned());
    line(
        "Rays a pixel (fig. 5.2; black 0, red 10 and more): `rays-*.png`. Normals and their errors: `normals-*.png`."
            .to_owned(),
    );
    page
}

fn table_row(row: &Row, none: &Row) -> String {
    let change =
        |value: f64, of: f64| if of > 0.0 { format!("{:+.2} %", 100.0 * (value / of - 1.0)) } else { "–".into() };
    let paper_change = match (row.paper_ms, none.paper_ms) {
        (Some(ms), Some(of)) => change(ms, of),
        _ => "–".to_owned(),
    };
    format!(
        "| {} | {:.2} | {} | {:.2} | {} | {} | {} | {} | {} | {} | {} |",
        row.name,
        row.frame_ms,
        change(row.frame_ms, none.frame_ms),
        row.shadow_ms,
        grouped(row.rays),
        change(row.rays as f64, none.rays as f64),
        grouped(row.light_tests),
        grouped(row.listed_lights),
        grouped(row.differing_pixels as u64),
        paper(row.paper_ms),
        paper_change
    )
}

fn paper(ms: Option<f64>) -> String {
    ms.map_or_else(|| "–".to_owned(), |ms| format!("{ms:.2}"))
}
