//! Soft shadows of lights with a size: the third row of table 1, and fig. 8 with its filter [Niessner2010, §7].

use lanternfish::{
    GpuScene,
    settings::{Settings, Shadows, Tracer},
};
use lanternfish_cli::{
    error::CliError,
    images::linear,
    times::{counter, frame_ms, ms_of},
};
use lanternfish_metrics::{PIXELS_PER_DEGREE, Pair, RgbImage};

use super::{
    cases::{Brdf, ImageSet},
    gaussian::{RADIUS, filtered_shadows},
    measure::{RayBench, sized},
};
use crate::{
    case::changed,
    table::{DASH, Row},
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
         not in the frame's. He gives neither the Gaussian's width (here half its radius) nor where the filter stands. His frames (fig. 8, two views, 384 images of 512²): 19.5 and 22.5 a second. Images: `soft-*.png`."
    )
}

/// A tracer, and the images that it traverses.
type Through = (Tracer, Option<ImageSet>);

/// What images of soft shadows are compared with: the image without shadows, and the displayed mean of many frames.
struct Beside {
    unshadowed: RgbImage,
    many: RgbImage,
}

impl RayBench {
    /// The rows: through the BVH, and through images of every resolution with every tracer of deep images.
    pub fn soft_shadows(&self, sets: &[ImageSet], built: &[Row]) -> Result<Vec<Row>, CliError> {
        let (bench, view) = (&self.bench, &self.view);
        let look = changed(&view.look, &format!("indirect none, shadow-rays {RAYS}"))
            .with_light_radius(LIGHT_RADIUS * view.scene.bounds().size().length())
            .with_materials(Brdf::Diffuse.materials());
        // Lights are uploaded with their radius.
        let scene = bench.upload(&view.scene, &look)?;
        let unshadowed = linear(&bench.first_frame(view, &changed(&look, "shadows none"))?)?;
        let many = bench.step("soft", "Soft shadows, many rays", || bench.mean(view, &look, self.converged_frames))?;
        let many = bench.write_linear("soft-many-rays", &linear(&many)?, &view.look)?;
        let beside = Beside { unshadowed, many };
        let coarse: Vec<Tracer> = Tracer::all().into_iter().filter(|tracer| !tracer.is_exact()).collect();
        let through_images = sets.iter().flat_map(|set| coarse.iter().map(|tracer| (*tracer, Some(*set))));
        let (mut bvh, mut rows) = (None, Vec::new());
        for through in [(Tracer::BVH, None)].into_iter().chain(through_images) {
            let words = words(through);
            if bvh.is_some() && !bench.has_time(&words) {
                continue;
            }
            let row = || {
                let mut settings = look.clone().with_shadows(Shadows::Traced(through.0));
                if let Some(set) = through.1 {
                    settings.structure = sized(set.settings(), built)?.into();
                }
                let settings = bench.made(&words, &settings);
                self.soft_row(&scene, &settings, through, &beside, &mut bvh)
            };
            match bench.step("soft", &words, row) {
                Ok(row) => rows.push(row),
                // Without the BVH's there is nothing to compare with.
                Err(error) if bvh.is_none() => return Err(error),
                Err(error) => bench.leave_out(words, error),
            }
        }
        Ok(rows)
    }

    /// A row and its two images. `bvh`: the BVH's image, which the first row is.
    fn soft_row(
        &self,
        scene: &GpuScene,
        settings: &Settings,
        (tracer, set): Through,
        Beside { unshadowed, many }: &Beside,
        bvh: &mut Option<RgbImage>,
    ) -> Result<Row, CliError> {
        let frame = self.fastest(scene, settings)?;
        let (rays, passes) = (counter(&frame.report, "shadows/rays"), &frame.report.passes);
        let (traced, shaded) = (ms_of(passes, "shadows/trace"), ms_of(passes, "shading/"));
        let rate = |ms: f64| rays as f64 / ms / 1e3;

        let name = set.map_or_else(|| tracer.to_string(), |set| format!("{tracer}-{}", set.in_name()));
        let shadowed = linear(&frame)?;
        let pixels = filtered_shadows(&shadowed.pixels, &unshadowed.pixels, shadowed.width, RADIUS as usize);
        let write = |name: String, image: &RgbImage| self.bench.write_linear(&name, image, &self.view.look);
        let filtered = write(format!("soft-{name}-filtered"), &RgbImage { pixels, ..shadowed })?;
        let noisy = write(format!("soft-{name}"), &shadowed)?;
        let to_bvh = bvh.as_ref().map_or(Ok(0.0), |bvh| flip(&noisy, bvh))?;
        let [to_many, filtered_to_many] = [flip(&noisy, many)?, flip(&filtered, many)?];
        bvh.get_or_insert(noisy);

        let resolution = set.map(|set| set.resolution);
        Ok(Row::default()
            .text("tracer", "tracer", tracer.name())
            .optional("directions", "directions", set.map(ImageSet::directions))
            .optional("resolution", "texels", resolution)
            .said_as(resolution.map_or(DASH.to_owned(), |texels| format!("{texels}²")))
            .count("rays", "rays traced", rays)
            .fixed("frame_ms", "frame, ms", 1, frame_ms(passes))
            .fixed("rate_traced", "traced, M/s", 2, rate(traced))
            .fixed("rate_shaded", "and shaded, M/s", 2, rate(traced + shaded))
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
