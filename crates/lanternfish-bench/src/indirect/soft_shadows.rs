//! Soft shadows of lights with a size: the third row of table 1, and fig. 8 with its filter [Niessner2010, §7].

use lanternfish::{
    GpuScene, RenderedImage, Renderer,
    settings::{Settings, Shadows, Tracer},
};
use lanternfish_cli::{error::CliError, parse::Size, progress::Progress};
use lanternfish_metrics::{PIXELS_PER_DEGREE, Pair, RgbImage};

use super::{
    cases::{Brdf, ImageSet},
    gaussian::{RADIUS, filtered_shadows},
    measure::{Bench, Measured, sized},
    paper,
};
use crate::{
    image,
    run::{counter, frame_ms, least, ms_of},
    table::{DASH, Row},
    technique,
};

/// Radius of lights without a size of their own, over the diagonal of the scene's box.
const LIGHT_RADIUS: f32 = 0.03;
/// Rays of a pixel to each light [Niessner2010, §7].
const RAYS: u32 = 16;

/// What the table says.
pub fn text(converged_frames: u32) -> String {
    format!(
        "Direct light alone: {RAYS} rays a pixel to each light; lights without a size of their own have a radius of {LIGHT_RADIUS} of the \
         scene's diagonal. *And shaded* counts the pass that shades, too. *FLIP to BVH*: against the same rays through the BVH; *to many \
         rays*: against the mean of {converged_frames} such frames. *Filtered* is fig. 8: the image over the one without shadows, \
         through his Gaussian of 11 x 11 pixels, which does not stop at edges, on the processor, times the one without shadows; its time is \
         not in the frame's. He gives neither the Gaussian's width (here half its radius) nor where the filter stands. His rates: \
         million rays a second, on {}; his frames (fig. 8, two views, 384 images of 512²): 19.5 and 22.5 a second. Images: `soft-*.png`.",
        paper::MACHINE
    )
}

/// A tracer, and the images that it traverses.
type Through = (Tracer, Option<ImageSet>);

