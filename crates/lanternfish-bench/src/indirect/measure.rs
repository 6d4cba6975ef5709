//! Renders every configuration, times it, and compares its picture.

use std::path::Path;

use lanternfish::{
    GpuScene, Picture, RenderError, Renderer,
    settings::{DeepImageSettings, Indirect, Sampled, Settings},
};
use lanternfish_gpu::{Gpu, PassTime, Profiler};
use lanternfish_metrics::{ColorType, write_png};
use lanternfish_scene::Camera;
use serde::Serialize;

use super::{
    super::deep_images::{
        LeftOut,
        build::{Built, build},
        configurations::Expected,
    },
    cached::CachedRow,
    configurations::{Brdf, Configuration, Group, Plan},
    errors::{Errors, Yardsticks, energy},
    times::{Times, rays},
};
use crate::forward_plus::rgb;
use lanternfish_cli::{error::CliError, parse::Size, progress::Progress};

/// Figures of one configuration.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub brdf: Brdf,
    pub tracer: &'static str,
    /// Directions of the deep images that rays go through, where they do; one image serves two directions.
    pub directions: Option<u32>,
    pub resolution: Option<u32>,
    /// Bytes of the deep images' lists and fragments.
    pub bytes: Option<u64>,
    pub filter_radius: u32,
    pub samples: u32,
    pub accumulate: u32,
    /// Rays that count, summed over all frames.
    pub rays: u64,
    #[serde(flatten)]
    pub times: Times,
    /// Million rays a second: tracing alone, and with shading what they meet.
    pub rate_traced: f64,
    pub rate_shaded: f64,
    #[serde(flatten)]
    pub errors: Errors,
}

impl Row {
    fn new(
        configuration: Configuration,
        bytes: Option<u64>,
        picture: &Picture,
        times: Times,
        yardsticks: &Yardsticks<'_>,
    ) -> Result<Self, CliError> {
        let Configuration { brdf, images, filter_radius, samples, accumulate } = configuration;
        let covered = picture.radiance.iter().map(|pixel| pixel[3]);
        let rays = rays(covered, accumulate, brdf.counted_rays());
        let rate = |ms: f64| rays as f64 / ms / 1e3;
        Ok(Self {
            brdf,
            tracer: configuration.tracer().name(),
            directions: images.map(|(set, _)| set.directions()),
            resolution: images.map(|(set, _)| set.resolution),
            bytes,
            filter_radius,
            samples: samples.count(),
            accumulate,
            rays,
            rate_traced: rate(times.counted_trace_ms),
            rate_shaded: rate(times.counted_trace_ms + times.counted_shade_ms),
            times,
            errors: Errors::of(picture, yardsticks)?,
        })
    }

    /// Whether the row has the default filter and no antialiasing.
    pub fn is_plain(&self) -> bool {
        let filter_radius = Sampled::default().filter_radius;
        (self.filter_radius, self.samples, self.accumulate) == (filter_radius, 1, 1)
    }

    /// Whether the two differ in filter and antialiasing alone, if in anything.
    pub fn traces_as(&self, other: &Self) -> bool {
        let of = |row: &Self| (row.brdf, row.tracer, row.directions, row.resolution);
        of(self) == of(other)
    }
}

/// Everything that was measured.
#[derive(Debug, Default)]
pub struct Measured {
    pub images: Vec<Built>,
    pub rows: Vec<Row>,
    /// The radiance cache's.
    pub cached: Vec<CachedRow>,
    pub left_out: Vec<LeftOut>,
}

/// What every configuration shares.
pub struct Bench<'a> {
    pub gpu: &'a Gpu,
    /// Folder of the report's pictures.
    pub folder: &'a Path,
    pub camera: &'a Camera,
    pub size: Size,
    pub runs: u32,
    /// Settings of lights and look, which configurations do not change.
    pub look: &'a Settings,
    /// Number of frames whose mean is [`Yardsticks::converged`].
    pub converged_frames: u32,
    /// The scene with the materials of each BRDF, in the order of [`Brdf::ALL`].
    pub scenes: Vec<GpuScene>,
}

/// What the pictures of one BRDF, filter and antialiasing are compared with.
struct Reference {
    configuration: Configuration,
    bvh: Picture,
    direct_energy: f64,
}

