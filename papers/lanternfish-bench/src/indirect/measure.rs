//! Renders and times every configuration, and compares its image.

use lanternfish::{GpuScene, RenderError, RenderedImage, Renderer, settings::Settings, techniques::Sampled};
use lanternfish_cli::{error::CliError, images::energy, parse::Size, timed::Timed, times::frame_ms};
use lanternfish_gpu::{PassTime, Profiler};
use lanternfish_papers::{ACROSS_TEXELS, DeepImageSettings};

use super::{
    cases::{Brdf, Group, ImageSet, Plan, RayCase},
    errors::{Baselines, errors},
    times::{Times, rays},
};
use crate::{
    bench::Bench,
    case::changed,
    deep_images::{build::build, cases::Expected},
    table::{DASH, Row},
    view::View,
};

/// Row of a configuration.
fn row(case: RayCase, bytes: u64, rendering: &RenderedImage, times: Times, errors: Row) -> Row {
    let RayCase { brdf, images, filter_radius, samples, accumulate } = case;
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
    /// Soft shadows.
    pub soft: Vec<Row>,
    /// Diffuse light by his filter and ours.
    pub filters: Vec<Row>,
    /// Diffuse and glossy light together: images, and milliseconds of the frame.
    pub parts: Option<(ImageSet, f64)>,
}

/// Inputs of all configurations.
pub struct RayBench {
    pub bench: Bench,
    /// The scene as it was read, and the look, which cases do not change.
    pub view: View,
    /// Number of frames whose mean is [`Baselines::converged`].
    pub converged_frames: u32,
    /// The scene with the materials of each BRDF, in the order of [`Brdf::ALL`].
    pub scenes: Vec<GpuScene>,
}

/// Reference of all images with the same BRDF, filter and antialiasing.
struct Reference {
    case: RayCase,
    bvh: RenderedImage,
    direct_energy: f64,
}

impl Reference {
    fn baselines<'a>(&'a self, converged: &'a [RenderedImage]) -> Baselines<'a> {
        let converged = &converged[self.case.brdf as usize];
        Baselines { bvh: &self.bvh, direct_energy: self.direct_energy, converged }
    }
}

impl RayBench {
    /// Measures a plan. Configurations that fail on the adapter or in the renderer are left out.
    pub fn measure(&self, plan: &Plan) -> Result<Measured, CliError> {
        let (bench, mut measured) = (&self.bench, Measured::default());
        let doing = |brdf: &Brdf| format!("{}, {} frames through the BVH", brdf.name(), self.converged_frames);
        let converged = bench.rows("converged", Brdf::ALL, doing, |brdf| self.converged(*brdf))?;
        let mut references = Vec::new();
        for case in &plan.through_bvh {
            let words = case.in_words();
            match bench.step("rows", &words, || self.reference(*case)) {
                Ok((reference, times)) => {
                    let errors = errors(&reference.bvh, &reference.baselines(&converged))?;
                    measured.rows.push(row(*case, 0, &reference.bvh, times, errors));
                    references.push(reference);
                }
                Err(error) => bench.leave_out(words, error),
            }
        }
        let mut profiler = Profiler::new(&bench.gpu.device, &bench.gpu.queue);
        for group in &plan.groups {
            if !bench.has_time(&group.set.in_words()) {
                continue;
            }
            match self.fragments_a_texel(group, &mut profiler, &mut measured.images) {
                Ok(fragments) => self.group(group, fragments, &references, &converged, &mut measured)?,
                Err(reason) => bench.leave_out(group.set.in_words(), reason),
            }
        }
        measured.soft = self.soft_shadows(&plan.soft, &measured.images)?;
        let filters = || self.filters(plan.filtered, &measured.images, &converged[Brdf::Diffuse as usize]);
        match bench.step("filters", "Filters of diffuse light", filters) {
            Ok(rows) => measured.filters = rows,
            Err(error) => bench.leave_out("filters of diffuse light", error),
        }
        match self.parts(plan.parts, &measured.images) {
            Ok(ms) => measured.parts = Some((plan.parts, ms)),
            Err(error) => bench.leave_out("diffuse and glossy light together", error),
        }
        Ok(measured)
    }

    /// Builds and times the images of a group, and returns the fragments per texel for their division into chunks.
    ///
    /// # Errors
    ///
    /// Returns the reason if the images do not fit or cannot be built.
    fn fragments_a_texel(&self, group: &Group, profiler: &mut Profiler, built: &mut Vec<Row>) -> Result<u64, CliError> {
        let (bench, settings) = (&self.bench, sized(group.set.settings(), built)?);
        // The scenes of all BRDFs have the same geometry.
        let scene = self.scene(Brdf::Diffuse);
        let build = || build(bench, profiler, scene, bench.runs, "indirect", settings);
        built.push(bench.step("build", &format!("Building, {}", group.set.in_words()), build)?.0);
        Ok(settings.fragments_a_texel)
    }