impl Bench<'_> {
    /// The rows: through the BVH, and through images of every resolution with every tracer of deep images.
    pub fn soft_shadows(
        &self,
        sets: &[ImageSet],
        measured: &mut Measured,
        progress: &mut Progress,
    ) -> Result<Vec<Row>, CliError> {
        let look = self
            .look
            .clone()
            .with_light_radius(LIGHT_RADIUS * self.source.bounds().size().length())
            .with_shadow_rays(RAYS)
            .with_materials(Brdf::Diffuse.materials())
            .with_indirect(technique::NO_INDIRECT);
        // Lights are uploaded with their radius.
        let scene = Renderer::with_engine(&self.run.engine, look.clone())?.upload(self.source)?;
        let unshadowed = self.soft_image(&scene, look.clone().with_shadows(Shadows::None))?;
        let many = progress.step("soft", "Soft shadows, many rays", || {
            self.soft_image(&scene, look.clone().with_accumulate(self.converged_frames))
        })?;
        let many = self.write_linear(image::linear(&many)?, "soft-many-rays.png")?;
        let coarse: Vec<Tracer> = Tracer::all().into_iter().filter(|tracer| !tracer.is_exact()).collect();
        let through_images = sets.iter().flat_map(|set| coarse.iter().map(|tracer| (*tracer, Some(*set))));
        let mut bvh = None;
        let mut rows = Vec::new();
        for through in [(Tracer::BVH, None)].into_iter().chain(through_images) {
            let words = words(through);
            let settings = match self.soft_settings(&look, through, &measured.images) {
                Ok(settings) => settings,
                Err(reason) => {
                    measured.leave_out(words, reason);
                    continue;
                }
            };
            let row = || self.soft_row((&scene, settings), through, (&unshadowed, &many), &mut bvh);
            match progress.step("soft", &words, row) {
                Ok(row) => rows.push(row),
                // Without the BVH's there is nothing to compare with.
                Err(error) if bvh.is_none() => return Err(error),
                Err(error) => measured.leave_out(words, error),
            }
        }
        Ok(rows)
    }

    fn soft_settings(&self, look: &Settings, (tracer, set): Through, built: &[Row]) -> Result<Settings, String> {
        let mut settings = look.clone().with_shadows(Shadows::Traced(tracer));
        if let Some(set) = set {
            settings.structure = sized(set.settings(), built)?.into();
        }
        Ok(settings)
    }

    fn soft_image(&self, scene: &GpuScene, settings: Settings) -> Result<RenderedImage, CliError> {
        let Size { width, height } = self.size;
        let mut renderer = Renderer::with_engine(&self.run.engine, settings)?;
        Ok(renderer.render(scene, self.camera, width, height)?)
    }

    /// A row and its two images. `bvh`: the BVH's image, which the first row is.
    fn soft_row(
        &self,
        (scene, settings): (&GpuScene, Settings),
        through: Through,
        (unshadowed, many): (&RenderedImage, &RgbImage),
        bvh: &mut Option<RgbImage>,
    ) -> Result<Row, CliError> {
        let Size { width, height } = self.size;
        let mut renderer = Renderer::with_engine(&self.run.engine, settings)?;
        let mut frame = || renderer.render(scene, self.camera, width, height);
        let frame = least(self.run.runs, &mut frame, |frame| frame_ms(&frame.report.passes))?.1;
        let rays = counter(&frame.report, "shadows/rays");
        let passes = &frame.report.passes;
        let (traced, shaded) = (ms_of(passes, "shadows/trace"), ms_of(passes, "shading/"));
        let rate = |ms: f64| rays as f64 / ms / 1e3;

        let (tracer, set) = through;
        let name = set.map_or_else(|| tracer.to_string(), |set| format!("{tracer}-{}", set.in_name()));
        let shadowed = image::linear(&frame)?;
        let pixels =
            filtered_shadows(&shadowed.pixels, &image::linear(unshadowed)?.pixels, width as usize, RADIUS as usize);
        let filtered = self.write_linear(RgbImage { pixels, ..shadowed }, &format!("soft-{name}-filtered.png"))?;
        let noisy = self.write_linear(shadowed, &format!("soft-{name}.png"))?;
        let to_bvh = bvh.as_ref().map_or(Ok(0.0), |bvh| flip(&noisy, bvh))?;
        let [to_many, filtered_to_many] = [flip(&noisy, many)?, flip(&filtered, many)?];
        bvh.get_or_insert(noisy);

        let resolution = set.map(|set| set.resolution);
        let his = set.and_then(|set| paper::soft_rate(set.resolution, set.directions()));
        Ok(Row::default()
            .text("tracer", "tracer", tracer.name())
            .optional("directions", "directions", set.map(ImageSet::directions))
            .optional("resolution", "texels", resolution)
            .said_as(resolution.map_or(DASH.to_owned(), |texels| format!("{texels}²")))
            .count("rays", "rays traced", rays)
            .fixed("frame_ms", "frame, ms", 1, frame_ms(passes))
            .fixed("rate_traced", "traced, M/s", 2, rate(traced))
            .fixed("rate_shaded", "and shaded, M/s", 2, rate(traced + shaded))
            .shown("Nießner, M/s", his.filter(|_| tracer.name() == "across-texels").unwrap_or(DASH))
            .fixed("flip", "FLIP to BVH", 4, to_bvh)
            .fixed("converged_flip", "to many rays", 4, to_many)
            .fixed("filtered_flip", "filtered, to many rays", 4, filtered_to_many))
    }
}

fn words((tracer, set): Through) -> String {
    set.map_or_else(|| tracer.to_string(), |set| format!("{tracer}, {}", set.in_words()))
}

fn flip(image: &RgbImage, reference: &RgbImage) -> Result<f64, CliError> {
    let pair = Pair::new(image.clone(), reference.clone())?;
    Ok(pair.mean_of(&pair.flip_ldr(PIXELS_PER_DEGREE)?))
}