impl Bench<'_> {
    pub fn measure(&self, plan: &Plan, progress: &mut Progress) -> Result<Measured, CliError> {
        let mut measured = Measured::default();
        let converged = Brdf::ALL.iter().map(|brdf| {
            let doing = format!("{}, {} frames through the BVH", brdf.name(), self.converged_frames);
            progress.step("converged", &doing, || self.converged(*brdf))
        });
        let converged = converged.collect::<Result<Vec<Picture>, CliError>>()?;
        let mut references = Vec::new();
        for configuration in &plan.through_bvh {
            let words = configuration.in_words();
            match progress.step("rows", &words, || self.reference(*configuration)) {
                Ok((reference, times)) => {
                    let yardsticks = yardsticks(&reference, &converged);
                    measured.rows.push(Row::new(*configuration, None, &reference.bvh, times, &yardsticks)?);
                    references.push(reference);
                }
                Err(error) => measured.left_out.push(LeftOut { what: words, reason: error.to_string() }),
            }
        }
        let mut profiler = Profiler::new(&self.gpu.device, &self.gpu.queue);
        for group in &plan.groups {
            match self.fragments_a_texel(group, &mut profiler, &mut measured.images, progress) {
                Ok(fragments) => self.group(group, fragments, &references, &converged, &mut measured, progress)?,
                Err(reason) => measured.left_out.push(LeftOut { what: group.set.in_words(), reason }),
            }
        }
        let set = plan.groups.first().map(|group| group.set);
        measured.cached = self.cached(set, &converged[Brdf::Diffuse as usize], progress)?;
        Ok(measured)
    }

    /// Builds the images of a group for their figures, and gives how they are best divided; or why there are none.
    fn fragments_a_texel(
        &self,
        group: &Group,
        profiler: &mut Profiler,
        built: &mut Vec<Built>,
        progress: &mut Progress,
    ) -> Result<u64, String> {
        let settings = sized(group.set.settings(), built)?;
        let doing = format!("Building, {}", group.set.in_words());
        // Their geometry is the same.
        let scene = self.scene(Brdf::Diffuse);
        let made = progress.step("build", &doing, || build(self.gpu, profiler, scene, self.runs, "indirect", settings));
        match made {
            Ok((figures, _)) => {
                built.push(figures);
                Ok(settings.fragments_a_texel)
            }
            Err(error) => Err(error.to_string()),
        }
    }

    fn group(
        &self,
        group: &Group,
        fragments_a_texel: u64,
        references: &[Reference],
        converged: &[Picture],
        measured: &mut Measured,
        progress: &mut Progress,
    ) -> Result<(), CliError> {
        let bytes = measured.images.last().map(|built| built.bytes);
        for configuration in &group.rows {
            let words = configuration.in_words();
            let known = references.iter().find(|known| known.configuration == configuration.through_bvh());
            let Some(reference) = known else {
                let reason = "there is no such picture through the BVH to compare with".to_owned();
                measured.left_out.push(LeftOut { what: words, reason });
                continue;
            };
            match progress.step("rows", &words, || self.render(*configuration, Some(fragments_a_texel))) {
                Ok((picture, times)) => {
                    let yardsticks = yardsticks(reference, converged);
                    measured.rows.push(Row::new(*configuration, bytes, &picture, times, &yardsticks)?);
                }
                Err(error) => measured.left_out.push(LeftOut { what: words, reason: error.to_string() }),
            }
        }
        Ok(())
    }

    pub fn scene(&self, brdf: Brdf) -> &GpuScene {
        &self.scenes[brdf as usize]
    }

    fn renderer(&self, settings: Settings) -> Result<Renderer, RenderError> {
        Renderer::new(&self.gpu.device, &self.gpu.queue, settings)
    }

    /// The mean of many frames through the BVH, which also goes to a file.
    fn converged(&self, brdf: Brdf) -> Result<Picture, CliError> {
        let accumulate = self.converged_frames;
        let configuration = Configuration { filter_radius: 0, accumulate, ..Configuration::plain(brdf) };
        let mut renderer = self.renderer(configuration.settings(self.look, None))?;
        let picture = renderer.render(self.scene(brdf), self.camera, self.size.width, self.size.height)?;
        if energy(&picture) <= 0.0 {
            return Err(CliError::new("the picture is black", "add lights, e.g. --lights rain:10, or look elsewhere"));
        }
        let file = self.folder.join(format!("{}.png", brdf.name()));
        write_png(&file, picture.width, picture.height, ColorType::Rgb, &rgb(&picture))?;
        Ok(picture)
    }

    fn reference(&self, configuration: Configuration) -> Result<(Reference, Times), RenderError> {
        let (bvh, times) = self.render(configuration, None)?;
        let direct = Settings { indirect: Indirect::None, ..configuration.settings(self.look, None) };
        let Size { width, height } = self.size;
        let direct = self.renderer(direct)?.render(self.scene(configuration.brdf), self.camera, width, height)?;
        Ok((Reference { configuration, bvh, direct_energy: energy(&direct) }, times))
    }

    /// The picture, and the times of the run whose frames took least; one before them is not timed.
    fn render(
        &self,
        configuration: Configuration,
        fragments_a_texel: Option<u64>,
    ) -> Result<(Picture, Times), RenderError> {
        let mut renderer = self.renderer(configuration.settings(self.look, fragments_a_texel))?;
        let brdf = configuration.brdf;
        let (mut picture, _) = self.frames(&mut renderer, configuration)?;
        let mut best: Option<Times> = None;
        for _ in 0..self.runs {
            let frames;
            (picture, frames) = self.frames(&mut renderer, configuration)?;
            let times = Times::of(&frames, brdf.skipped_rounds() + brdf.counted_rays(), brdf.skipped_rounds());
            if best.is_none_or(|best| times.frame_ms < best.frame_ms) {
                best = Some(times);
            }
        }
        Ok((picture, best.expect("one run at least")))
    }

    /// One picture, with the passes of each of its frames.
    fn frames(
        &self,
        renderer: &mut Renderer,
        configuration: Configuration,
    ) -> Result<(Picture, Vec<Vec<PassTime>>), RenderError> {
        let scene = self.scene(configuration.brdf);
        let Size { width, height } = self.size;
        if configuration.accumulate == 1 {
            let mut picture = renderer.render(scene, self.camera, width, height)?;
            let passes = std::mem::take(&mut picture.report.passes);
            return Ok((picture, vec![passes]));
        }
        // Frame by frame: of a whole picture the rounds' times come summed up.
        renderer.reset();
        let mut frames = Vec::new();
        loop {
            let mut picture = renderer.refine(scene, &[(self.camera, width, height)])?.remove(0);
            frames.push(std::mem::take(&mut picture.report.passes));
            if frames.len() == configuration.accumulate as usize {
                return Ok((picture, frames));
            }
        }
    }
}

