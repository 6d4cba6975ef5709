//! The report as JSON, Markdown and HTML.

use lanternfish_cli::{error::CliError, output::print, plot::escaped, report::grouped};
use serde::Serialize;

use super::{
    measure::Row as Measured,
    shots::{SHOTS, Shot},
};
use crate::{
    bench::Bench,
    ground_truths::GroundTruthFigures,
    table::{Row, decimal},
    view::View,
};

/// Least deviation of an energy ratio from 1 that is marked.
const ENERGY_TOLERANCE: f64 = 0.01;

/// Results of one shot.
#[derive(Debug, Serialize)]
pub struct ShotReport {
    pub name: &'static str,
    /// Width of the ground truths, pixels.
    pub width: u32,
    /// Height of the ground truths, pixels.
    pub height: u32,
    /// Ratio of the rendered image's width and height to those of the ground truths.
    pub factor: u32,
    pub triangles: usize,
    pub lights: usize,
    pub attenuation: String,
    pub range_threshold: f64,
    /// Exposure at which images are compared, stops.
    pub exposure: f32,
    pub tone_map: String,
    pub ground_truths: Vec<GroundTruthFigures>,
    pub rows: Vec<Measured>,
}

impl ShotReport {
    pub fn new(shot: &Shot, view: &View) -> Self {
        Self {
            name: shot.name,
            width: shot.size.width,
            height: shot.size.height,
            factor: shot.factor,
            triangles: view.scene.triangle_counts().1,
            lights: view.scene.lights.len(),
            attenuation: view.look.lights.attenuation.to_string(),
            range_threshold: decimal(view.look.lights.range_threshold),
            exposure: view.look.image.exposure.of(std::iter::empty()),
            tone_map: view.look.image.tone_map.to_string(),
            ground_truths: Vec::new(),
            rows: Vec::new(),
        }
    }

    /// One line about the size of the image and the scene, and about its display.
    pub fn line(&self) -> String {
        let Self { width, height, factor, triangles, lights, attenuation, range_threshold, exposure, tone_map, .. } =
            self;
        format!(
            "{width} x {height} pixels, rendered at {} x {} and box-filtered; {triangles} triangles, {lights} lights; attenuation \
             {attenuation}, range threshold {range_threshold}; displayed at {exposure:+} EV, tone map {tone_map}.",
            factor * width,
            factor * height
        )
    }
}

/// Writes the three reports, and prints the Markdown report. `commit` names the source revision, if known.
pub fn write(bench: &Bench, spp: u64, commit: Option<&str>, shots: &[ShotReport]) -> Result<(), CliError> {
    let adapter = &bench.gpu.description;
    let is_software = bench.is_software();
    let mut report = bench.report();
    let facts = Row::default().data("commit", commit).data("backend", &adapter.backend);
    report.facts(facts.data("is_software", is_software).data("spp", spp));
    let commit = commit.map(|commit| format!(" ({commit})")).unwrap_or_default();
    let noisy =
        if is_software { " The adapter is a software renderer, whose times are not representative." } else { "" };
    report.introduction(
        &format!("{} of {} shots{commit}, through {}", shots.len(), SHOTS.len(), adapter.backend),
        &format!(
            "median of at most {} frames after a first one, which builds deep images, at the larger size; for a mean, the sum of its frames",
            bench.runs
        ),
    );
    report.paragraph(format!(
        "Each row changes one setting from the default and is compared with a box-filtered, path-traced image of the same scene. The renderer \
         takes one sample at each pixel's centre, so its images are rendered larger and box-filtered first. Compare times within a shot \
         only.{noisy}"
    ));
    report.paragraph(format!(
        "FLIP: mean LDR-FLIP of the display colours. HDR-FLIP: mean HDR-FLIP of the radiance. relMSE: mean of (a - r)^2 / (r^2 + 0.01). p95: 95th \
         percentile of the relative errors. Energy: ratio of the image's sum to the reference's, marked with * if it deviates from 1 by more \
         than {:.0} % and by more than twice the reference's noise. Of indirect: energy ratio of indirect light alone. The indirect light of \
         an image is its energy less that of the row with as many frames without indirect light; the indirect light of the reference is its \
         energy less emission and direct light of punctual lights in the path tracer. It is left out if the reference's noise is more than a \
         quarter of its indirect light. Pixels: number of pixels of the larger image that are not bit-identical to the default's. Ms: frame \
         time. Rays: number of shadow rays of opaque surfaces. Lights: number of listed lights, summed over all lists. The noise row of each \
         reference holds its own noise, below which errors are not significant; its FLIP is that between the two halves of its samples.",
        100.0 * ENERGY_TOLERANCE
    ));
    for shot in shots {
        report.heading(shot.name);
        report.paragraph(shot.line());
        report.list(shot.ground_truths.iter().map(ground_truth_line));
        let rows = shot.rows.iter().map(|row| table_row(&row.name, row.ground_truth, cells(shot, row)));
        let noise = shot.ground_truths.iter().map(|of| table_row("*noise*", of.name, ground_truth_cells(of)));
        report.show(rows.chain(noise));
        report.html(renderings(shot));
    }
    report.keep_data("shots", &shots);
    drop(report);
    bench.list_left_out();
    bench.end_progress();
    let report = bench.report();
    report.store(&bench.folder, "report")?;
    print(&format!("{}\n{}\n", report.to_markdown(), bench.folder.join("report.html").display()))
}

