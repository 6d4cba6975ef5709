//! `lanternfish-bench history`: indirect light while the camera walks and after a light changes, with what pixels keep from frame to frame
//! and without.

use std::fmt::Write;

use lanternfish::settings::{History, HitLight, Indirect, IndirectResolution, Sampled, Settings, Tracer};
use lanternfish_scene::Scene;
use serde::Serialize;

use super::{
    one_bounce::{Bench, Configuration, Errors, Flicker, Heading, OneBounceArgs, flicker_table, frame_ms, heading},
    quality::truths::Truth,
};
use lanternfish_cli::{error::CliError, progress::Progress};

/// Frames before the change of a light.
const BEFORE: u32 = 16;
/// Frames after it that are looked at.
const AFTER: [u32; 3] = [1, 4, 16];
/// Part of its intensity that a light keeps which is the scene's only one.
const DIMMED: f32 = 0.1;

/// Everything the bench found.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    heading: Heading,
    rows: Vec<Row>,
    flicker: Vec<Flicker>,
}

#[derive(Debug, Serialize)]
struct Row {
    name: String,
    /// Frames of the walk.
    frames: usize,
    /// Device milliseconds of the walk's last frame, deep images left aside.
    frame_ms: f64,
    /// Of that frame.
    #[serde(flatten)]
    errors: Errors,
    /// HDR-FLIP to the new truth, so many frames after a light has changed.
    after_change: [f64; AFTER.len()],
    /// Device milliseconds of those frames, deep images left aside.
    after_change_ms: [f64; AFTER.len()],
}

pub fn run(args: &OneBounceArgs) -> Result<(), CliError> {
    let mut progress = Progress::start(false);
    let bench = Bench::start(args, "history", &mut progress)?;
    let changed = changed(&bench.scene);
    let changed_truth =
        progress.step("truth", "Tracing the changed light", || bench.truth_of(Truth::OneBounceFile, &changed))?;
    let asked: Vec<Configuration> =
        configurations(&bench.look, args.quick).into_iter().filter(|c| args.asks_for(&c.name)).collect();
    let mut rows = Vec::new();
    for configuration in &asked {
        let Configuration { name, settings, .. } = configuration;
        rows.push(progress.step("render", name, || {
            let walked = bench.walked(settings)?;
            let errors = bench.keep(name, &walked)?;
            let mut after_change = [0.0; AFTER.len()];
            let pictures = bench.after_change(settings, BEFORE, &changed, &AFTER)?;
            let mut after_change_ms = [0.0; AFTER.len()];
            for (k, (picture, after)) in pictures.iter().zip(AFTER).enumerate() {
                bench.keep(&format!("{name}, {after} after the change"), picture)?;
                after_change[k] = bench.against(picture, &changed_truth)?.0;
                after_change_ms[k] = frame_ms(&picture.report.passes);
            }
            let frame_ms = frame_ms(&walked.report.passes);
            Ok::<_, CliError>(Row {
                name: name.clone(),
                frames: bench.steps(),
                frame_ms,
                errors,
                after_change,
                after_change_ms,
            })
        })?);
    }
    let flicker = bench.flicker(&asked, &mut progress)?;
    progress.finish();
    let report = Report { heading: bench.heading.clone(), rows, flicker };
    bench.write(&report, &to_markdown(&report))
}

/// Each way with what pixels keep and without.
fn configurations(look: &Settings, quick: bool) -> Vec<Configuration> {
    let shaded = Sampled::default().one_bounce();
    let cached = Sampled { hit_light: HitLight::Cached, ..shaded };
    let ways = [
        ("bvh, shaded", shaded),
        ("bvh, cached", cached),
        ("bvh, shaded, half resolution", Sampled { resolution: IndirectResolution::Half, ..shaded }),
        ("within-texel, cached", Sampled { tracer: Tracer::WithinTexel.into(), ..cached }),
    ];
    let ways = ways.into_iter().take(if quick { 1 } else { usize::MAX });
    let with_history = ways.flat_map(|(name, rays)| History::ALL.iter().map(move |history| (name, rays, *history)));
    let configuration = |(name, rays, history): (&str, Sampled, History)| Configuration {
        name: format!("{name}, history {history}"),
        settings: Settings { indirect: Indirect::Sampled(rays), history, ..look.clone() },
        has_steps: false,
    };
    with_history.map(configuration).collect()
}

/// The scene without its first light; the only one is dimmed.
fn changed(scene: &Scene) -> Scene {
    let mut changed = Scene { name: format!("{}, changed", scene.name), ..scene.clone() };
    match &mut changed.lights[..] {
        [only] => only.intensity *= DIMMED,
        _ => drop(changed.lights.remove(0)),
    }
    changed
}

fn to_markdown(report: &Report) -> String {
    let mut page = format!("# Frames after frames: {}\n\n{}", report.heading.scene, heading(&report.heading));
    page += "\n## The last frame of a walk, and frames after a change of light\n\n\
             The walk is the shot's track up to its middle; without a track it is one frame. *Energy*: of indirect light alone, over the \
             path tracer's one bounce. *FLIP*: HDR-FLIP of the whole picture. *After the change*: HDR-FLIP to the path tracer's picture \
             of the new light, the camera at rest and each frame by itself; the first light is off, or dimmed to a tenth where it is \
             the only one; and the ms of these frames, of one run each: in the first, and a little less for some more, the radiance cache samples all its cells.\n\n\
             | | frames | frame, ms | energy | FLIP | after the change: frame 1 | frame 4 | frame 16 | ms: 1 | 4 | 16 |\n\
             |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    for Row {
        name,
        frames,
        frame_ms,
        errors,
        after_change: [first, fourth, last],
        after_change_ms: [ms1, ms4, ms16],
    } in &report.rows
    {
        let Errors { indirect_energy, flip } = errors;
        writeln!(
            page,
            "| {name} | {frames} | {frame_ms:.1} | {indirect_energy:.3} | {flip:.4} | {first:.4} | {fourth:.4} | {last:.4} | {ms1:.0} | {ms4:.0} | \
             {ms16:.0} |"
        )
        .expect("String");
    }
    if !report.flicker.is_empty() {
        page += &flicker_table(&report.flicker);
    }
    page
}
