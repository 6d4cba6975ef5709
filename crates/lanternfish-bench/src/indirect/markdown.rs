//! The bench's results as a page.

use std::fmt::Write;

use super::{Report, cached, configurations::Brdf, measure::Row, paper};
use crate::deep_images::build::Built;
use lanternfish_cli::report::grouped;

const HEAD: &str = "| BRDF | rays | tracer | directions | texels | filter | samples | frames | rays traced | trace | shade | resolve | filter, ms \
                    | images | frame, ms | traced, M/s | and shaded, M/s | energy | of indirect | FLIP to BVH | to many frames |";
const RULE: &str =
    "|---|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|";

pub fn to_markdown(report: &Report) -> String {
    let mut page = String::new();
    // Writing to a String cannot fail.
    let mut line = |text: &str| writeln!(page, "{text}").expect("String");
    line(&format!("# Indirect light by rays: {}\n", report.scene));
    line(&format!(
        "{} x {}, {} triangles; {} on {}, Lanternfish {}. Times: the least of {} runs, to be compared within this page only. \
         Counts and errors are exact.\n",
        report.width,
        report.height,
        grouped(report.triangles as u64),
        report.adapter,
        report.driver,
        report.version,
        report.runs
    ));
    line(
        "Rays a second are of the rays that the BRDF's name stands for; the one diffuse ray that is traced beside glossy ones is in \
         the milliseconds, not in the rate. *And shaded* counts tracing and shading what was met: one light chosen of all, its shadow \
         ray through the BVH. Rays that would go into their own surface are counted and not traced. *Images*: building deep images \
         within these frames; *frame*: everything else.\n",
    );
    line(&format!(
        "*Energy* and *FLIP to BVH* are against the picture with the same rays, filter and antialiasing through the BVH: what the \
         images cost. *Of indirect*: the same without direct light. *To many frames*: FLIP against the mean of {} frames through the \
         BVH without filter, nearly free of noise and of jagged edges: `diffuse.png`, `glossy.png`, `mirror.png`.\n",
        report.converged_frames
    ));
    for ratio in report.rows.iter().filter(|row| row.is_plain()).filter_map(|row| ratio(row, &report.rows)) {
        line(&format!("- {ratio}"));
    }
    paper_tables(&report.rows, &mut line);
    images_table(&report.images, &mut line);
    line("\n## Rays through images and through the BVH\n");
    rows_table(report.rows.iter().filter(|row| row.is_plain()), &mut line);
    line("\n## Filter: pixels to each side, 0 is off\n");
    rows_table(varied(&report.rows, |row| row.filter_radius == 0), &mut line);
    line("\n## Antialiasing: samples at edges, and the mean of frames, each with images of its own\n");
    rows_table(varied(&report.rows, |row| row.samples > 1 || row.accumulate > 1), &mut line);
    line(&cached::section(&report.cached, report.converged_frames));
    if !report.left_out.is_empty() {
        line("\n## Left out\n");
    }
    for left_out in &report.left_out {
        line(&format!("- {}: {}", left_out.what, left_out.reason));
    }
    page
}

/// How much faster rays are than through the BVH.
fn ratio(row: &Row, rows: &[Row]) -> Option<String> {
    let (directions, resolution) = (row.directions?, row.resolution?);
    let bvh = rows.iter().find(|bvh| bvh.directions.is_none() && bvh.brdf == row.brdf && bvh.is_plain())?;
    Some(format!(
        "{} {} / BVH, {directions} x {resolution}²: rays a second {:.2} traced, {:.2} and shaded; FLIP {:.4}",
        row.brdf.name(),
        row.tracer,
        row.rate_traced / bvh.rate_traced,
        row.rate_shaded / bvh.rate_shaded,
        row.errors.flip
    ))
}

/// [Niessner2010, table 1], and ours at his number of images, across texels as he traces.
fn paper_tables(rows: &[Row], line: &mut impl FnMut(&str)) {
    line("\n## Beside Nießner's (2010, table 1)\n");
    line(&format!(
        "Million rays a second, shading included. His are of other hardware and another scene ({}): neither column says anything about \
         the other but how they change from row to row.\n",
        paper::MACHINE
    ));
    line("| BRDF | directions | texels | ours, traced | ours, and shaded | BVH, and shaded | Nießner |");
    line("|---|---:|---:|---:|---:|---:|---:|");
    let rate = |row: Option<&Row>, of: fn(&Row) -> f64| row.map_or("–".to_owned(), |row| format!("{:.2}", of(row)));
    for brdf in Brdf::ALL {
        let directions = 6 * brdf.k() * brdf.k();
        let plain = |row: &&Row| row.brdf == brdf && row.is_plain();
        let bvh = rows.iter().filter(plain).find(|row| row.tracer == "bvh");
        for resolution in [128, 512] {
            let ours = rows.iter().filter(plain).find(|row| {
                (row.tracer, row.directions, row.resolution) == ("across-texels", Some(directions), Some(resolution))
            });
            line(&format!(
                "| {} | {directions} | {resolution}² | {} | {} | {} | {} |",
                brdf.name(),
                rate(ours, |row| row.rate_traced),
                rate(ours, |row| row.rate_shaded),
                rate(bvh, |row| row.rate_shaded),
                paper::rate(brdf, resolution, directions).unwrap_or("–")
            ));
        }
    }
    line("");
    for other in paper::OTHERS {
        line(&format!("- {other}"));
    }
}