/// A row of a shot's table: these figures under their headings of [`COLUMNS`].
fn table_row(name: &str, ground_truth: &str, cells: Vec<(&str, String)>) -> Row {
    let row = Row::default().text("name", "technique", name).text("ground_truth", "ground truth", ground_truth);
    let of = |column| cells.iter().find(|(name, _)| *name == column).map_or("", |(_, cell)| cell);
    COLUMNS.into_iter().fold(row, |row, column| row.shown(column, of(column)))
}

/// HTML of the ground truths, then of every distinct image with its FLIP map.
fn renderings(shot: &ShotReport) -> String {
    let figure = |images: &[&str], caption: &str| {
        let image = |image: &&str| format!("<img src=\"{0}\" alt=\"{0}\">", escaped(image));
        let images: String = images.iter().map(image).collect();
        format!("<figure>{images}<figcaption>{}</figcaption></figure>\n", escaped(caption))
    };
    let ground_truths = shot.ground_truths.iter();
    let mut text: String =
        ground_truths.map(|of| figure(&[&of.rendering], &format!("ground truth: {}", of.name))).collect();
    let shows =
        |row: &Measured, rendering: &str| row.figures.as_ref().is_some_and(|figures| figures.rendering == rendering);
    for (i, row) in shot.rows.iter().enumerate() {
        let is_new = |rendering: &str| !shot.rows[..i].iter().any(|row| shows(row, rendering));
        let Some(figures) = row.figures.as_ref().filter(|figures| is_new(&figures.rendering)) else { continue };
        let same = shot.rows.iter().filter(|other| shows(other, &figures.rendering));
        let names: Vec<&str> = same.map(|other| other.name.as_str()).collect();
        let caption = format!("{}; FLIP {:.4} against {}", names.join(" = "), figures.errors.flip, row.ground_truth);
        text += &figure(&[&figures.rendering, &figures.map], &caption);
    }
    format!("<div class=\"small\">\n{text}</div>")
}

/// Rows without indirect light, compared with ground truths that have indirect light.
const WITHOUT_INDIRECT: [&str; 4] =
    ["indirect none", "indirect none, 64 frames", "one-bounce none", "one-bounce-file none"];

/// Headings of the columns after the name and the ground truth.
const COLUMNS: [&str; 10] =
    ["FLIP", "HDR-FLIP", "relMSE", "p95", "energy", "of indirect", "pixels", "ms", "rays", "lights"];

/// Cells of a row of `shot`; the reason alone if there are no results.
fn cells(shot: &ShotReport, row: &Measured) -> Vec<(&'static str, String)> {
    let Some(figures) = &row.figures else { return vec![("FLIP", row.left_out.clone().unwrap_or_default())] };
    let errors = &figures.errors;
    let ground_truth = shot.ground_truths.iter().find(|ground_truth| ground_truth.name == row.ground_truth);
    let noise = ground_truth.map_or(0.0, |ground_truth| ground_truth.noise_energy);
    let indirect =
        ground_truth.and_then(indirect_energy).and_then(|indirect| indirect_ratio(&shot.rows, row, indirect));
    let is_off = (errors.energy_ratio - 1.0).abs() > ENERGY_TOLERANCE.max(2.0 * noise);
    let mark = if is_off { " *" } else { "" };
    vec![
        ("FLIP", format!("{:.4}", errors.flip)),
        ("HDR-FLIP", format!("{:.4}", errors.hdr_flip)),
        ("relMSE", format!("{:.2e}", errors.relative_mse)),
        ("p95", format!("{:.3}", errors.percentile_95)),
        ("energy", format!("{:.4}{mark}", errors.energy_ratio)),
        ("of indirect", indirect.map(|ratio| format!("{ratio:.3}")).unwrap_or_default()),
        ("pixels", grouped(figures.differing_pixels as u64)),
        ("ms", format!("{:.1}", figures.frame_ms)),
        ("rays", grouped(figures.rays)),
        ("lights", grouped(figures.listed_lights)),
    ]
}

/// Ratio of an image's indirect light to the ground truth's, whose fraction of the energy is `indirect`.
///
/// The image's indirect light is its energy less that of the row with as many frames without indirect light. A small
/// relative error of direct light, a few parts per thousand, would otherwise count several times in the ratio. `None`
/// if there is no such row, or if this is that row.
fn indirect_ratio(rows: &[Measured], row: &Measured, indirect: f64) -> Option<f64> {
    let figures = row.figures.as_ref()?;
    let of_row = |none: &&Measured| {
        none.ground_truth == row.ground_truth
            && WITHOUT_INDIRECT.contains(&&*none.name)
            && none.figures.as_ref().is_some_and(|none| none.frames == figures.frames)
    };
    let none = rows.iter().find(of_row)?;
    let direct = none.figures.as_ref()?.errors.energy_ratio;
    (!WITHOUT_INDIRECT.contains(&&*row.name)).then(|| (figures.errors.energy_ratio - direct) / indirect)
}

