//! What the bench found: for scripts as JSON; `markdown` and `html` are for people.

use std::path::Path;

use lanternfish_gpu::Gpu;
use lanternfish_scene::Scene;
use serde::Serialize;

use super::{
    QualityArgs,
    html::to_html,
    markdown::to_markdown,
    measure::Row,
    shots::{SHOTS, Shot},
    truths::TruthFigures,
};
use lanternfish_cli::{
    error::CliError,
    output::{print, write_text},
};

/// How far an energy ratio may be from 1 without being marked, whatever the noise.
const ENERGY_TOLERANCE: f64 = 0.01;

/// Everything the bench found.
#[derive(Debug, Serialize)]
pub struct Report {
    pub version: &'static str,
    /// State of the sources, where it is known.
    pub commit: Option<String>,
    pub adapter: String,
    pub backend: String,
    pub driver: String,
    /// Whether the adapter is a processor.
    pub is_software: bool,
    /// Samples a pixel that the command line asked for; each truth says how many it has.
    pub spp: u64,
    /// Frames that a time is the median of.
    pub runs: u32,
    pub shots: Vec<ShotReport>,
    pub left_out: Vec<LeftOut>,
}

/// A shot without figures.
#[derive(Debug, Serialize)]
pub struct LeftOut {
    pub shot: &'static str,
    pub reason: String,
}

#[derive(Debug, Serialize)]
pub struct ShotReport {
    pub name: &'static str,
    /// Width of the truths, pixels.
    pub width: u32,
    pub height: u32,
    /// How many times wider and higher than the truths the renderer's picture is.
    pub factor: u32,
    pub triangles: usize,
    pub lights: usize,
    pub attenuation: String,
    pub range_threshold: f32,
    /// Exposure at which pictures are compared, stops.
    pub exposure: f32,
    pub tone_map: String,
    pub truths: Vec<TruthFigures>,
    pub rows: Vec<Row>,
}

impl ShotReport {
    pub fn new(shot: &Shot, scene: &Scene) -> Self {
        let settings = shot.settings();
        Self {
            name: shot.name,
            width: shot.size.width,
            height: shot.size.height,
            factor: shot.factor,
            triangles: scene.triangle_counts().1,
            lights: scene.lights.len(),
            attenuation: settings.attenuation.to_string(),
            range_threshold: settings.range_threshold,
            exposure: shot.exposure,
            tone_map: settings.tone_map.to_string(),
            truths: Vec::new(),
            rows: Vec::new(),
        }
    }

    /// The scene's size and how it is looked at, in one line.
    pub fn line(&self) -> String {
        let Self { width, height, factor, triangles, lights, attenuation, range_threshold, exposure, tone_map, .. } =
            self;
        format!(
            "{width} x {height}, rendered at {} x {} and box-averaged; {triangles} triangles, {lights} lights; attenuation \
             {attenuation}, range threshold {range_threshold}; seen at {exposure:+} EV, tone map {tone_map}.",
            factor * width,
            factor * height
        )
    }
}

