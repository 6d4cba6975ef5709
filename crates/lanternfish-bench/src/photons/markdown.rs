//! The bench's results as a page.

use std::fmt::Write;

use super::{Report, Row};
use crate::one_bounce::{flicker_table, heading};
use lanternfish_cli::report::grouped;

pub fn to_markdown(report: &Report) -> String {
    let mut page = String::new();
    // Writing to a String cannot fail.
    let mut line = |text: &str| writeln!(page, "{text}").expect("String");
    line(&format!("# Photons: {}\n", report.heading.scene));
    line(&heading(&report.heading));
    line("## Ways to find indirect light\n");
    line(
        "*Energy*: of indirect light alone, over the path tracer's one bounce. *FLIP*: HDR-FLIP of the whole picture. *Reflected*: photons from the \
         lights that surfaces reflect; each is split. *Escaped*, *landed*: of those that they were split into, those that left the scene, and those that came to a \
         surface, of which some are not on the screen, or hidden. Deep images are built once, in the first run, and are no part of the frame.\n",
    );
    line(
        "| | frame, ms | deep images | emit | trace | M photons/s | put in order | lists | splat | M photons/s | reflected | escaped | landed | off screen | hidden | splatted | energy | FLIP |",
    );
    line("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    report.rows.iter().for_each(|row| line(&table_row(row)));
    if !report.means.is_empty() {
        line("\n## Means of frames\n");
        line("*Direct light*: FLIP of as many frames without indirect light to the path tracer's direct light.\n");
        line("| | frames | energy | FLIP | direct light |");
        line("|---|---:|---:|---:|---:|");
        for mean in &report.means {
            line(&format!(
                "| {} | {} | {:.3} | {:.4} | {:.4} |",
                mean.name, mean.frames, mean.errors.indirect_energy, mean.errors.flip, mean.direct_flip
            ));
        }
    }
    if !report.occlusion.is_empty() {
        line("\n## Ambient occlusion by 512 deep images (Aalund 2015, figs 8 and 9)\n");
        line(
            "White surfaces under a white sky, against the path tracer's open share of the sphere. Deep images without triangles.\n",
        );
        line("| | deep images, ms | MB | occlusion, ms | FLIP | energy |");
        line("|---|---:|---:|---:|---:|---:|");
        for row in &report.occlusion {
            let megabytes = row.bytes as f64 / 1e6;
            line(&format!(
                "| {} | {:.0} | {megabytes:.1} | {:.1} | {:.4} | {:.3} |",
                row.name, row.deep_images_ms, row.occlusion_ms, row.flip, row.energy
            ));
        }
    }
    if !report.flicker.is_empty() {
        page += &flicker_table(&report.flicker);
    }
    page
}

/// Millions a second; a dash where there is no time.
fn rate(count: u64, ms: f64) -> String {
    if ms > 0.0 { format!("{:.2}", count as f64 / ms / 1e3) } else { "–".to_owned() }
}

fn table_row(row: &Row) -> String {
    let times = row.times;
    format!(
        "| {} | {:.0} | {:.0} | {:.1} | {:.1} | {} | {:.1} | {:.1} | {:.1} | {} | {} | {} | {} | {} | {} | {} | {:.3} | {:.4} |",
        row.name,
        row.frame_ms,
        row.deep_images_ms,
        times.emit,
        times.trace,
        rate(row.landed + row.escaped, times.trace),
        times.keep,
        times.lists,
        times.splat,
        rate(row.splatted, times.splat),
        grouped(row.reflected),
        grouped(row.escaped),
        grouped(row.landed),
        grouped(row.off_screen),
        grouped(row.hidden),
        grouped(row.splatted),
        row.errors.indirect_energy,
        row.errors.flip
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_rate_without_a_time() {
        assert_eq!((rate(5_000_000, 2000.0), rate(5, 0.0)), ("2.50".to_owned(), "–".to_owned()));
    }
}