/// Divided into as few chunks as fit, by the images that were built before; or why they would not fit.
fn sized(settings: DeepImageSettings, built: &[Built]) -> Result<DeepImageSettings, String> {
    let Some(expected) = Expected::of(&settings, built) else { return Ok(settings) };
    let count = settings.directions.count();
    if expected.most_directions() < count {
        let gigabytes = expected.bytes_a_direction * count as f64 / 1e9;
        return Err(format!("{count} images would take {gigabytes:.1} GB"));
    }
    Ok(DeepImageSettings { fragments_a_texel: expected.fragments_a_texel, ..settings })
}

fn yardsticks<'a>(reference: &'a Reference, converged: &'a [Picture]) -> Yardsticks<'a> {
    let Reference { configuration, bvh, direct_energy } = reference;
    Yardsticks { bvh, direct_energy: *direct_energy, converged: &converged[configuration.brdf as usize] }
}

#[cfg(test)]
mod tests {
    use super::{super::configurations::ImageSet, *};

    #[test]
    fn what_would_not_fit_is_left_out_with_its_size() {
        let fine = ImageSet { k: 8, resolution: 512 }.settings();
        assert_eq!(sized(fine, &[]), Ok(fine));
        let of = |bytes, drawn| {
            [Built { directions: 48, resolution: 128, supersampling: 1, bytes, drawn, ..Built::default() }]
        };
        // Four times as many images of sixteen times as many texels, two fragments each.
        let fits = sized(fine, &of(50_000_000, 2 * 48 * 128 * 128)).unwrap();
        assert_eq!(fits, DeepImageSettings { fragments_a_texel: 6, ..fine });
        assert_eq!(sized(fine, &of(100_000_000, 1)), Err("192 images would take 6.4 GB".to_owned()));
    }
}
