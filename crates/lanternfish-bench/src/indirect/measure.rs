//! Renders and times every configuration, and compares its image.

use lanternfish::{GpuScene, RenderError, RenderedImage, Renderer, settings::Settings, techniques::Sampled};
use lanternfish_cli::{error::CliError, parse::Size, progress::Progress};
use lanternfish_gpu::{PassTime, Profiler};
use lanternfish_papers::{ACROSS_TEXELS, DeepImageSettings};
use lanternfish_scene::{Camera, Scene};

use super::{
    cases::{Brdf, Case, Group, ImageSet, Plan},
    errors::{Baselines, errors},
    times::{Times, rays},
};
use crate::{
    deep_images::{build::build, cases::Expected},
    document::LeftOut,
    image::{self, energy},
    run::{Run, least},
    table::{DASH, Row},
    technique,
};

/// Row of a configuration.
fn row(case: Case, bytes: u64, rendering: &RenderedImage, times: Times, errors: Row) -> Row {
    let Case { brdf, images, filter_radius, samples, accumulate } = case;
    let covered = rendering.radiance.iter().map(|pixel| pixel[3]);
    // Sum over all frames.
    let rays = rays(covered, accumulate, brdf.counted_rays());
    let rate = |ms: f64| rays as f64 / ms / 1e3;
    let resolution = images.map(|(set, _)| set.resolution);
    Row::default()
        .text("brdf", "BRDF", brdf.name())
        .shown("rays per pixel", brdf.counted_rays())
        .text("tracer", "tracer", case.tracer().name())
        // A deep image holds two opposite directions.
        .optional("directions", "directions", images.map(|(set, _)| set.directions()))
        .optional("resolution", "texels", resolution)
        .said_as(resolution.map_or(DASH.to_owned(), |texels| format!("{texels}²")))
        .data("bytes", images.map(|_| bytes))
        .number("filter_radius", "filter", filter_radius)
        .number("samples", "samples", samples.count())
        .number("accumulate", "frames", accumulate)
        .count("rays", "rays traced", rays)
        .and(times.row())
        .fixed("rate_traced", "traced, M/s", 2, rate(times.counted_trace_ms))
        .fixed("rate_shaded", "with shading, M/s", 2, rate(times.counted_trace_ms + times.counted_shade_ms))
        .and(errors)
}

/// True if a row has the default filter and no antialiasing.
pub fn is_plain(row: &Row) -> bool {
    *row.get("filter_radius") == Sampled::default().filter_radius
        && *row.get("samples") == 1
        && *row.get("accumulate") == 1
}

/// True if two rows differ at most in filter and antialiasing.
pub fn trace_alike(a: &Row, b: &Row) -> bool {
    ["brdf", "tracer", "directions", "resolution"].iter().all(|key| a.get(key) == b.get(key))
}

/// All results.
#[derive(Debug, Default)]
pub struct Measured {
    pub images: Vec<Row>,
    pub rows: Vec<Row>,
    /// Rows of the radiance cache.
    pub cached: Vec<Row>,
    /// Soft shadows.
    pub soft: Vec<Row>,
    /// Diffuse and glossy light together: images, and milliseconds of the frame.
    pub parts: Option<(ImageSet, f64)>,
    pub left_out: Vec<LeftOut>,
}

impl Measured {
    /// Lists a case without figures.
    pub fn leave_out(&mut self, what: String, reason: impl ToString) {
        self.left_out.push(LeftOut { what, reason: reason.to_string() });
    }
}

/// Inputs of all configurations.
pub struct Bench<'a> {
    pub run: &'a Run,
    pub camera: &'a Camera,
    pub size: Size,
    /// As it was read, for what changes its lights.
    pub source: &'a Scene,
    /// Settings of lights and look, which cases do not change.
    pub look: &'a Settings,
    /// Number of frames whose mean is [`Baselines::converged`].
    pub converged_frames: u32,
    /// The scene with the materials of each BRDF, in the order of [`Brdf::ALL`].
    pub scenes: Vec<GpuScene>,
}

/// Reference of all images with the same BRDF, filter and antialiasing.
struct Reference {
    case: Case,
    bvh: RenderedImage,
    direct_energy: f64,
}

