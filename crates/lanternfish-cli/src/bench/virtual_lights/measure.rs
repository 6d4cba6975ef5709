//! Renders every configuration, times it, and compares its picture.

use std::path::Path;

use lanternfish::{
    Picture, Renderer,
    indirect::virtual_lights::{MapSize, Ranges},
    settings::{Settings, Tracer},
};
use lanternfish_gpu::Gpu;
use lanternfish_metrics::{ColorType, HdrFlip, Pair, RgbImage, write_png};
use lanternfish_scene::{Camera, Scene};
use serde::Serialize;

use super::{
    configurations::{Configuration, ranges_alone},
    steps::Steps,
};
use crate::{bench::forward_plus::rgb, error::CliError, parse::Size};

/// One way to find indirect light.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub name: String,
    pub has_steps: bool,
    #[serde(flatten)]
    pub steps: Steps,
    /// Texels of the map that became lights, and those that were listed.
    pub unique: u64,
    pub listed: u64,
    pub too_small: u64,
    pub too_large: u64,
    /// Flux that arrives within ranges, over all that arrives anywhere; none where it is not counted.
    pub in_range: Option<f64>,
    #[serde(flatten)]
    pub errors: Errors,
}

/// Against the path tracer.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Errors {
    /// Sum of the radiance of indirect light alone over that of the truth.
    pub indirect_energy: f64,
    /// Mean HDR-FLIP of the whole picture.
    pub flip: f64,
}

/// Rays that find ranges, of one size of the map.
#[derive(Clone, Debug, Serialize)]
pub struct RangeRow {
    pub map: u32,
    /// Lights that rays were cast from.
    pub lights: u64,
    pub deep_images_ms: f64,
    pub bvh_ms: f64,
    pub random_ms: f64,
}

impl RangeRow {
    /// Million rays a second through deep images, and through the BVH.
    pub fn rates(&self) -> [f64; 2] {
        [self.deep_images_ms, self.bvh_ms].map(|ms| 6.0 * self.lights as f64 / ms / 1e3)
    }
}

/// What every configuration shares.
pub struct Bench<'a> {
    pub gpu: &'a Gpu,
    pub folder: &'a Path,
    /// The scene, without light but that of its lights.
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub size: Size,
    pub runs: u32,
    /// The path tracer's pictures: with one bounce, and the energy of the bounce alone.
    pub truth: &'a RgbImage,
    pub truth_energy: f64,
    /// Energy of the renderer's own picture without indirect light.
    pub direct_energy: f64,
}

impl Bench<'_> {
    /// The picture, and the run whose frame took least; one before them is not timed.
    pub fn render(&self, settings: &Settings, size: Size) -> Result<(Picture, Steps), CliError> {
        let mut renderer = Renderer::new(&self.gpu.device, &self.gpu.queue, settings.clone())?;
        let uploaded = renderer.upload(self.scene)?;
        let mut frame = || renderer.render(&uploaded, self.camera, size.width, size.height);
        // Deep images are built in the first frame alone.
        let first = frame()?;
        let built = Steps::of(&first.report.passes);
        let mut best: Option<(Picture, Steps)> = None;
        for _ in 0..self.runs {
            let picture = frame()?;
            let mut steps = Steps::of(&picture.report.passes);
            steps.steps[..2].copy_from_slice(&built.steps[..2]);
            if best.as_ref().is_none_or(|(_, best)| steps.frame < best.frame) {
                best = Some((picture, steps));
            }
        }
        Ok(best.expect("one run at least"))
    }

    /// A row of the table. Its picture goes to the folder.
    pub fn row(&self, configuration: &Configuration) -> Result<Row, CliError> {
        let (picture, steps) = self.render(&configuration.settings, self.size)?;
        let file = format!("{}.png", configuration.name.replace([' ', ',', '.'], "-").replace("--", "-"));
        write_png(&self.folder.join(file), picture.width, picture.height, ColorType::Rgb, &rgb(&picture))?;
        let count = |name: &str| counter(&picture, &format!("virtual_lights/{name}"));
        let arriving = count("flux_arriving");
        Ok(Row {
            name: configuration.name.clone(),
            has_steps: configuration.has_steps,
            steps,
            unique: count("unique"),
            listed: count("listed"),
            too_small: count("too_small"),
            too_large: count("too_large"),
            in_range: (arriving > 0).then(|| count("flux_in_range") as f64 / arriving as f64),
            errors: self.errors(&picture)?,
        })
    }

    fn errors(&self, picture: &Picture) -> Result<Errors, CliError> {
        let pair = Pair::new(linear(picture)?, self.truth.clone())?;
        let flip = pair.mean_of(&pair.flip_hdr(&HdrFlip::default())?.map);
        Ok(Errors { indirect_energy: (energy(picture) - self.direct_energy) / self.truth_energy, flip })
    }

    /// Rays that find ranges in a map of this size: through deep images, through the BVH, and random ranges.
    pub fn ranges(&self, look: &Settings, map: MapSize) -> Result<RangeRow, CliError> {
        let of = |ranges, tracer| {
            // The picture matters not.
            self.render(&ranges_alone(look, map, ranges, tracer), Size { width: 64, height: 36 })
        };
        let (picture, deep) = of(Ranges::Average, Tracer::WithinTexel)?;
        let (_, bvh) = of(Ranges::Average, Tracer::Bvh)?;
        let (_, random) = of(Ranges::Random, Tracer::WithinTexel)?;
        Ok(RangeRow {
            map: map.texels(),
            lights: counter(&picture, "virtual_lights/unique"),
            deep_images_ms: deep.range_rays + deep.ranges,
            bvh_ms: bvh.range_rays + bvh.ranges,
            random_ms: random.ranges,
        })
    }
}

fn counter(picture: &Picture, name: &str) -> u64 {
    picture.report.counters.iter().find(|(known, _)| known == name).map_or(0, |(_, count)| *count)
}

/// Sum of all channels of all pixels.
pub fn energy(picture: &Picture) -> f64 {
    picture.radiance.iter().flat_map(|pixel| &pixel[..3]).map(|value| f64::from(*value)).sum()
}

/// The same of a picture of the path tracer.
pub fn energy_of(image: &RgbImage) -> f64 {
    image.pixels.iter().flatten().map(|value| f64::from(*value)).sum()
}

fn linear(picture: &Picture) -> Result<RgbImage, CliError> {
    let pixels = picture.radiance.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    Ok(RgbImage::new(picture.width as usize, picture.height as usize, pixels)?)
}
