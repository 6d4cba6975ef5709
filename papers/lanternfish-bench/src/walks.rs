//! `lanternfish-bench walks`: what a frame of a walk costs with every technique that a window may use, and how soon it
//! follows a lamp.

mod repeat;
mod rooms;
mod step_response;

use std::time::Instant;

use clap::Args;
use lanternfish::settings::{History, Preset, Settings, Shadows};
use lanternfish_cli::{
    error::CliError,
    parse::{self, Frames, Size},
    pass_costs::{columns, dispatches},
    replay::{
        measure::Player,
        plan::Plan,
        report::{ALL_PASSES, Report},
    },
    scene::SceneName,
};

use self::repeat::Repeat;
use crate::{
    bench::{Bench, RunArgs, is_requested},
    case::Case,
    document::{Document, LeftOut},
    table::Row,
    view::shot_of,
};

/// Flags of `walks`.
#[derive(Debug, Args)]
pub struct WalksArgs {
    /// A shot (.toml) with a table `track`.
    #[arg(default_value = "docs/tracks/atrium.toml")]
    scene: SceneName,
    #[command(flatten)]
    run: RunArgs,
    /// Size of the frames.
    #[arg(long, value_name = "WxH", default_value = "1920x1080", value_parser = parse::size)]
    size: Size,
    /// Number of frames of a walk; those of `good` are a quarter of it.
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,
    /// Measures only walks whose name contains this text. Repeatable.
    #[arg(long, value_name = "TEXT")]
    only: Vec<String>,
}

/// Passes of a walk on the page.
const MOST_PASSES: usize = 15;

/// All walks, with what the shot says of exposure and materials, and the fraction of the frames as a divisor: frames of
/// `good` take long.
fn walks(look: &Settings) -> Vec<(Case, u32)> {
    let walk = |name: &str, preset: Option<Preset>, changes: &str, divisor| {
        let settings = preset.map_or_else(Settings::direct_light, Settings::of_preset);
        let (exposure, materials) = (look.image.exposure, look.materials.model);
        let settings = settings.with_shadows(Shadows::Auto).with_exposure(exposure).with_materials(materials);
        (Case::of(&settings, name, changes), divisor)
    };
    vec![
        walk("direct all", None, "indirect none", 1),
        walk("direct sampled", None, "indirect none, direct sampled", 1),
        walk("draft, direct all", Some(Preset::Draft), "history on", 1),
        walk("draft, direct sampled", Some(Preset::Draft), "history on, direct sampled", 1),
        walk("realtime", Some(Preset::Realtime), "", 1),
        walk("good, 1 sample", Some(Preset::Good), "samples 1", 4),
        walk("good, 4 samples", Some(Preset::Good), "samples 4", 4),
    ]
}

/// True if a walk ends in time after so many seconds of at `most`, if it and the repetition after it take as long as
/// the `longest`.
fn is_in_time(seconds: f64, longest: f64, most: Option<f64>) -> bool {
    most.is_none_or(|most| seconds + 2.0 * longest <= most)
}

/// Measures and writes the report.
pub fn run(args: &WalksArgs) -> Result<(), CliError> {
    let started = Instant::now();
    let hint = "name a shot (.toml) with a [track]";
    let mut shot = shot_of(&args.scene)?.ok_or_else(|| CliError::new("walks need a shot", hint))?;
    shot.args.track.frames = Some(Frames::Count(args.frames));
    shot.args.output.size = args.size;
    let bench = Bench::start(&args.run, "walks", "Walks", Some(&args.scene))?;
    let mut plan = bench.with_progress(|progress| Plan::of(&shot, None, progress))?;
    let mut wanted = walks(&plan.settings);
    wanted.retain(|(walk, _)| is_requested(&args.only, &walk.name));
    let first = wanted.first().ok_or_else(|| CliError::new("no walk has such a name", "leave out --only"))?;
    plan.settings = first.0.settings.clone();
    let mut player = bench.with_progress(|progress| Player::new(&bench.gpu, plan, progress))?;
    let mut measured = |(walk, divisor): &(Case, u32)| {
        player.limit((args.frames / divisor) as usize);
        player.set(&walk.settings, None, args.size)?;
        let mut report = player.report(&walk.name, args.scene.to_string(), bench.runs as usize, 0);
        bench.with_progress(|progress| player.measure(&mut report, progress))?;
        Ok::<_, CliError>(report)
    };
    let mut results =
        Results { args, bench: &bench, walks: Vec::new(), left_out: Vec::new(), repeat: None, steps: Vec::new() };
    let mut longest = 0.0_f64;
    for walk in &wanted {
        let began = started.elapsed().as_secs_f64();
        let what = walk.0.name.clone();
        if !is_in_time(began, longest, args.run.seconds) {
            results.left_out.push(LeftOut { what, reason: "no time left".to_owned() });
            continue;
        }
        match measured(walk) {
            Ok(report) => results.walks.push((what, report)),
            Err(error) => results.left_out.push(LeftOut { what, reason: error.to_string() }),
        }
        results.write()?;
        longest = longest.max(started.elapsed().as_secs_f64() - began);
    }
    let again = measured(first)?;
    if let Some((name, report)) = results.walks.first().filter(|(name, _)| *name == first.0.name) {
        results.repeat = Some(Repeat::new(name.clone(), ms_of(report), ms_of(&again)));
    }
    for (walk, _) in wanted.iter().filter(|(walk, _)| walk.settings.history == History::On) {
        let what = format!("step response: {}", walk.name);
        match is_in_time(started.elapsed().as_secs_f64(), longest, args.run.seconds) {
            true => results.steps.push(bench.step("step_response", &what, || step_response::row(&bench, walk))?),
            false => results.left_out.push(LeftOut { what, reason: "no time left".to_owned() }),
        }
    }
    bench.end_progress();
    results.document().write(&bench.folder)
}