impl Reference {
    fn baselines<'a>(&'a self, converged: &'a [RenderedImage]) -> Baselines<'a> {
        let converged = &converged[self.case.brdf as usize];
        Baselines { bvh: &self.bvh, direct_energy: self.direct_energy, converged }
    }
}

impl Bench<'_> {
    /// Measures a plan. Configurations that fail on the adapter or in the renderer are left out.
    pub fn measure(&self, plan: &Plan, progress: &mut Progress) -> Result<Measured, CliError> {
        let mut measured = Measured::default();
        let converged = Brdf::ALL.iter().map(|brdf| {
            let doing = format!("{}, {} frames through the BVH", brdf.name(), self.converged_frames);
            progress.step("converged", &doing, || self.converged(*brdf))
        });
        let converged = converged.collect::<Result<Vec<RenderedImage>, CliError>>()?;
        let mut references = Vec::new();
        for case in &plan.through_bvh {
            let words = case.in_words();
            match progress.step("rows", &words, || self.reference(*case)) {
                Ok((reference, times)) => {
                    let errors = errors(&reference.bvh, &reference.baselines(&converged))?;
                    measured.rows.push(row(*case, 0, &reference.bvh, times, errors));
                    references.push(reference);
                }
                Err(error) => measured.leave_out(words, error),
            }
        }
        let mut profiler = Profiler::new(&self.run.gpu.device, &self.run.gpu.queue);
        for group in &plan.groups {
            match self.fragments_a_texel(group, &mut profiler, &mut measured.images, progress) {
                Ok(fragments) => self.group(group, fragments, &references, &converged, &mut measured, progress)?,
                Err(reason) => measured.leave_out(group.set.in_words(), reason),
            }
        }
        measured.cached = self.cached(plan.cached, &converged[Brdf::Diffuse as usize], progress)?;
        measured.soft = self.soft_shadows(&plan.soft, &mut measured, progress)?;
        match self.parts(plan.parts, &measured.images, progress) {
            Ok(ms) => measured.parts = Some((plan.parts, ms)),
            Err(error) => measured.leave_out("diffuse and glossy light together".to_owned(), error),
        }
        Ok(measured)
    }

    /// Builds and times the images of a group, and returns the fragments per texel for their division into chunks.
    ///
    /// # Errors
    ///
    /// Returns the reason if the images do not fit or cannot be built.
    fn fragments_a_texel(
        &self,
        group: &Group,
        profiler: &mut Profiler,
        built: &mut Vec<Row>,
        progress: &mut Progress,
    ) -> Result<u64, String> {
        let settings = sized(group.set.settings(), built)?;
        let doing = format!("Building, {}", group.set.in_words());
        // The scenes of all BRDFs have the same geometry.
        let (run, scene) = (self.run, self.scene(Brdf::Diffuse));
        let made = progress.step("build", &doing, || build(&run.gpu, profiler, scene, run.runs, "indirect", settings));
        built.push(made.map_err(|error| error.to_string())?.0);
        Ok(settings.fragments_a_texel)
    }

    fn group(
        &self,
        group: &Group,
        fragments_a_texel: u64,
        references: &[Reference],
        converged: &[RenderedImage],
        measured: &mut Measured,
        progress: &mut Progress,
    ) -> Result<(), CliError> {
        let bytes = measured.images.last().and_then(|built| built.get("bytes").as_u64()).unwrap_or(0);
        for case in &group.rows {
            let words = case.in_words();
            let Some(reference) = references.iter().find(|reference| reference.case == case.through_bvh()) else {
                measured.leave_out(words, "no image through the BVH to compare with");
                continue;
            };
            match progress.step("rows", &words, || self.render(*case, Some(fragments_a_texel))) {
                Ok((rendering, times)) => {
                    let errors = errors(&rendering, &reference.baselines(converged))?;
                    if reference.case == Case::plain(case.brdf) && case.tracer() == ACROSS_TEXELS {
                        let name = format!("across-texels-{}-{}.png", case.brdf.name(), group.set.in_name());
                        image::write(&self.run.folder.join(name), &rendering)?;
                    }
                    measured.rows.push(row(*case, bytes, &rendering, times, errors));
                }
                Err(error) => measured.leave_out(words, error),
            }
        }
        Ok(())
    }

    pub fn scene(&self, brdf: Brdf) -> &GpuScene {
        &self.scenes[brdf as usize]
    }

    fn renderer(&self, settings: Settings) -> Result<Renderer, RenderError> {
        Renderer::with_engine(&self.run.engine, settings)
    }

    /// Renders the mean of many frames through the BVH, and writes it to a file.
    fn converged(&self, brdf: Brdf) -> Result<RenderedImage, CliError> {
        let accumulate = self.converged_frames;
        let case = Case { filter_radius: 0, accumulate, ..Case::plain(brdf) };
        let mut renderer = self.renderer(case.settings(self.look, None))?;
        let rendering = renderer.render(self.scene(brdf), self.camera, self.size.width, self.size.height)?;
        if energy(&rendering) <= 0.0 {
            return Err(CliError::new(
                "the image is black",
                "add lights, e.g. --lights rain:10, or choose another view",
            ));
        }
        image::write(&self.run.folder.join(format!("{}.png", brdf.name())), &rendering)?;
        Ok(rendering)
    }

    fn reference(&self, case: Case) -> Result<(Reference, Times), RenderError> {
        let (bvh, times) = self.render(case, None)?;
        let direct = case.settings(self.look, None).with_indirect(technique::NO_INDIRECT);
        let Size { width, height } = self.size;
        let direct = self.renderer(direct)?.render(self.scene(case.brdf), self.camera, width, height)?;
        Ok((Reference { case, bvh, direct_energy: energy(&direct) }, times))
    }

    /// Renders the image, and returns it with the times of the fastest run. A first run is not timed.
    fn render(&self, case: Case, fragments_a_texel: Option<u64>) -> Result<(RenderedImage, Times), RenderError> {
        let mut renderer = self.renderer(case.settings(self.look, fragments_a_texel))?;
        let (skipped, counted) = (case.brdf.skipped_rays(), case.brdf.counted_rays());
        let frames = || {
            let (rendering, frames) = self.frames(&mut renderer, case)?;
            Ok::<_, RenderError>((rendering, Times::of(&frames, skipped + counted, skipped)))
        };
        Ok(least(self.run.runs, frames, |(_, times)| times.frame_ms)?.1)
    }

    /// Renders one image, and returns it with the passes of each of its frames.
    fn frames(&self, renderer: &mut Renderer, case: Case) -> Result<(RenderedImage, Vec<Vec<PassTime>>), RenderError> {
        let scene = self.scene(case.brdf);
        let Size { width, height } = self.size;
        if case.accumulate == 1 {
            let mut rendering = renderer.render(scene, self.camera, width, height)?;
            let passes = std::mem::take(&mut rendering.report.passes);
            return Ok((rendering, vec![passes]));
        }
        // Frame by frame, because the report of an accumulated image holds only the sum of its frames' times.
        renderer.reset();
        let mut frames = Vec::new();
        loop {
            let mut rendering = renderer.refine(scene, &[(self.camera, width, height)])?.remove(0);
            frames.push(std::mem::take(&mut rendering.report.passes));
            if frames.len() == case.accumulate as usize {
                return Ok((rendering, frames));
            }
        }
    }
}