fn images_table(images: &[Built], line: &mut impl FnMut(&str)) {
    line("\n## Images\n");
    line("Every chunk is what one binding holds, and a pass of its own for every ray of the pixels.\n");
    line("| directions | images | texels | chunks | built, ms | fragments drawn | kept | MB |");
    line("|---:|---:|---:|---:|---:|---:|---:|---:|");
    for Built { directions, resolution, chunks, total_ms, drawn, kept, bytes, .. } in images {
        line(&format!(
            "| {} | {directions} | {resolution}² | {chunks} | {total_ms:.1} | {} | {} | {:.1} |",
            2 * directions,
            grouped(*drawn),
            grouped(*kept),
            *bytes as f64 / 1e6
        ));
    }
}

/// Rows that vary a plain one so, each group after its plain row.
fn varied(rows: &[Row], is_varied: impl Fn(&Row) -> bool) -> impl Iterator<Item = &Row> {
    let plain = rows.iter().filter(|row| row.is_plain());
    plain.flat_map(move |plain| {
        let others: Vec<&Row> = rows.iter().filter(|row| row.traces_as(plain) && is_varied(row)).collect();
        std::iter::once(plain).filter(|_| !others.is_empty()).collect::<Vec<_>>().into_iter().chain(others)
    })
}

fn rows_table<'a>(rows: impl Iterator<Item = &'a Row>, line: &mut impl FnMut(&str)) {
    line(HEAD);
    line(RULE);
    for row in rows {
        line(&table_row(row));
    }
}

fn table_row(row: &Row) -> String {
    let number = |value: Option<u32>, unit: &str| value.map_or("–".to_owned(), |value| format!("{value}{unit}"));
    let Row { times, errors, .. } = row;
    format!(
        "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.2} | {:.2} | {:.3} | {:.3} | \
         {:.4} | {:.4} |",
        row.brdf.name(),
        row.brdf.counted_rays(),
        row.tracer,
        number(row.directions, ""),
        number(row.resolution, "²"),
        row.filter_radius,
        row.samples,
        row.accumulate,
        grouped(row.rays),
        times.trace_ms,
        times.shade_ms,
        times.resolve_ms,
        times.filter_ms,
        times.images_ms,
        times.frame_ms,
        row.rate_traced,
        row.rate_shaded,
        errors.energy_ratio,
        errors.indirect_energy_ratio,
        errors.flip,
        errors.converged_flip
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        deep_images::LeftOut,
        indirect::{errors::Errors, times::Times},
    };

    fn row(tracer: &'static str, resolution: Option<u32>, filter_radius: u32, rate: f64) -> Row {
        let errors = Errors { energy_ratio: 1.0, indirect_energy_ratio: 0.987, flip: 0.0123, converged_flip: 0.2 };
        Row {
            brdf: Brdf::Diffuse,
            tracer,
            directions: resolution.map(|_| 96),
            resolution,
            bytes: None,
            filter_radius,
            samples: 1,
            accumulate: 1,
            rays: 8000,
            times: Times::default(),
            rate_traced: 2.0 * rate,
            rate_shaded: rate,
            errors,
        }
    }

    fn report() -> Report {
        Report {
            version: "0",
            scene: "demo:cornell".into(),
            adapter: "an adapter".to_owned(),
            driver: "a driver".to_owned(),
            triangles: 36,
            width: 10,
            height: 100,
            runs: 1,
            converged_frames: 8,
            images: Vec::new(),
            rows: vec![
                row("bvh", None, 8, 1.0),
                row("across-texels", Some(128), 8, 3.0),
                row("across-texels", Some(128), 0, 4.0),
                row("across-texels", Some(512), 8, 2.0),
            ],
            cached: Vec::new(),
            left_out: vec![LeftOut { what: "samples".to_owned(), reason: "refused".to_owned() }],
        }
    }

    #[test]
    fn the_page_holds_his_figures_beside_ours() {
        let page = to_markdown(&report());
        assert!(page.contains("| diffuse | 96 | 128² | 6.00 | 3.00 | 1.00 | 37–50 |"), "{page}");
        assert!(page.contains("| glossy | 150 | 512² | – | – | – | 63–71 |"), "{page}");
        assert!(page.contains(
            "- diffuse across-texels / BVH, 96 x 512²: rays a second 2.00 traced, 2.00 and shaded; FLIP 0.0123"
        ));
        assert!(page.contains("GTX 285"));
        assert!(page.ends_with("- samples: refused\n"));
    }

    #[test]
    fn what_is_varied_stands_beside_what_it_was() {
        let rows = report().rows;
        let filters: Vec<_> =
            varied(&rows, |row| row.filter_radius == 0).map(|row| (row.resolution, row.filter_radius)).collect();
        assert_eq!(filters, [(Some(128), 8), (Some(128), 0)]);
        assert_eq!(varied(&rows, |row| row.samples > 1).count(), 0);
    }

    #[test]
    fn tables_have_as_many_columns_as_their_heads() {
        let columns = |text: &str| text.matches('|').count();
        let row = row("bvh", None, 8, 1.0);
        assert_eq!([columns(RULE), columns(&table_row(&row))], [columns(HEAD); 2]);
    }
}
