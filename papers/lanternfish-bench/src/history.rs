//! `lanternfish-bench history`: indirect light along a camera path and after a change of light, with and without temporal accumulation.

use lanternfish::{RenderedImage, settings::Settings};
use lanternfish_cli::{error::CliError, times::frame_ms};
use lanternfish_scene::Scene;

use crate::{
    case::{Case, ONE_BOUNCE},
    ground_truths::GroundTruth,
    one_bounce::{OneBounce, OneBounceArgs},
    reference::flip,
    table::Row,
};

/// Number of frames before the change of light.
const BEFORE: u32 = 16;
/// Frames after the change that are compared, counted from 1.
const AFTER: [u32; 3] = [1, 4, 16];
/// Factor on the intensity of the scene's light, if it is the only one.
const DIMMED: f32 = 0.1;

const TEXT: &str = "The walk is the shot's track up to its middle, or one frame without a track. *After the change*: HDR-FLIP of each single \
                    frame against the path tracer's image of the new light, with the camera at rest, and the time of the frame, ms, of one \
                    run. The change turns the first light off, or dims it to 1/10 if it is the only one. The first frames after it take \
                    longer, because the radiance cache samples all its entries.";

/// Measures and writes the report.
pub fn run(args: &OneBounceArgs) -> Result<(), CliError> {
    let of = OneBounce::start(args, "history", "Temporal accumulation")?;
    let (bench, changed) = (&of.bench, of.lit.view.with(changed(&of.lit.view.scene)));
    let reference = bench.step("ground_truth", "Tracing the changed light", || {
        changed.reference(bench, GroundTruth::OneBounceFile, args.spp)
    })?;
    let requested = args.requested(cases(&of.lit.view.look, args.quick));
    let row = |Case { name, settings, .. }: &&Case| {
        let walked = of.walked(settings)?;
        let errors = of.keep(name, &walked)?;
        let images = of.after_change(settings, &changed.scene)?;
        let (mut flips, mut times, mut shown) = ([0.0; AFTER.len()], [0.0; AFTER.len()], Row::default());
        for (k, (image, after)) in images.iter().zip(AFTER).enumerate() {
            bench.write(&format!("{name}, {after} after the change"), image)?;
            (flips[k], times[k]) = (flip(image, &reference.mean)?, frame_ms(&image.report.passes));
            shown = shown.shown(&format!("after the change: frame {after}"), format_args!("{:.4}", flips[k]));
            shown = shown.shown("ms", format_args!("{:.0}", times[k]));
        }
        Ok::<_, CliError>(
            Row::default()
                .text("name", "", name)
                .number("frames", "frames", of.cameras.len() / 2 + 1)
                .fixed("frame_ms", "frame, ms", 1, frame_ms(&walked.report.passes))
                .and(errors.row("indirect_energy"))
                .data("after_change", flips)
                .data("after_change_ms", times)
                .and(shown),
        )
    };
    let rows = bench.rows("render", &requested, |case| case.name.clone(), row)?;
    bench.section("The last frame of a walk, and frames after a change of light", TEXT, "rows", rows);
    of.finish(&requested)
}

impl OneBounce {
    /// Renders the frames of the walk to the camera of the reference, and returns the last.
    fn walked(&self, settings: &Settings) -> Result<RenderedImage, CliError> {
        let (mut stage, mut view) = (self.bench.stage(&self.lit.view.scene, settings)?, self.lit.view.clone());
        for camera in &self.cameras[..self.cameras.len() / 2] {
            view.camera = camera.clone();
            stage.frame(&view)?;
        }
        Ok(stage.frame(&self.lit.view)?)
    }

    /// Renders [`BEFORE`] frames of the scene and then frames of `changed`, with the camera at rest. Returns those of [`AFTER`].
    fn after_change(&self, settings: &Settings, changed: &Scene) -> Result<Vec<RenderedImage>, CliError> {
        let mut stage = self.bench.stage(&self.lit.view.scene, settings)?;
        for _ in 0..BEFORE {
            stage.frame(&self.lit.view)?;
        }
        stage.update(changed)?;
        let mut images = Vec::new();
        for number in 1..=AFTER[2] {
            let image = stage.frame(&self.lit.view)?;
            images.extend(AFTER.contains(&number).then_some(image));
        }
        Ok(images)
    }
}

/// Techniques, by name and by their parameters.
const TECHNIQUES: [(&str, &str); 4] = [
    ("bvh, shaded", "history off"),
    ("bvh, cached", "hit-light cached"),
    ("bvh, shaded, half resolution", "indirect-resolution half"),
    ("within-texel, cached", "hit-light cached, indirect-tracer within-texel"),
];

/// Each technique, with and without temporal accumulation.
fn cases(look: &Settings, quick: bool) -> Vec<Case> {
    let techniques = TECHNIQUES.into_iter().take(if quick { 1 } else { usize::MAX });
    let both = techniques.flat_map(|technique| ["off", "on"].map(|history| (technique, history)));
    let case = |((name, changes), history)| {
        let changes = format!("{ONE_BOUNCE}, {changes}, history {history}");
        Case::of(look, &format!("{name}, history {history}"), &changes)
    };
    both.map(case).collect()
}

/// The scene without its first light, or with its only light dimmed.
fn changed(scene: &Scene) -> Scene {
    let mut changed = Scene { name: format!("{}, changed", scene.name), ..scene.clone() };
    match &mut changed.lights[..] {
        [only] => only.intensity *= DIMMED,
        _ => drop(changed.lights.remove(0)),
    }
    changed
}

#[test]
fn every_technique_is_there_with_and_without_a_history() {
    lanternfish_papers::register();
    let look = Settings::direct_light();
    let cases = cases(&look, false);
    assert_eq!((cases.len(), self::cases(&look, true).len()), (2 * TECHNIQUES.len(), 2));
    for (i, a) in cases.iter().enumerate() {
        assert!(cases[..i].iter().all(|b| a.name != b.name && a.settings != b.settings), "{}", a.name);
    }
}
