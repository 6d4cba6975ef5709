//! Measures one technique on one shot: image, time, and errors against the ground truth.

use std::time::Duration;

use lanternfish::{RenderError, RenderedImage, settings::Settings};
use lanternfish_cli::{
    error::CliError,
    flags::as_flags,
    images::{differing, hdr_flip, linear, shown},
    parse::Size,
    timed::Timed,
    times::{counter, frame_time},
};
use lanternfish_metrics::{ColorType, PIXELS_PER_DEGREE, Pair, RgbImage, write_png};
use lanternfish_scene::Scene;
use serde::Serialize;

use super::{shots::Shot, techniques::Technique};
use crate::{
    bench::{Bench, file_name},
    case::Case,
    view::View,
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
#[derive(Clone, Debug, Default, Serialize)]
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
#[derive(Clone, Debug, Default, Serialize)]
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
pub struct ShotBench<'b> {
    pub bench: &'b Bench,
    pub shot: &'b Shot,
    pub view: &'b View,
}

/// Image and results of the first row, with which other images are compared.
pub struct First {
    image: RenderedImage,
    /// Name of its ground truth.
    ground_truth: &'static str,
    figures: Figures,
}

impl ShotBench<'_> {
    /// Renders `technique` on `scene` and compares the image with `reference`. Stores the first row in `first`.
    pub fn row(
        &self,
        Technique { case, ground_truth }: &Technique,
        scene: &Scene,
        reference: &RgbImage,
        first: &mut Option<First>,
    ) -> Result<Row, CliError> {
        let ground_truth = lanternfish_scene::Named::name(*ground_truth);
        let row = |left_out, figures| Row { name: case.name.clone(), ground_truth, left_out, figures };
        let (image, frame_ms) = match self.render(&case.settings, scene) {
            Ok(rendered) => rendered,
            Err(RenderError::MissingFeature { feature, .. }) => {
                return Ok(row(Some(format!("the adapter has no {feature}")), None));
            }
            Err(error @ RenderError::Driver { .. }) => return Ok(row(Some(as_flags(&error.to_string())), None)),
            Err(error) => return Err(error.into()),
        };
        let differing_pixels = first.as_ref().map_or(0, |first| differing(&first.image, &image));
        let counter = |name| counter(&image.report, name);
        let same = first.as_ref().filter(|first| differing_pixels == 0 && first.ground_truth == ground_truth);
        let compared = match same {
            Some(first) => first.figures.clone(),
            None => self.compare(case, &image, reference)?,
        };
        let figures = Figures {
            frames: case.settings.image.accumulate,
            differing_pixels,
            frame_ms,
            rays: counter("shadows/rays"),
            listed_lights: counter("light_culling/listed_lights"),
            ..compared
        };
        first.get_or_insert_with(|| First { image, ground_truth, figures: figures.clone() });
        Ok(row(None, Some(figures)))
    }

    /// Renders the image, and returns it with its time, ms: the median of the frames after it, or for a mean the sum of
    /// its frames.
    fn render(&self, settings: &Settings, scene: &Scene) -> Result<(RenderedImage, f64), RenderError> {
        let mut stage = self.bench.stage(scene, settings)?;
        let (factor, size) = (self.shot.factor, self.view.size);
        let large = Size { width: factor * size.width, height: factor * size.height };
        let view = View { size: large, scene: Scene::default(), ..self.view.clone() };
        let (first_ms, image) = frame_time(|| stage.frame(&view))?;
        if settings.image.accumulate > 1 {
            return Ok((image, first_ms));
        }
        let times = Timed::within(self.bench.runs, ENOUGH, || frame_time(|| stage.frame(&view)).map(|(ms, _)| ms))?;
        Ok((image, times.median()))
    }

    /// Errors of an image, which is written with its FLIP map.
    fn compare(
        &self,
        Case { name, settings, .. }: &Case,
        image: &RenderedImage,
        reference: &RgbImage,
    ) -> Result<Figures, CliError> {
        let pair = Pair::new(linear(image)?.box_downsampled(self.shot.factor as usize)?, reference.clone())?;
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
        let stem = format!("renderings/{}-{}", self.shot.name, file_name(name));
        let [rendering, map_file] = [format!("{stem}.png"), format!("{stem}-flip.png")];
        self.write(&rendering, &image.0)?;
        self.write(&map_file, &map.magma())?;
        Ok(Figures { errors, rendering, map: map_file, ..Figures::default() })
    }

    /// Writes an image of the report, with the shot's size.
    pub fn write(&self, file: &str, rgb: &[u8]) -> Result<(), CliError> {
        let size = self.view.size;
        Ok(write_png(&self.bench.folder.join(file), [size.width, size.height], ColorType::Rgb, rgb)?)
    }
}
