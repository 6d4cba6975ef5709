//! A walk whose frames have references of their own, and flicker of static surfaces along it.

use lanternfish_cli::{
    error::CliError,
    images::{linear, rgb},
    timed::Timed,
};
use lanternfish_metrics::RgbImage;
use lanternfish_scene::Camera;

use super::{Cost, InMotion, restarts};
use crate::{
    bench::Stage,
    case::{Case, changed},
    ground_truths::GroundTruth,
    one_bounce::{
        self,
        walk::{Walk, grey},
    },
    reference::flip,
    table::Row,
    view::View,
    walked::{STEP, Walked, walk},
};

const TEXT: &str = "*FLIP*: mean and greatest HDR-FLIP of the frames that have a reference. *Error*: mean of their |difference| on a display, 0..1; \
                    *p99.9*: its 99.9th percentile over all pixels and frames. *Indirect*, *frame*: median times of the passes of indirect light \
                    and of all passes, ms: compare errors at equal time. Techniques without a history render only the frames with a reference. \
                    *none* has no indirect light. The images and the references are in the folder.";
/// Frames of the walk over which flicker is measured, at most.
const FLICKER_FRAMES: usize = 40;
/// A technique on a walk.
struct Walker {
    stage: Stage,
    walked: Walked,
    /// HDR-FLIP of the frames that have a reference.
    flips: Vec<f64>,
    /// Times of indirect light, and of the frames, ms.
    times: Vec<f64>,
    frames: Vec<f64>,
}

impl InMotion<'_> {
    /// Adds the tables of a walk.
    pub fn motion(&self) -> Result<(), CliError> {
        let Some(view) = self.view(270)? else { return Ok(()) };
        let references = match self.reference_rays {
            0 => format!("the path tracer's image, {} samples per pixel", self.spp),
            rays => format!(
                "a frame of {rays} diffuse and {} glossy rays a pixel, without filter and clamp, lit by a radiance cache of its own",
                rays.div_ceil(4)
            ),
        };
        let text = format!("{}, {} × {}. Reference: {references}.", view.name, view.size.width, view.size.height);
        self.bench.report().heading("In motion");
        self.bench.report().paragraph(text);
        let rows = self.walks(&view)?;
        self.bench.section("A walk", TEXT, "walk", rows);
        let rows = self.flicker(&view)?;
        let text = format!("The walk, at most {FLICKER_FRAMES} frames of it. {}", one_bounce::walk::TEXT);
        self.bench.section("Flicker along the walk", &text, "flicker", rows);
        Ok(())
    }

    /// The reference of a view, in radiance.
    pub fn reference(&self, view: &View) -> Result<RgbImage, CliError> {
        self.bench.step("motion references", &view.name, || match self.reference_rays {
            0 => Ok(view.reference(&self.bench, GroundTruth::Full, self.spp)?.mean),
            _ => Ok(linear(&self.bench.first_frame(view, &self.many_rays(&view.look))?)?),
        })
    }

    fn walks(&self, view: &View) -> Result<Vec<Row>, CliError> {
        let cases = self.with_none(view);
        let walker = |case: &Case| {
            let stage = self.bench.stage(&view.scene, &case.settings)?;
            Ok(Walker { stage, walked: Walked::default(), flips: Vec::new(), times: Vec::new(), frames: Vec::new() })
        };
        let mut walkers = cases.iter().map(walker).collect::<Result<Vec<_>, CliError>>()?;
        for (frame, camera) in self.cameras(view).into_iter().enumerate() {
            let view = View { camera, ..view.clone() };
            // Not the first: nothing has a history there.
            let is_compared = (frame as u32 + 1).is_multiple_of(self.every);
            let reference = is_compared.then(|| self.reference(&view)).transpose()?;
            let reference = reference.map(|image| (view.shown(&image), image));
            for (case, walker) in cases.iter().zip(&mut walkers) {
                let Walker { stage, walked, flips, times, frames } = walker;
                if reference.is_none() && restarts(stage) {
                    continue;
                }
                let image = self.bench.step("walk", &format!("frame {frame}"), || stage.frame(&view))?;
                let Cost { indirect_ms, frame_ms } = Cost::of(&image);
                times.push(indirect_ms);
                frames.push(frame_ms);
                if let Some((colors, reference)) = &reference {
                    walked.add(&rgb(&image), colors);
                    flips.push(flip(&image, reference)?);
                    self.bench.write(&format!("walk-{}-{frame:03}", case.name), &image)?;
                }
            }
            if let Some((_, reference)) = &reference {
                self.bench.write_linear(&format!("walk-reference-{frame:03}"), reference, &view.look)?;
            }
        }
        let row = |(case, Walker { walked, flips, times, frames, .. }): (&Case, Walker)| {
            Row::default()
                .text("technique", "", &case.name)
                .fixed("flip", "FLIP", 4, flips.iter().sum::<f64>() / flips.len().max(1) as f64)
                .fixed("flip_max", "greatest", 4, flips.iter().copied().fold(0.0, f64::max))
                .fixed("error", "error", 4, walked.mean())
                .fixed("p999", "p99.9", 3, walked.percentile(0.999))
                .fixed("indirect_ms", "indirect, ms", 1, Timed { runs: times }.median())
                .fixed("frame_ms", "frame, ms", 1, Timed { runs: frames }.median())
                .data("flips", flips)
        };
        Ok(cases.iter().zip(walkers).map(row).collect())
    }

    /// Views of the walk, one a frame.
    fn cameras(&self, view: &View) -> Vec<Camera> {
        (0..self.frames).map(|frame| walk(&view.camera, frame as f32 * STEP)).collect()
    }

    fn flicker(&self, view: &View) -> Result<Vec<Row>, CliError> {
        let mut cameras = self.cameras(view);
        cameras.truncate(FLICKER_FRAMES);
        let without = changed(&view.look, "indirect none, history off");
        let walk = self
            .bench
            .step("flicker", "without", || Walk::new(&self.bench, view.with(grey(&view.scene)), &cameras, &without))?;
        walk.rows(&self.cases(view))
    }
}