/// Expected time of a frame, ms: of its passes, or of the host on a device without timestamps.
fn ms_of(report: &Report) -> f64 {
    let estimates = &report.estimates;
    estimates.get(ALL_PASSES).or_else(|| estimates.get("host/frame")).map_or(f64::NAN, |estimate| estimate.ms)
}

/// The walks so far.
struct Results<'r> {
    args: &'r WalksArgs,
    bench: &'r Bench,
    walks: Vec<(String, Report)>,
    left_out: Vec<LeftOut>,
    repeat: Option<Repeat>,
    steps: Vec<Row>,
}

impl Results<'_> {
    /// Writes what there is.
    fn write(&self) -> Result<(), CliError> {
        self.document().store(&self.bench.folder, "report")
    }

    fn document(&self) -> Document {
        let WalksArgs { scene, size, frames, .. } = self.args;
        let Size { width, height } = *size;
        let mut page = Document::of_scene("Walks", scene, &self.bench.gpu, self.bench.runs);
        let has_validation = lanternfish_gpu::instance_flags().contains(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
        page.facts(Row::default().data("width", width).data("height", height).data("frames", frames));
        page.facts(Row::default().data("validates_indirect_calls", has_validation));
        let lights = self.walks.first().map_or(0, |(_, report)| report.lights);
        let validation = if has_validation { "validates indirect calls" } else { "does not validate indirect calls" };
        page.introduction(
            &format!("{scene}, {width} × {height}, {lights} lights, {frames} frames; wgpu {validation}"),
            "median over runs of the mean over frames, each run after 1.5 s of warm-up on a graphics card",
        );
        let text = "Idle is the host's frame without its passes. Dispatches are those of the last frame.";
        page.section("A frame of each walk", text, "walks", self.walks.iter().map(row).collect());
        if let Some(repeat) = &self.repeat {
            page.paragraph(format!("The first walk, measured again at the end: {}.", repeat.text()));
            page.keep_data("repeat", repeat);
        }
        page.section("A lamp goes out and on again", step_response::TEXT, "step_response", self.steps.clone());
        for (name, report) in &self.walks {
            page.heading(name);
            let clocks = report.clocks.join(" → ");
            if !clocks.is_empty() {
                page.paragraph(format!("Clocks, run by run: {clocks}."));
            }
            page.show(passes(report).into_iter().take(MOST_PASSES));
        }
        let all = |(name, report): &(String, Report)| Row::default().data("name", name).data("passes", passes(report));
        page.keep("passes", self.walks.iter().map(all).collect());
        page.left_out(&self.left_out);
        page
    }
}

/// The row of a walk.
fn row((name, report): &(String, Report)) -> Row {
    let ms = |name: &str| report.estimates.get(name).map_or(f64::NAN, |estimate| estimate.ms);
    let (frame, device) = report.memory.unwrap_or_default();
    let mib = |bytes: u64| (bytes as f64 / f64::from(1 << 20)).round();
    let all: u32 = report.costs.iter().map(|cost| cost.dispatches).sum();
    let indirect: u32 = report.costs.iter().map(|cost| cost.indirect).sum();
    Row::default()
        .text("name", "walk", name)
        .fixed("passes_ms", "passes, ms", 2, ms(ALL_PASSES))
        .fixed("host_ms", "host, ms", 2, ms("host/frame"))
        .fixed("record_ms", "record, ms", 2, ms("host/record"))
        .fixed("idle_ms", "idle, ms", 2, report.idle_ms().unwrap_or(f64::NAN))
        .number("dispatches", "dispatches", all)
        .said_as(dispatches(report.costs.iter()))
        .data("indirect", indirect)
        .number("frame_mib", "frames, MiB", mib(frame))
        .optional("device_mib", "device, MiB", device.map(mib))
        .data("clocks", &report.clocks)
}

/// The rows of a walk's passes, the longest first.
fn passes(report: &Report) -> Vec<Row> {
    let ms = |name: &str| report.estimates.get(name).map_or(0.0, |estimate| estimate.ms);
    let mut costs: Vec<_> = report.costs.iter().map(|cost| (cost, ms(&cost.name))).collect();
    costs.sort_by(|a, b| b.1.total_cmp(&a.1));
    let row = |(cost, ms): (&lanternfish_cli::pass_costs::PassCost, f64)| {
        let [dispatched, rays, rate] = columns(Some(cost), ms);
        Row::default()
            .text("name", "pass", &cost.name)
            .fixed("ms", "ms", 3, ms)
            .number("dispatches", "dispatches", cost.dispatches)
            .said_as(dispatched)
            .data("indirect", cost.indirect)
            .number("rays", "rays", cost.rays.unwrap_or(0))
            .said_as(rays)
            .shown("Mrays/s", rate)
    };
    costs.into_iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use lanternfish::{settings::Samples, techniques::SampledLights};

    use super::*;

    #[test]
    fn every_technique_of_a_window_is_walked() {
        let walks = walks(&Settings::default());
        let count = |is: fn(&Settings) -> bool| walks.iter().filter(|(walk, _)| is(&walk.settings)).count();
        assert_eq!((walks.len(), count(|settings| settings.direct.is::<SampledLights>())), (7, 4));
        assert_eq!(count(|settings| settings.indirect.is_none()), 2);
        assert_eq!(count(|settings| settings.image.samples == Samples::Four), 1, "only good has them");
    }

    #[test]
    fn walks_beyond_the_deadline_are_left_out() {
        assert!(is_in_time(1e6, 1e6, None) && is_in_time(10.0, 20.0, Some(50.0)));
        assert!(!is_in_time(10.1, 20.0, Some(50.0)));
    }
}
