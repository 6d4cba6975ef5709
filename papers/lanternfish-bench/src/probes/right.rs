//! A frame of a view at rest against the path tracer with all bounces.

use lanternfish_cli::{
    error::CliError,
    images::{energy, energy_of, rgb},
};

use super::{Cost, InMotion, NONE, case, views};
use crate::{
    bench::file_name,
    case::{Case, ONE_BOUNCE},
    ground_truths::{self, GroundTruth, GroundTruthFigures},
    reference::Reference,
    table::Row,
    view::View,
    walked::Walked,
};

const TEXT: &str = "The last warm frame against the path tracer with all bounces. *Energy*: of indirect light alone, as a ratio to the path \
                    tracer's. *FLIP*: HDR-FLIP of the complete image; *p99.9*: of |difference| on a display, 0..1. *Flicker*: mean change of the \
                    display from one frame to the next, the view at rest. *none* and *one bounce* are controls: their loss must show. *mean* is the \
                    mean of 32 frames of *good* (--quick: 4), whose FLIP is what the reference's noise and its filter of pixels leave.";

/// Frames after the warm ones over which flicker is measured.
const FRAMES: u32 = 4;

/// A technique that loses light beyond the first bounce; and the mean of many frames: the least error that can be seen.
const ONE: &str = "good, one bounce";
const MEAN: &str = "good, mean";

impl InMotion<'_> {
    /// Adds the tables of errors at rest.
    pub fn right(&self) -> Result<(), CliError> {
        let (bench, mut rows, mut references) = (&self.bench, Vec::new(), Vec::new());
        let mean_frames = if self.args.quick { 4 } else { 32 };
        for view in self.views(views::RIGHT, 180)? {
            let (reference, figures) = bench.step("reference", &view.name, || self.reference_of(&view))?;
            let shown = view.shown(&reference.image);
            bench.write_linear(&format!("right-{}-reference", view.name), &reference.image, &view.look)?;
            references.push(
                Row::default()
                    .text("scene", "", &view.name)
                    .number("spp", "samples", figures.spp)
                    .percent("energy_noise", "energy of indirect light ±", 2, reference.noise(figures.noise_energy))
                    .fixed("halves_flip", "FLIP between halves", 4, figures.noise_hdr_flip)
                    .fixed("seconds", "s", 0, figures.seconds),
            );
            let none = case(&view.look, NONE);
            let without = [1, mean_frames].map(|frames| bench.mean(&view, &none.settings, frames));
            let [without, mean_without] = without;
            let [without, mean_without] = [energy(&without?), energy(&mean_without?)];
            let one = Case::of(&case(&view.look, "good, history").settings, ONE, ONE_BOUNCE);
            let mean = Case::of(&case(&view.look, "good").settings, MEAN, &format!("accumulate {mean_frames}"));
            let row = |Case { name, settings, .. }: &Case| {
                let is_one = name == NONE || name == MEAN;
                let frames = match is_one {
                    true => vec![bench.first_frame(&view, settings)?],
                    false => self.at_rest(&view, settings, FRAMES)?,
                };
                bench.write(&format!("right-{}-{name}", view.name), &frames[0])?;
                let mut walked = Walked::default();
                frames.iter().for_each(|frame| walked.add(&rgb(frame), &shown));
                let ms = frames.iter().map(|frame| Cost::of(frame).indirect_ms).fold(f64::INFINITY, f64::min);
                let without = if name == MEAN { mean_without } else { without };
                Ok::<_, CliError>(
                    Row::default()
                        .text("scene", "", &view.name)
                        .text("technique", "", name)
                        .and(reference.errors(&frames[0], without)?.row("energy"))
                        .fixed("p999", "p99.9", 3, walked.percentile(0.999))
                        .fixed("flicker", "flicker", 5, walked.flicker())
                        .fixed("indirect_ms", "indirect, ms", 1, ms),
                )
            };
            let cases = [none, one, mean].into_iter().chain(self.cases(&view));
            rows.extend(bench.rows("right", cases, |case| format!("{}, {}", view.name, case.name), row)?);
        }
        bench.section("At rest", TEXT, "right", rows);
        bench.section("References", "", "references", references);
        Ok(())
    }

    fn reference_of(&self, view: &View) -> Result<(Reference, GroundTruthFigures), CliError> {
        let view = View { name: file_name(&view.name), ..view.clone() };
        let traced = view.reference(&self.bench, GroundTruth::Full, self.spp)?;
        // The environment is part of the scene; the other one is not requested.
        let part = |part: GroundTruth| part.scene(&view.scene, &lanternfish_scene::generate::sky());
        let (folder, subject) = (&self.bench.folder, view.subject(self.spp));
        let without = ground_truths::energy_without_indirect(folder, GroundTruth::Full, &traced.mean, part, &subject)?;
        let direct = without.unwrap_or(0.0) * energy_of(&traced.mean);
        Ok((Reference::new(traced.mean, direct, "choose more samples with --spp")?, traced.figures))
    }
}
