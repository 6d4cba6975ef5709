//! A frame of a view at rest against the path tracer with all bounces.

use lanternfish::{
    RenderedImage,
    settings::{History, Quality},
};
use lanternfish_cli::{error::CliError, progress::Progress};
use lanternfish_metrics::{ColorType, Pair, RgbImage, write_png};

use super::{Bench, Case, Cost, NONE, views, views::View, with};
use crate::{
    document::Document,
    ground_truths::{self, GroundTruth, GroundTruthFigures},
    image::{energy, energy_of, hdr_flip, linear, rgb, shown, write},
    table::Row,
    walked::Walked,
};

const TEXT: &str = "The last warm frame against the path tracer with all bounces. *Energy*: of indirect light alone, as a ratio to the path \
                    tracer's. *FLIP*: HDR-FLIP of the complete image; *p99.9*: of |difference| on a display, 0..1. *Flicker*: mean change of the \
                    display from one frame to the next, the view at rest. *none* and *one bounce* are controls: their loss must show. *mean* is the \
                    mean of 32 frames of *good* (--quick: 4), whose FLIP is what the reference's noise and its filter of pixels leave.";

/// Frames after the warm ones over which flicker is measured.
const FRAMES: u32 = 4;

/// A technique that loses light beyond the first bounce.
const ONE_BOUNCE: Case =
    Case { name: "good, one bounce", settings: |look| with(look, Quality::Good.sampled().one_bounce(), History::On) };
/// The mean of many frames: the least error that can be seen.
const MEAN: Case = Case { name: "good, mean", settings: |look| with(look, Quality::Good.sampled(), History::Off) };

/// The path tracer's image of a view.
struct Reference {
    image: RgbImage,
    /// Energy of its indirect light alone.
    indirect: f64,
    figures: GroundTruthFigures,
}

impl Bench {
    /// Adds the tables of errors at rest.
    pub fn right(&mut self, report: &mut Document, progress: &mut Progress) -> Result<(), CliError> {
        let (mut rows, mut references) = (Vec::new(), Vec::new());
        for view in self.views(views::RIGHT, 180)? {
            let reference = progress.step("reference", view.name, || self.reference_of(&view))?;
            let bytes = shown(&reference.image, view.look.image.exposure, view.look.image.tone_map).0;
            let path = self.path(&["right", view.name, "reference"]);
            write_png(&path, view.size.width, view.size.height, ColorType::Rgb, &bytes)?;
            let Reference { figures, indirect, .. } = &reference;
            let noise = figures.noise_energy * energy_of(&reference.image) / indirect;
            references.push(
                Row::default()
                    .text("scene", "", view.name)
                    .number("spp", "samples", figures.spp)
                    .percent("energy_noise", "energy of indirect light ±", 2, noise)
                    .fixed("halves_flip", "FLIP between halves", 4, figures.noise_hdr_flip)
                    .fixed("seconds", "s", 0, figures.seconds),
            );
            let [without, mean_without] = [1, self.mean_frames()]
                .map(|accumulate| self.first_frame(&view, ((NONE.settings)(&view.look)).with_accumulate(accumulate)));
            let [without, mean_without] = [energy(&without?), energy(&mean_without?)];
            for case in [&NONE, &ONE_BOUNCE, &MEAN].into_iter().chain(&self.cases) {
                let doing = format!("{}, {}", view.name, case.name);
                let without = if case.name == MEAN.name { mean_without } else { without };
                rows.push(progress.step("right", &doing, || self.error(&view, case, &reference, &bytes, without))?);
            }
        }
        report.section("At rest", TEXT, "right", rows);
        report.section("References", "", "references", references);
        Ok(())
    }

    /// Frames of the mean.
    fn mean_frames(&self) -> u32 {
        if self.is_quick { 4 } else { 32 }
    }

    fn reference_of(&self, view: &View) -> Result<Reference, CliError> {
        let View { name, scene, camera, look, size } = view;
        let file_name = name.replace(", ", "-").replace(' ', "-");
        let subject =
            ground_truths::Subject { name: &file_name, scene, camera, size: *size, settings: look, spp: self.spp };
        let traced = ground_truths::obtain(&self.run.folder, GroundTruth::Full, &subject)?;
        // The environment is part of the scene; the other one is not asked for.
        let part = |part: GroundTruth| part.scene(scene, &lanternfish_scene::generate::sky());
        let without =
            ground_truths::energy_without_indirect(&self.run.folder, GroundTruth::Full, &traced.mean, part, &subject)?;
        let indirect = energy_of(&traced.mean) * (1.0 - without.unwrap_or(0.0));
        if indirect <= 0.0 {
            return Err(CliError::new(format_args!("{name}: no indirect light"), "choose more samples with --spp"));
        }
        Ok(Reference { image: traced.mean, indirect, figures: traced.figures })
    }

    fn error(
        &self,
        view: &View,
        case: &Case,
        reference: &Reference,
        shown: &[u8],
        without: f64,
    ) -> Result<Row, CliError> {
        let settings = (case.settings)(&view.look);
        let frames = if case.name == MEAN.name {
            vec![self.first_frame(view, settings.with_accumulate(self.mean_frames()))?]
        } else if case.name == NONE.name {
            vec![self.first_frame(view, settings)?]
        } else {
            self.at_rest(view, settings, FRAMES)?
        };
        let image = &frames[0];
        write(&self.path(&["right", view.name, case.name]), image)?;
        let mut walked = Walked::default();
        frames.iter().for_each(|frame| walked.add(&rgb(frame), shown));
        let ms = frames.iter().map(|frame| Cost::of(frame).indirect_ms).fold(f64::INFINITY, f64::min);
        Ok(Row::default()
            .text("scene", "", view.name)
            .text("technique", "", case.name)
            .and(errors(image, without, &reference.image, reference.indirect)?)
            .fixed("p999", "p99.9", 3, walked.percentile(0.999))
            .fixed("flicker", "flicker", 5, walked.flicker())
            .fixed("indirect_ms", "indirect, ms", 1, ms))
    }
}

/// Energy of indirect light alone and FLIP of an image. `without`: the renderer's energy without indirect light.
fn errors(image: &RenderedImage, without: f64, reference: &RgbImage, indirect: f64) -> Result<Row, CliError> {
    let pair = Pair::new(linear(image)?, reference.clone())?;
    let ratio = (energy(image) - without) / indirect;
    Ok(Row::default().fixed("energy", "energy", 3, ratio).fixed("flip", "FLIP", 4, hdr_flip(&pair)?))
}

#[test]
fn lost_light_is_reported() {
    use crate::image::rendering;
    // Direct light of 1, indirect light of 0.5 in each of three channels of 64 pixels.
    let reference = RgbImage::new(64, 1, vec![[1.5; 3]; 64]).unwrap();
    let of = |indirect: f32| {
        let pixel = 1.0 + indirect;
        errors(&rendering(vec![[pixel, pixel, pixel, 1.0]; 64], 0), 192.0, &reference, 96.0).unwrap()
    };
    let [exact, dark] = [0.5, 0.4].map(of);
    assert_eq!((exact.f64("energy"), exact.f64("flip")), (1.0, 0.0));
    assert!((dark.f64("energy") - 0.8).abs() < 1e-6 && dark.f64("flip") > 0.001, "{dark:?}");
}
