//! `lanternfish-bench history`: indirect light along a camera path and after a change of light, with and without temporal accumulation.

use lanternfish::{
    settings::{History, Settings},
    techniques::{HitLight, IndirectResolution, Sampled},
};
use lanternfish_cli::{error::CliError, progress::Progress};
use lanternfish_papers::WITHIN_TEXEL;
use lanternfish_scene::Scene;

use crate::{
    ground_truths::GroundTruth,
    one_bounce::{Bench, Case, OneBounceArgs},
    run::frame_ms,
    table::Row,
    technique,
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
    let mut progress = Progress::start(false);
    let mut bench = Bench::start(args, "history", "Temporal accumulation", &mut progress)?;
    let changed = changed(&bench.scene);
    let changed_ground_truth = progress.step("ground_truth", "Tracing the changed light", || {
        bench.ground_truth_of(GroundTruth::OneBounceFile, &changed)
    })?;
    let requested: Vec<Case> = cases(&bench.look, args.quick).into_iter().filter(|c| args.requests(&c.name)).collect();
    let mut rows = Vec::new();
    for Case { name, settings } in &requested {
        let row = || {
            let walked = bench.walked(settings)?;
            let errors = bench.keep(name, &walked)?;
            let renderings = bench.after_change(settings, BEFORE, &changed, &AFTER)?;
            let (mut flips, mut times, mut shown) = ([0.0; AFTER.len()], [0.0; AFTER.len()], Row::default());
            for (k, (rendering, after)) in renderings.iter().zip(AFTER).enumerate() {
                bench.keep(&format!("{name}, {after} after the change"), rendering)?;
                flips[k] = bench.against(rendering, &changed_ground_truth)?.0;
                times[k] = frame_ms(&rendering.report.passes);
                shown = shown.shown(&format!("after the change: frame {after}"), format_args!("{:.4}", flips[k]));
                shown = shown.shown("ms", format_args!("{:.0}", times[k]));
            }
            Ok::<_, CliError>(
                Row::default()
                    .text("name", "", name)
                    .number("frames", "frames", bench.steps())
                    .fixed("frame_ms", "frame, ms", 1, frame_ms(&walked.report.passes))
                    .and(errors.row())
                    .data("after_change", flips)
                    .data("after_change_ms", times)
                    .and(shown),
            )
        };
        rows.push(progress.step("render", name, row)?);
    }
    bench.report.section("The last frame of a walk, and frames after a change of light", TEXT, "rows", rows);
    bench.finish(&requested, progress)
}

/// Each technique, with and without temporal accumulation.
fn cases(look: &Settings, quick: bool) -> Vec<Case> {
    let shaded = Sampled::default().one_bounce();
    let cached = Sampled { hit_light: HitLight::Cached, ..shaded };
    let techniques = [
        ("bvh, shaded", shaded),
        ("bvh, cached", cached),
        ("bvh, shaded, half resolution", Sampled { resolution: IndirectResolution::Half, ..shaded }),
        ("within-texel, cached", Sampled { tracer: WITHIN_TEXEL.into(), ..cached }),
    ];
    let techniques = techniques.into_iter().take(if quick { 1 } else { usize::MAX });
    let with_history =
        techniques.flat_map(|(name, rays)| History::ALL.iter().map(move |history| (name, rays, *history)));
    let case = |(name, rays, history): (&str, Sampled, History)| Case {
        name: format!("{name}, history {history}"),
        settings: look.clone().with_indirect(technique::sampled(rays)).with_history(history),
    };
    with_history.map(case).collect()
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