/// Least ratio of a ground truth's indirect light to its noise for which indirect light is compared.
const MOST_NOISE: f64 = 4.0;

/// Energy of a ground truth's indirect light, as a fraction of its energy. `None` if it has none, or if noise exceeds
/// it.
fn indirect_energy(ground_truth: &GroundTruthFigures) -> Option<f64> {
    let indirect = 1.0 - ground_truth.energy_without_indirect?;
    (indirect > MOST_NOISE * ground_truth.noise_energy).then_some(indirect)
}

/// Cells of a ground truth: its noise.
fn ground_truth_cells(of: &GroundTruthFigures) -> Vec<(&'static str, String)> {
    let of_indirect = indirect_energy(of).map(|indirect| format!("± {:.3}", of.noise_energy / indirect));
    vec![
        ("FLIP", format!("{:.4}", of.noise_flip)),
        ("relMSE", format!("{:.2e}", of.noise_relative_mse)),
        ("energy", format!("± {:.4}", of.noise_energy)),
        ("of indirect", of_indirect.unwrap_or_default()),
    ]
}

/// One line about the content and origin of a ground truth.
fn ground_truth_line(of: &GroundTruthFigures) -> String {
    let GroundTruthFigures { name, meaning, spp, noise, seconds, dropped, .. } = of;
    let made = if of.reused { "reused".to_owned() } else { format!("traced in {seconds:.1} s") };
    let dropped = if *dropped > 0 { format!("; {dropped} samples were not finite: a fault") } else { String::new() };
    let error = 100.0 * noise;
    format!("{name}: {meaning}; {spp} samples per pixel, expected relative error {error:.2} %, {made}{dropped}")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use lanternfish::settings::Settings;

    use super::*;
    use crate::quality::{
        measure::{Errors, Figures},
        techniques::techniques,
    };
    use crate::table::to_markdown;

    fn row(name: &str, ground_truth: &'static str, frames: u32, energy_ratio: f64) -> Measured {
        let errors = Errors { energy_ratio, ..Errors::default() };
        let figures = Some(Figures { errors, frames, ..Figures::default() });
        Measured { name: name.to_owned(), ground_truth, left_out: None, figures }
    }

    fn ground_truth(energy_without_indirect: Option<f64>, noise_energy: f64) -> GroundTruthFigures {
        GroundTruthFigures { name: "full", spp: 1, noise_energy, energy_without_indirect, ..Default::default() }
    }

    #[test]
    fn indirect_light_is_the_difference_to_the_row_without() {
        let rows = [
            row("indirect none", "full", 1, 0.51),
            row("indirect none, 64 frames", "full", 64, 0.5),
            row("indirect sampled", "full", 1, 1.01),
            row("indirect sampled, 64 frames", "full", 64, 1.0),
            row("indirect sampled, 4 frames", "full", 4, 1.0),
            row("occlusion none", "occlusion", 1, 0.5),
            row("occlusion deep 64", "occlusion", 1, 0.9),
        ];
        // Excess direct light does not count as indirect light.
        let actual = rows.each_ref().map(|row| indirect_ratio(&rows, row, 0.5));
        assert_eq!(actual, [None, None, Some(1.0), Some(1.0), None, None, None]);
        assert_eq!(indirect_ratio(&rows, &rows[2], 0.4), Some(0.5 / 0.4));
    }

    #[test]
    fn indirect_light_below_the_noise_has_no_ratio() {
        assert_eq!(indirect_energy(&ground_truth(Some(0.75), 0.01)), Some(0.25));
        assert_eq!(indirect_energy(&ground_truth(Some(0.75), 0.0625)), None);
        assert_eq!(indirect_energy(&ground_truth(Some(1.0), 0.0)), None);
        assert_eq!(indirect_energy(&ground_truth(None, 0.0)), None);
    }

    #[test]
    fn a_technique_without_results_has_its_reason() {
        let shot = ShotReport::new(&SHOTS[0], &SHOTS[0].load(Path::new("none"), None).unwrap());
        let row = Measured { figures: None, left_out: Some("no ray query".to_owned()), ..row("a", "full", 1, 1.0) };
        let table = to_markdown(&[table_row(&row.name, row.ground_truth, cells(&shot, &row))]);
        assert!(table.ends_with(&format!("\n| a | full | no ray query |{}\n", "  |".repeat(9))), "{table}");
    }

    #[test]
    fn rows_without_indirect_light_exist() {
        lanternfish_papers::register();
        let rows = techniques(&Settings::direct_light(), 10.0);
        for name in WITHOUT_INDIRECT {
            assert!(rows.iter().any(|row| row.case.name == name), "no row {name}");
        }
    }
}