impl Report {
    pub fn new(args: &QualityArgs, gpu: &Gpu) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            commit: args.commit.clone(),
            adapter: gpu.description.name.clone(),
            backend: gpu.description.backend.clone(),
            driver: gpu.description.driver.clone(),
            is_software: gpu.description.device_type == "Cpu",
            spp: args.spp,
            runs: args.runs,
            shots: Vec::new(),
            left_out: Vec::new(),
        }
    }

    pub fn leave_out(&mut self, shot: &Shot, reason: String) {
        self.left_out.push(LeftOut { shot: shot.name, reason });
    }

    /// What the figures are, a paragraph each.
    pub fn introduction(&self) -> Vec<String> {
        let commit = self.commit.as_ref().map(|commit| format!(" ({commit})")).unwrap_or_default();
        let noisy = if self.is_software {
            " The adapter is a processor, whose times say little: compare them within a shot only."
        } else {
            " Compare them within a shot only."
        };
        vec![
            format!(
                "Lanternfish {}{commit}, {} ({}) on {}. {} of {} shots.",
                self.version,
                self.adapter,
                self.backend,
                self.driver,
                self.shots.len(),
                SHOTS.len()
            ),
            format!(
                "Each row changes one setting from the default and is compared with a path tracer's picture of the same scene, \
                 box-filtered. The renderer takes one sample at each pixel's centre: its pictures are \
                 rendered larger and box-averaged first."
            ),
            format!(
                "FLIP: mean LDR-FLIP of what a display shows. HDR-FLIP: of radiance. relMSE: mean of (a - r)^2 / (r^2 + 0.01). \
                 p95: what 95 % of the relative errors do not exceed. Energy: sum of the picture over sum of the truth, marked \
                 with * where it is farther from 1 than {:.0} % and twice the truth's own noise. Of indirect: the same of \
                 indirect light alone, which is what a picture has beyond the row of as many frames without any, and the truth beyond what the path tracer sees shine \
                 and the light of punctual lights by one reflection; left out where the truth's own noise is more than a quarter of that. Pixels: those of the larger picture that differ from the default's in \
                 any bit. Rays: shadow rays of opaque surfaces. Lights: listed for all pixels. ms: median of at most {} frames after one, in which deep images are built and then kept, \
                 at the larger size; of a mean, of all its frames.{noisy} The row of each truth is its own noise, below which an error says nothing: FLIP is \
                 that between its two halves of samples.",
                100.0 * ENERGY_TOLERANCE,
                self.runs
            ),
        ]
    }

    /// Writes the three reports, and prints the one in Markdown.
    pub fn write(&self, folder: &Path) -> Result<(), CliError> {
        let markdown = to_markdown(self);
        write_text(&folder.join("report.md"), &markdown)?;
        let json = serde_json::to_string_pretty(self).expect("plain numbers and strings");
        write_text(&folder.join("report.json"), &(json + "\n"))?;
        write_text(&folder.join("report.html"), &to_html(self))?;
        let text = format!("{markdown}\n{}\n", folder.join("report.html").display());
        print(&text)
    }
}

/// Rows without indirect light whose truth has some.
const WITHOUT_INDIRECT: [&str; 4] =
    ["indirect none", "indirect none, 64 frames", "one-bounce none", "one-bounce-file none"];

/// Names of the columns after the name and the truth.
pub const COLUMNS: [&str; 10] =
    ["FLIP", "HDR-FLIP", "relMSE", "p95", "energy", "of indirect", "pixels", "ms", "rays", "lights"];

/// The cells of those columns for a row of `shot`; where there are no figures, the reason alone.
pub fn cells<'r>(shot: &ShotReport, row: &'r Row) -> Result<[String; 10], &'r str> {
    let Some(figures) = &row.figures else { return Err(row.left_out.as_deref().unwrap_or_default()) };
    let (errors, grouped) = (&figures.errors, lanternfish_cli::report::grouped);
    let truth = shot.truths.iter().find(|truth| truth.name == row.truth);
    let noise = truth.map_or(0.0, |truth| truth.noise_energy);
    let indirect = truth.and_then(indirect_energy).and_then(|indirect| indirect_ratio(&shot.rows, row, indirect));
    let is_off = (errors.energy_ratio - 1.0).abs() > ENERGY_TOLERANCE.max(2.0 * noise);
    let mark = if is_off { " *" } else { "" };
    Ok([
        format!("{:.4}", errors.flip),
        format!("{:.4}", errors.hdr_flip),
        format!("{:.2e}", errors.relative_mse),
        format!("{:.3}", errors.percentile_95),
        format!("{:.4}{mark}", errors.energy_ratio),
        indirect.map(|ratio| format!("{ratio:.3}")).unwrap_or_default(),
        grouped(figures.differing_pixels as u64),
        format!("{:.1}", figures.frame_ms),
        grouped(figures.rays),
        grouped(figures.listed_lights),
    ])
}

/// Energy of a picture's indirect light over the truth's, which is `indirect` of all its energy. The picture's is what it has beyond the row of as
/// many frames without any: direct light that is a few parts in a thousand too bright would count several times as much of indirect light. `None`
/// where there is no such row, or this row is it.
fn indirect_ratio(rows: &[Row], row: &Row, indirect: f64) -> Option<f64> {
    let figures = row.figures.as_ref()?;
    let of_row = |none: &&Row| {
        none.truth == row.truth
            && WITHOUT_INDIRECT.contains(&&*none.name)
            && none.figures.as_ref().is_some_and(|none| none.frames == figures.frames)
    };
    let none = rows.iter().find(of_row)?;
    let direct = none.figures.as_ref()?.errors.energy_ratio;
    (!WITHOUT_INDIRECT.contains(&&*row.name)).then(|| (figures.errors.energy_ratio - direct) / indirect)
}

