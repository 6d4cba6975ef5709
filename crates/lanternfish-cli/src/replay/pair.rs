//! Two variants of a replay in turn, `--pair A B`. Each is first in every other pair of runs, so that both meet the
//! same disturbances.

use std::path::Path;

use clap::{ArgMatches, Args as _, Command};
use lanternfish_gpu::{Engine, Gpu, ShaderTexts};

use super::{Cameras, ReplayArgs, SimulationArgs, measure, plan::Plan, report::ALL_PASSES, series::Series, simulation};
use crate::{args, error::CliError, output, progress::Progress, shaders, shot, timed::median_ranks};

/// Times both variants and prints the ratios of their times.
pub fn run(args: &ReplayArgs, matches: &ArgMatches) -> Result<(), CliError> {
    let variants = args.pair.iter().map(|words| variant(args, matches, words)).collect::<Result<Vec<_>, _>>()?;
    let mut progress = Progress::start(variants[0].0.args.run.quiet);
    let (mut devices, mut plans, mut players) = (Vec::new(), Vec::new(), Vec::new());
    for (shot, recorded, texts) in variants {
        let gpu = Gpu::open(&shot.args.run.adapter.clone().unwrap_or_default())?;
        let engine = Engine::new(&gpu.device, &gpu.queue);
        lanternfish::shaders::edit(&engine, texts);
        plans.push(Plan::of(&shot, recorded, &mut progress)?);
        devices.push((gpu, engine));
    }
    for ((gpu, engine), plan) in devices.iter().zip(plans) {
        players.push(measure::Player::with_engine(gpu, engine, plan, &mut progress)?);
    }
    let [a, b] = [players[0].count(&mut progress)?, players[1].count(&mut progress)?];
    if a.len() != b.len() {
        return Err(CliError::new("--pair: A and B have different frames", "give --frames outside of --pair"));
    }
    let mut times = [measure::Times::default(), measure::Times::default()];
    let (bar, runs) = (progress.bar(), args.runs as usize);
    progress.step("time", "Timing", || {
        let mut sides = (0..runs).flat_map(|run| [run % 2, 1 - run % 2].map(|side| (run, side)));
        sides.try_for_each(|(run, side)| players[side].run(&mut times[side], run, runs, &bar))
    })?;
    progress.finish();
    let images = a.iter().zip(&b).filter(|(a, b)| a.rendering != b.rendering).count();
    output::print(&format!("{}{images} of {} images differ\n", table(&times), a.len()))
}

/// A variant, flags or a folder of shaders: its simulation and its shaders.
fn variant(
    args: &ReplayArgs,
    matches: &ArgMatches,
    words: &str,
) -> Result<(shot::Shot, Option<Cameras>, ShaderTexts), CliError> {
    let folder = Some(Path::new(words)).filter(|folder| folder.is_dir());
    let own = if folder.is_some() { "" } else { words };
    let command = Command::new("--pair").no_binary_name(true).disable_help_flag(true).args_override_self(true);
    let line = shot::words(matches).into_iter().chain(own.split_whitespace().map(Into::into));
    let flags = args::SharedFlags::<SimulationArgs>::augment_args(command).try_get_matches_from(line);
    let flags = flags.map_err(|error| {
        let (what, hint) = (error.to_string(), "name flags of `render`, or a folder of shaders");
        let what = what.trim_start_matches("error: ").split("\n\n").next().unwrap_or_default();
        CliError::new(format_args!("--pair {words}: {what}"), hint)
    })?;
    let (shot, recorded) = simulation(&args.scene, &flags)?;
    Ok((shot, recorded, folder.map(shaders::read).transpose()?.unwrap_or_default()))
}

/// Ratios of the sum of all passes, of the host's times, and of the passes that take a hundredth of the frame or more.
fn table(times: &[measure::Times; 2]) -> String {
    let [a, b] = times.each_ref().map(|times| {
        let all = Series::sum(ALL_PASSES, &times.passes);
        all.into_iter().chain(times.host.iter().chain(&times.passes).cloned()).collect::<Vec<_>>()
    });
    let least = a.first().map_or(0.0, |all| 0.01 * all.estimate().ms);
    let runs = a.first().map_or(0, |all| all.samples.len());
    let mut text = format!("{:<40}{:>10}{:>10}{:>8}  low to high\n", "pass", "A, ms", "B, ms", "B / A");
    for (a, b) in a.iter().filter_map(|a| Some((a, b.iter().find(|b| b.name == a.name)?))) {
        let ([of_a, of_b], ratios) = ([a, b].map(|series| series.estimate().ms), a.ratios_of(b));
        let (name, ratio, [low, high]) = (&a.name, ratios.median(), ratios.interval());
        let row = format!("{name:<40}{of_a:>10.3}{of_b:>10.3}{ratio:>8.3}  {low:.3} to {high:.3}\n");
        text += if of_a.max(of_b) >= least { &row } else { "" };
    }
    let chance = 100.0 * median_ranks(runs).2;
    text + &format!("medians of {runs} pairs of runs; low to high holds that of all pairs at {chance:.1} %\n")
}

#[test]
fn ratios_are_of_pairs_and_short_passes_are_left_out() {
    let series = |name: &str, runs: [f64; 3]| {
        let samples = runs.map(|ms| vec![ms]).into();
        Series { samples, ..Series::new(name, super::category::Category::of(name)) }
    };
    let times = |factor: f64| measure::Times {
        passes: vec![series("prepass", [0.001; 3]), series("shadows/trace", [factor, 3.0 * factor, 2.0 * factor])],
        host: vec![series("host/frame", [4.0 * factor, 9.0, 9.0])],
        ..measure::Times::default()
    };
    let table = table(&[times(1.0), times(2.0)]).split_whitespace().collect::<Vec<_>>().join(" ");
    for row in ["shadows/trace 2.000 4.000 2.000 2.000 to 2.000", "host/frame 9.000 9.000 1.000 1.000 to 2.000"] {
        assert!(table.contains(row), "{row}: {table}");
    }
    assert!(!table.contains("prepass") && table.contains("of 3 pairs") && table.contains(" 75.0 %"), "{table}");
}