/// Divided into as few chunks as fit, by the images that were built before; or why they would not fit.
pub fn sized(settings: DeepImageSettings, built: &[Row]) -> Result<DeepImageSettings, String> {
    let Some(expected) = Expected::of(&settings, built) else { return Ok(settings) };
    let count = settings.directions.count();
    if expected.most_directions() < count {
        let gigabytes = expected.bytes_a_direction * count as f64 / 1e9;
        return Err(format!("{count} images would take {gigabytes:.1} GB"));
    }
    Ok(DeepImageSettings { fragments_a_texel: expected.fragments_a_texel, ..settings })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deep_images::cases::built;

    #[test]
    fn images_that_would_not_fit_are_left_out_with_their_size() {
        let fine = ImageSet { k: 8, resolution: 512 }.settings();
        assert_eq!(sized(fine, &[]), Ok(fine));
        // Four times as many images with sixteen times as many texels, and two fragments per texel.
        let fits = sized(fine, &[built(48, 128, 50_000_000, 2 * 48 * 128 * 128)]).unwrap();
        assert_eq!(fits, DeepImageSettings { fragments_a_texel: 6, ..fine });
        let too_large = sized(fine, &[built(48, 128, 100_000_000, 1)]);
        assert_eq!(too_large, Err("192 images would take 6.4 GB".to_owned()));
    }
}
