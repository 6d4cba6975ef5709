//! A walk whose frames have references of their own, and flicker of static surfaces along it.

use lanternfish::settings::History;
use lanternfish_cli::{error::CliError, progress::Progress};
use lanternfish_metrics::{Pair, RgbImage};
use lanternfish_scene::Camera;

use super::{Bench, Case, Cost, NONE, restarts, sheet::Sheet, views, views::View};
use crate::{
    document::Document,
    ground_truths::{self, GroundTruth},
    image::{hdr_flip, linear, rgb, shown, write},
    one_bounce::walk::{Walk, grey},
    run::median,
    table::Row,
    walked::{Walked, walk},
};

const TEXT: &str = "*FLIP*: mean and greatest HDR-FLIP of the frames that have a reference. *Error*: mean of their |difference| on a display, 0..1; \
                    *p99.9*: its 99.9th percentile over all pixels and frames. *Indirect*, *frame*: median times of the passes of indirect light \
                    and of all passes, ms: compare errors at equal time. Techniques without a history render only the frames with a reference. \
                    *none* has no indirect light. The images, and walk-sheet.png with a row for each technique and the references below, are in \
                    the folder.";
const FLICKER: &str = "The walk, at most 40 frames of it, past grey, diffuse, static surfaces. The image without indirect light is subtracted, so no \
                       reference is needed. Standard deviation of the indirect light of a surface point over the frames in which it is visible, and its mean change \
                       from frame to frame, both relative to its mean.";
/// Frames of the walk over which flicker is measured, at most.
const FLICKER_FRAMES: usize = 40;
/// Seconds of a frame.
pub const STEP: f32 = 1.0 / 30.0;

impl Bench {
    /// Adds the tables of a walk, of a light that goes out, and of an object that moves.
    pub fn motion(&mut self, report: &mut Document, progress: &mut Progress) -> Result<(), CliError> {
        let Some(view) = self.views(views::MOTION, 270)?.into_iter().next() else { return Ok(()) };
        let references = match self.reference_rays {
            0 => format!("the path tracer's image, {} samples per pixel", self.spp),
            rays => format!(
                "a frame of {rays} diffuse and {} glossy rays a pixel, without filter and clamp, lit by a radiance cache of its own",
                rays.div_ceil(4)
            ),
        };
        report.heading("In motion");
        report
            .paragraph(format!("{}, {} × {}. Reference: {references}.", view.name, view.size.width, view.size.height));
        let rows = self.walks(&view, progress)?;
        report.section("A walk", TEXT, "walk", rows);
        let rows = self.flicker(&view, progress)?;
        report.section("Flicker along the walk", FLICKER, "flicker", rows);
        self.changes(&view, report, progress)
    }

    /// The reference of a view, in radiance.
    pub fn reference(&self, view: &View, progress: &mut Progress) -> Result<RgbImage, CliError> {
        progress.step("motion references", view.name, || {
            if self.reference_rays > 0 {
                return Ok(linear(&self.first_frame(view, self.many_rays(&view.look))?)?);
            }
            let View { name, scene, camera, look: settings, size } = view;
            let subject = ground_truths::Subject { name, scene, camera, size: *size, settings, spp: self.spp };
            Ok(ground_truths::obtain(&self.run.folder, GroundTruth::Full, &subject)?.mean)
        })
    }

    fn walks(&self, view: &View, progress: &mut Progress) -> Result<Vec<Row>, CliError> {
        let cases: Vec<&Case> = [&NONE].into_iter().chain(&self.cases).collect();
        let mut walkers = Vec::new();
        for case in &cases {
            let renderer = self.renderer((case.settings)(&view.look))?;
            let uploaded = renderer.upload(&view.scene)?;
            walkers.push((renderer, uploaded, Walked::default(), Vec::new(), Vec::new(), Vec::new()));
        }
        let mut sheet = Sheet::new(view.size, cases.len() + 1);
        for (frame, camera) in self.cameras(view).iter().enumerate() {
            // Not the first: nothing has a history there.
            let reference = ((frame as u32 + 1).is_multiple_of(self.every))
                .then(|| self.reference(&View { camera: camera.clone(), ..view.clone() }, progress))
                .transpose()?;
            let colors =
                reference.as_ref().map(|image| shown(image, view.look.image.exposure, view.look.image.tone_map).0);
            let number = format!("{frame:03}");
            for (row, (case, walker)) in cases.iter().zip(&mut walkers).enumerate() {
                let (renderer, uploaded, walked, flips, times, frames) = walker;
                if reference.is_none() && restarts(renderer) {
                    continue;
                }
                let image = progress
                    .step("walk", &format!("frame {frame}"), || self.frame(renderer, uploaded, camera, view.size))?;
                let Cost { indirect_ms, frame_ms } = Cost::of(&image);
                times.push(indirect_ms);
                frames.push(frame_ms);
                if let (Some(reference), Some(colors)) = (&reference, &colors) {
                    let rgb = rgb(&image);
                    walked.add(&rgb, colors);
                    flips.push(hdr_flip(&Pair::new(linear(&image)?, reference.clone())?)?);
                    sheet.add(row, &rgb);
                    write(&self.path(&["walk", case.name, &number]), &image)?;
                }
            }
            if let Some(colors) = &colors {
                sheet.add(cases.len(), colors);
            }
        }
        sheet.write(&self.path(&["walk", "sheet"]))?;
        Ok(cases
            .iter()
            .zip(walkers)
            .map(|(case, (.., walked, flips, mut times, mut frames))| {
                Row::default()
                    .text("technique", "", case.name)
                    .fixed("flip", "FLIP", 4, flips.iter().sum::<f64>() / flips.len().max(1) as f64)
                    .fixed("flip_max", "greatest", 4, flips.iter().copied().fold(0.0, f64::max))
                    .fixed("error", "error", 4, walked.mean())
                    .fixed("p999", "p99.9", 3, walked.percentile(0.999))
                    .fixed("indirect_ms", "indirect, ms", 1, median(&mut times))
                    .fixed("frame_ms", "frame, ms", 1, median(&mut frames))
                    .data("flips", flips)
            })
            .collect())
    }

    /// Views of the walk, one a frame.
    fn cameras(&self, view: &View) -> Vec<Camera> {
        (0..self.frames).map(|frame| walk(&view.camera, frame as f32 * STEP)).collect()
    }

    fn flicker(&self, view: &View, progress: &mut Progress) -> Result<Vec<Row>, CliError> {
        let (scene, mut cameras) = (grey(&view.scene), self.cameras(view));
        cameras.truncate(FLICKER_FRAMES);
        let without = ((NONE.settings)(&view.look)).with_history(History::Off);
        let walk = progress
            .step("flicker", "without", || Walk::new(&self.run.engine, &scene, &cameras, view.size, &without))?;
        let of = |case: &Case| {
            let settings = (case.settings)(&view.look);
            Ok(progress.step("flicker", case.name, || walk.flicker(case.name, &settings))?.row())
        };
        self.cases.iter().map(of).collect()
    }
}