    fn group(
        &self,
        group: &Group,
        fragments_a_texel: u64,
        references: &[Reference],
        converged: &[RenderedImage],
        measured: &mut Measured,
    ) -> Result<(), CliError> {
        let bytes = measured.images.last().and_then(|built| built.get("bytes").as_u64()).unwrap_or(0);
        for case in &group.rows {
            let words = case.in_words();
            if !self.bench.has_time(&words) {
                continue;
            }
            let Some(reference) = references.iter().find(|reference| reference.case == case.through_bvh()) else {
                self.bench.leave_out(words, "no image through the BVH to compare with");
                continue;
            };
            match self.bench.step("rows", &words, || self.render(*case, Some(fragments_a_texel))) {
                Ok((image, times)) => {
                    let errors = errors(&image, &reference.baselines(converged))?;
                    if reference.case == RayCase::plain(case.brdf) && case.tracer() == ACROSS_TEXELS {
                        let name = format!("across-texels-{}-{}", case.brdf.name(), group.set.in_name());
                        self.bench.write(&name, &image)?;
                    }
                    measured.rows.push(row(*case, bytes, &image, times, errors));
                }
                Err(error) => self.bench.leave_out(words, error),
            }
        }
        Ok(())
    }

    pub fn scene(&self, brdf: Brdf) -> &GpuScene {
        &self.scenes[brdf as usize]
    }

    /// Renders one frame, or the mean of `settings.image.accumulate`.
    pub fn frame(&self, brdf: Brdf, settings: &Settings) -> Result<RenderedImage, RenderError> {
        let Size { width, height } = self.view.size;
        self.bench.renderer(settings)?.render(self.scene(brdf), &self.view.camera, [width, height])
    }

    /// The frame that took least, after a warm-up frame.
    pub fn fastest(&self, scene: &GpuScene, settings: &Settings) -> Result<RenderedImage, RenderError> {
        let (Size { width, height }, mut renderer) = (self.view.size, self.bench.renderer(settings)?);
        let mut frame = || renderer.render(scene, &self.view.camera, [width, height]);
        frame()?;
        Ok(Timed::fastest(self.bench.runs, || frame().map(|image| (frame_ms(&image.report.passes), image)))?.1)
    }

    /// Renders the mean of many frames through the BVH, and writes it to a file.
    fn converged(&self, brdf: Brdf) -> Result<RenderedImage, CliError> {
        let case = RayCase { filter_radius: 0, accumulate: self.converged_frames, ..RayCase::plain(brdf) };
        let image = self.frame(brdf, &case.settings(&self.view.look, None))?;
        if energy(&image) <= 0.0 {
            let hint = "add lights, e.g. --lights rain:10, or choose another view";
            return Err(CliError::new("the image is black", hint));
        }
        self.bench.write(brdf.name(), &image)?;
        Ok(image)
    }

    fn reference(&self, case: RayCase) -> Result<(Reference, Times), RenderError> {
        let (bvh, times) = self.render(case, None)?;
        let direct = self.frame(case.brdf, &changed(&case.settings(&self.view.look, None), "indirect none"))?;
        Ok((Reference { case, bvh, direct_energy: energy(&direct) }, times))
    }

    /// Renders the image, and returns it with the times of the fastest run. A first run is not timed.
    fn render(&self, case: RayCase, fragments_a_texel: Option<u64>) -> Result<(RenderedImage, Times), RenderError> {
        let settings = case.settings(&self.view.look, fragments_a_texel);
        let mut renderer = self.bench.renderer(&self.bench.made(&case.in_words(), &settings))?;
        let (skipped, counted) = (case.brdf.skipped_rays(), case.brdf.counted_rays());
        let mut frames = || {
            // Frame by frame, because the report of an accumulated image holds only the sum of its frames' times.
            let (image, frames) = self.frames(&mut renderer, case.brdf, case.accumulate)?;
            Ok::<_, RenderError>((image, Times::of(&frames, skipped + counted, skipped)))
        };
        frames()?;
        Ok(Timed::fastest(self.bench.runs, || frames().map(|(image, times)| (times.frame_ms, (image, times))))?.1)
    }

    /// Renders an image frame by frame, and returns it with the passes of each of its frames.
    pub fn frames(
        &self,
        renderer: &mut Renderer,
        brdf: Brdf,
        count: u32,
    ) -> Result<(RenderedImage, Vec<Vec<PassTime>>), RenderError> {
        let (scene, Size { width, height }) = (self.scene(brdf), self.view.size);
        if count > 1 {
            renderer.reset();
        }
        let mut frames = Vec::new();
        loop {
            let mut image = match count {
                1 => renderer.render(scene, &self.view.camera, [width, height])?,
                _ => renderer.refine(scene, &[(&self.view.camera, [width, height])])?.remove(0),
            };
            frames.push(std::mem::take(&mut image.report.passes));
            if frames.len() == count as usize {
                return Ok((image, frames));
            }
        }
    }
}

/// Divided into as few chunks as fit, by the images that were built before; or why they would not fit.
pub fn sized(settings: DeepImageSettings, built: &[Row]) -> Result<DeepImageSettings, CliError> {
    let Some(expected) = Expected::of(&settings, built) else { return Ok(settings) };
    let count = settings.directions.count();
    if expected.most_directions() < count {
        let gigabytes = expected.bytes_a_direction * count as f64 / 1e9;
        let hint = "choose a smaller number of texels";
        return Err(CliError::new(format_args!("{count} images would take {gigabytes:.1} GB"), hint));
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
        assert_eq!(sized(fine, &[]).unwrap(), fine);
        // Four times as many images with sixteen times as many texels, and two fragments per texel.
        let fits = sized(fine, &[built(48, 128, 50_000_000, 2 * 48 * 128 * 128)]).unwrap();
        assert_eq!(fits, DeepImageSettings { fragments_a_texel: 6, ..fine });
        let too_large = sized(fine, &[built(48, 128, 100_000_000, 1)]);
        assert_eq!(too_large.unwrap_err().what(), "192 images would take 6.4 GB");
    }
}
