//! The bench's results as a page.

use std::fmt::Write;

use super::{
    Report,
    measure::{RangeRow, Row},
    steps::PAPER,
};
use crate::one_bounce::{flicker_table, heading};
use lanternfish_cli::report::grouped;

/// [Archer2019, table 3], ms: Atrium and Rungholt by rays, and random ranges; by texels across the map.
const RANGES: [(u32, [f64; 3]); 4] =
    [(256, [0.5, 0.6, 0.04]), (512, [1.8, 2.1, 0.14]), (1024, [6.0, 6.9, 0.5]), (2048, [20.2, 23.5, 2.1])];

pub fn to_markdown(report: &Report) -> String {
    let mut page = String::new();
    // Writing to a String cannot fail.
    let mut line = |text: &str| writeln!(page, "{text}").expect("String");
    line(&format!("# Virtual lights: {}\n", report.heading.scene));
    line(&heading(&report.heading));
    line("## Ways to find indirect light\n");
    line(
        "*Energy*: of indirect light alone, over the path tracer's one bounce. *FLIP*: HDR-FLIP of the whole picture. *In range*: share of \
         the flux of virtual lights that ends on surfaces within their ranges. *Range rays*: share of the frame. Deep images are built once, in the first run, and are no part of the frame: his total has them.\n",
    );
    line(
        "| | frame, ms | map | lights found | lists | gathered | of these: shadow rays | range rays | unique | listed | too small | too large | in range | energy | FLIP |",
    );
    line("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    report.rows.iter().for_each(|row| line(&table_row(row)));
    line("\n## Steps (Archer 2019, table 1)\n");
    line(
        "His: 1920 x 1080, NVIDIA GeForce GTX 1060. His totals are printed as 20.6 and 43.5; his rows sum to 20.15 and 43.0.\n",
    );
    let with_steps: Vec<&Row> = report.rows.iter().filter(|row| row.has_steps).collect();
    let names: Vec<&str> = with_steps.iter().map(|row| row.name.as_str()).collect();
    line(&format!("| ms | {} | Atrium | Rungholt |", names.join(" | ")));
    line(&format!("|---|{}---:|---:|", "---:|".repeat(names.len())));
    for (i, (name, atrium, rungholt)) in PAPER.iter().enumerate() {
        let ours: Vec<String> = with_steps.iter().map(|row| format!("{:.1}", row.steps.steps[i])).collect();
        line(&format!("| {name} | {} | {atrium} | {rungholt} |", ours.join(" | ")));
    }
    if !report.ranges.is_empty() {
        line("\n## Ranges (Archer 2019, table 3)\n");
        line(
            "Six rays from every texel of the map that sees anything, no light is listed; through 169 deep images of 64², and through the BVH.\n",
        );
        line(
            "| map | rays | deep images, ms | M rays/s | BVH, ms | M rays/s | random, ms | Atrium | Rungholt | random |",
        );
        line("|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
        report.ranges.iter().for_each(|row| line(&range_row(row)));
    }
    if !report.flicker.is_empty() {
        page += &flicker_table(&report.flicker);
    }
    page
}

fn table_row(row: &Row) -> String {
    let Row { steps, errors, .. } = row;
    let times = steps.steps;
    let in_range = row.in_range.map_or("–".to_owned(), |share| format!("{share:.2}"));
    format!(
        "| {} | {:.0} | {:.1} | {:.1} | {:.1} | {:.0} | {:.0} | {:.2} % | {} | {} | {} | {} | {in_range} | {:.3} | {:.4} |",
        row.name,
        steps.frame,
        times[3],
        times[4],
        times[5],
        times[6],
        steps.shadow_rays,
        100.0 * steps.range_rays / steps.frame,
        grouped(row.unique),
        grouped(row.listed),
        grouped(row.too_small),
        grouped(row.too_large),
        errors.indirect_energy,
        errors.flip
    )
}

fn range_row(row: &RangeRow) -> String {
    let [deep, bvh] = row.rates();
    let paper = RANGES.iter().find(|(map, _)| *map == row.map);
    let paper = paper.map_or("– | – | –".to_owned(), |(_, [a, b, c])| format!("{a} | {b} | {c}"));
    format!(
        "| {}² | {} | {:.1} | {deep:.2} | {:.1} | {bvh:.2} | {:.2} | {paper} |",
        row.map,
        grouped(6 * row.lights),
        row.deep_images_ms,
        row.bvh_ms,
        row.random_ms
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn his_figures_stand_beside_the_map_that_they_are_of() {
        let row = |map| RangeRow { map, lights: 1000, deep_images_ms: 2.0, bvh_ms: 3.0, random_ms: 0.5 };
        assert_eq!(range_row(&row(512)), "| 512² | 6,000 | 2.0 | 3.00 | 3.0 | 2.00 | 0.50 | 1.8 | 2.1 | 0.14 |");
        assert!(range_row(&row(64)).ends_with("| – | – | – |"));
        assert_eq!(PAPER.iter().map(|(_, atrium, _)| atrium).sum::<f64>(), 20.15);
    }
}