/// How many times the truth's noise its indirect light must exceed, for the report to say how much of it a picture has.
const MOST_NOISE: f64 = 4.0;

/// Energy of a truth's indirect light, as a share of all of it; `None` where it has none, or that is lost in its noise.
fn indirect_energy(truth: &TruthFigures) -> Option<f64> {
    let indirect = 1.0 - truth.energy_without_indirect?;
    (indirect > MOST_NOISE * truth.noise_energy).then_some(indirect)
}

/// The cells of [`COLUMNS`] for a truth: its own noise.
pub fn truth_cells(truth: &TruthFigures) -> [String; 10] {
    let none = String::new;
    [
        format!("{:.4}", truth.noise_flip),
        none(),
        format!("{:.2e}", truth.noise_relative_mse),
        none(),
        format!("± {:.4}", truth.noise_energy),
        indirect_energy(truth).map(|indirect| format!("± {:.3}", truth.noise_energy / indirect)).unwrap_or_default(),
        none(),
        none(),
        none(),
        none(),
    ]
}

/// Where a truth comes from and what it is.
pub fn truth_line(truth: &TruthFigures) -> String {
    let made = if truth.reused { "reused".to_owned() } else { format!("traced in {:.1} s", truth.seconds) };
    let dropped =
        if truth.dropped > 0 { format!("; {} samples were no numbers: a fault", truth.dropped) } else { String::new() };
    format!(
        "{}: {}; {} samples a pixel, expected relative error {:.2} %, {made}{dropped}",
        truth.name,
        truth.meaning,
        truth.spp,
        100.0 * truth.noise
    )
}

#[cfg(test)]
mod tests {
    use lanternfish::settings::Settings;

    use super::*;
    use crate::quality::{
        measure::{Errors, Figures},
        techniques::techniques,
    };

    fn row(name: &str, truth: &'static str, frames: u32, energy_ratio: f64) -> Row {
        let errors = Errors { flip: 0.0, hdr_flip: 0.0, relative_mse: 0.0, percentile_95: 0.0, energy_ratio };
        let figures = Figures {
            errors,
            frames,
            differing_pixels: 0,
            frame_ms: 0.0,
            rays: 0,
            listed_lights: 0,
            picture: String::new(),
            map: String::new(),
        };
        Row { name: name.to_owned(), truth, left_out: None, figures: Some(figures) }
    }

    fn truth(energy_without_indirect: Option<f64>, noise_energy: f64) -> TruthFigures {
        TruthFigures {
            name: "full",
            meaning: "",
            file: String::new(),
            picture: String::new(),
            spp: 1,
            reused: false,
            seconds: 0.0,
            dropped: 0,
            noise: 0.0,
            noise_relative_mse: 0.0,
            noise_energy,
            noise_flip: 0.0,
            noise_hdr_flip: 0.0,
            energy_without_indirect,
        }
    }

    #[test]
    fn indirect_light_is_what_a_picture_has_beyond_the_one_without() {
        let rows = [
            row("indirect none", "full", 1, 0.51),
            row("indirect none, 64 frames", "full", 64, 0.5),
            row("indirect sampled", "full", 1, 1.01),
            row("indirect sampled, 64 frames", "full", 64, 1.0),
            row("indirect sampled, 4 frames", "full", 4, 1.0),
            row("occlusion none", "occlusion", 1, 0.5),
            row("occlusion deep 64", "occlusion", 1, 0.9),
        ];
        // Direct light that is too bright is not indirect light.
        let found = rows.each_ref().map(|row| indirect_ratio(&rows, row, 0.5));
        assert_eq!(found, [None, None, Some(1.0), Some(1.0), None, None, None]);
        assert_eq!(indirect_ratio(&rows, &rows[2], 0.4), Some(0.5 / 0.4));
    }

    #[test]
    fn indirect_light_that_is_lost_in_noise_has_no_ratio() {
        assert_eq!(indirect_energy(&truth(Some(0.75), 0.01)), Some(0.25));
        assert_eq!(indirect_energy(&truth(Some(0.75), 0.0625)), None);
        assert_eq!(indirect_energy(&truth(Some(1.0), 0.0)), None);
        assert_eq!(indirect_energy(&truth(None, 0.0)), None);
    }

    #[test]
    fn rows_without_indirect_light_are_rows() {
        let rows = techniques(&Settings::direct_light(), 10.0);
        for name in WITHOUT_INDIRECT {
            assert!(rows.iter().any(|row| row.name == name), "no row {name}");
        }
    }
}
