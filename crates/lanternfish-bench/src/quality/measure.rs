//! Measures one technique on one shot: image, time, and errors against the ground truth.

use std::time::{Duration, Instant};

use lanternfish::{RenderError, RenderedImage, Renderer};
use lanternfish_cli::{error::CliError, flags::as_flags};
use lanternfish_metrics::{ColorType, PIXELS_PER_DEGREE, Pair, RgbImage, write_png};
use lanternfish_scene::{Camera, Scene};
use serde::Serialize;

use super::{shots::Shot, techniques::Technique};
use crate::{
    image::{differing, hdr_flip, linear, shown},
    run::{Run, counter, median, ms_of},
};

/// Timing of a technique stops after this duration.
const ENOUGH: Duration = Duration::from_secs(2);

/// A row of the report.
#[derive(Debug, Serialize)]
pub struct Row {
    pub name: String,
    pub ground_truth: &'static str,
    /// Reason for missing results.
    pub left_out: Option<String>,
    pub figures: Option<Figures>,
}

/// Results of a technique on a shot.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    pub errors: Errors,
    /// Number of frames averaged in the image.
    pub frames: u32,
    /// Number of pixels of the larger image that are not bit-identical to the default's.
    pub differing_pixels: usize,
    /// Sum of all passes, median over the runs, ms; wall-clock time if the adapter has no timestamps.
    pub frame_ms: f64,
    /// Number of shadow rays of opaque surfaces.
    pub rays: u64,
    /// Number of entries of all light lists.
    pub listed_lights: u64,
    /// Path of the image, relative to the report's folder; that of the default if the image is identical.
    pub rendering: String,
    /// Path of the FLIP map, likewise.
    pub map: String,
}

/// Errors against the ground truth.
#[derive(Clone, Debug, Serialize)]
pub struct Errors {
    /// Mean LDR-FLIP of the display colours.
    pub flip: f64,
    /// Mean HDR-FLIP of the radiance.
    pub hdr_flip: f64,
    pub relative_mse: f64,
    /// 95th percentile of the relative errors of all channels.
    pub percentile_95: f64,
    pub energy_ratio: f64,
}

/// Inputs of all rows of a shot.
pub struct Bench<'b> {
    pub run: &'b Run,
    pub shot: &'b Shot,
    pub camera: &'b Camera,
}

/// Image and results of the first row, with which other images are compared.
pub struct First {
    rendering: RenderedImage,
    /// Name of its ground truth.
    ground_truth: &'static str,
    figures: Figures,
}

impl Bench<'_> {
    /// Renders `technique` on `scene` and compares the image with `ground_truth`. Stores the first row in `first`.
    pub fn row(
        &self,
        technique: &Technique,
        scene: &Scene,
        ground_truth: &RgbImage,
        first: &mut Option<First>,
    ) -> Result<Row, CliError> {
        let ground_truth_name = technique.ground_truth.name();
        let row = |left_out, figures| Row {
            name: technique.name.clone(),
            ground_truth: ground_truth_name,
            left_out,
            figures,
        };
        let (rendering, frame_ms) = match self.render(technique, scene) {
            Ok(rendered) => rendered,
            Err(RenderError::MissingFeature { feature, .. }) => {
                return Ok(row(Some(format!("the adapter has no {feature}")), None));
            }
            Err(error @ RenderError::Driver { .. }) => return Ok(row(Some(as_flags(&error.to_string())), None)),
            Err(error) => return Err(error.into()),
        };
        let differing_pixels = first.as_ref().map_or(0, |first| differing(&first.rendering, &rendering));
        let counter = |name| counter(&rendering.report, name);
        let same = first.as_ref().filter(|first| differing_pixels == 0 && first.ground_truth == ground_truth_name);
        let (errors, files) = match same {
            Some(first) => (first.figures.errors.clone(), [first.figures.rendering.clone(), first.figures.map.clone()]),
            None => self.compare(technique, &rendering, ground_truth)?,
        };
        let [file, map] = files;
        let figures = Figures {
            errors,
            frames: technique.settings.image.accumulate,
            differing_pixels,
            frame_ms,
            rays: counter("shadows/rays"),
            listed_lights: counter("light_culling/listed_lights"),
            rendering: file,
            map,
        };
        first.get_or_insert_with(|| First { rendering, ground_truth: ground_truth_name, figures: figures.clone() });
        Ok(row(None, Some(figures)))
    }

    /// Renders the image, and returns it with its time, ms: the median of the frames after it, or for a mean the sum of its frames.
    fn render(&self, technique: &Technique, scene: &Scene) -> Result<(RenderedImage, f64), RenderError> {
        let mut renderer = Renderer::with_engine(&self.run.engine, technique.settings.clone())?;
        let uploaded = renderer.upload(scene)?;
        let Shot { size, factor, .. } = self.shot;
        let mut timed = || {
            let started = Instant::now();
            let rendering = renderer.render(&uploaded, self.camera, factor * size.width, factor * size.height)?;
            let wall_ms = 1e3 * started.elapsed().as_secs_f64();
            let passes = &rendering.report.passes;
            let ms = if passes.is_empty() { wall_ms } else { ms_of(passes, "") };
            Ok::<_, RenderError>((rendering, ms))
        };
        let (rendering, first_ms) = timed()?;
        if technique.settings.image.accumulate > 1 {
            return Ok((rendering, first_ms));
        }
        let mut times: Vec<f64> = Vec::new();
        let begun = Instant::now();
        while times.len() < self.run.runs as usize && (times.is_empty() || begun.elapsed() < ENOUGH) {
            times.push(timed()?.1);
        }
        Ok((rendering, median(&mut times)))
    }

    fn compare(
        &self,
        technique: &Technique,
        rendering: &RenderedImage,
        ground_truth: &RgbImage,
    ) -> Result<(Errors, [String; 2]), CliError> {
        let pair = Pair::new(linear(rendering)?.box_downsampled(self.shot.factor as usize)?, ground_truth.clone())?;
        let settings = &technique.settings;
        let [image, reference] = [pair.image(), pair.reference()]
            .map(|image| shown(image, settings.image.exposure, settings.image.tone_map));
        let display = Pair::new(image.1, reference.1)?;
        let map = display.flip_ldr(PIXELS_PER_DEGREE)?;
        let linear = pair.errors();
        let errors = Errors {
            flip: display.mean_of(&map),
            hdr_flip: hdr_flip(&pair)?,
            relative_mse: linear.relative_mse,
            percentile_95: linear.relative.percentile_95,
            energy_ratio: linear.energy_ratio,
        };
        let stem = format!("renderings/{}-{}", self.shot.name, technique.file_name());
        let files = [format!("{stem}.png"), format!("{stem}-flip.png")];
        self.write(&files[0], &image.0)?;
        self.write(&files[1], &map.magma())?;
        Ok((errors, files))
    }

    /// Writes an image of the report, with the shot's size.
    pub fn write(&self, file: &str, rgb: &[u8]) -> Result<(), CliError> {
        let size = self.shot.size;
        Ok(write_png(&self.run.folder.join(file), size.width, size.height, ColorType::Rgb, rgb)?)
    }
}
