//! `lanternfish replay`: times and counts the frames of a track [VanGelderen2020, §6.1].
//!
//! 1. Plan ([`plan`]): a shot's frames, or a recording of camera input, at fixed times.
//! 2. Count: one run that reads back counters, clusters and images ([`counted`]).
//! 3. Time: equal runs without readback ([`measure`], [`series`]).
//! 4. Write the results ([`report`], [`page`]).
//!
//! `--pair` times two variants in turn instead (`pair`).

pub mod category;
pub mod counted;
pub mod measure;
pub mod page;
mod pair;
pub mod plan;
pub mod report;
pub mod series;

use std::{
    fs,
    path::{Path, PathBuf},
};

use clap::{Arg, ArgMatches, Args};
use lanternfish_gpu::{Gpu, driver_warning};
use lanternfish_scene::Camera;

use self::{measure::Player, plan::Plan, report::Report};
use crate::{
    args::{Selection, SharedFlags, demos},
    error::CliError,
    output,
    parse::Frames,
    progress::Progress,
    scene::SceneName,
    shot::{self, Shot},
};

/// Text after the help of `replay`.
pub(crate) const HELP: &str = "\
Examples:
  A first look, in half a minute without a graphics card:
    lanternfish replay docs/tracks/atrium.toml --frames 8 --runs 1 --size 320x180
  Time and counters of every frame of a walk:
    lanternfish replay docs/tracks/sponza.toml --runs 7 -o before
  Two settings in turn, and the shaders of another checkout with those of this one: ratios of their times:
    lanternfish replay docs/tracks/sponza.toml --pair '--direct all' '--direct sampled'
    lanternfish replay docs/tracks/sponza.toml --pair ../before/crates/lanternfish/src crates/lanternfish/src
  Record a walk in the window, and replay it:
    lanternfish view scene.glb --record walk.toml
    lanternfish replay walk.toml
  Twenty frames of rain through a scene that has no track:
    lanternfish replay demo:cornell --lights rain:1000 --frames 0-19

The last line of standard output is the page's path. --pair prints a table and writes no file.";

/// Number of frames that take long without a graphics card.
const MANY_FRAMES: usize = 200;

/// Flags of `replay`.
#[derive(Debug, Args)]
pub(crate) struct ReplayArgs {
    /// The source of the frames.
    #[arg(help = format!("A shot (.toml) with a [track], or a recording of `view --record`; or a scene, as for `render`: a file, or {}", demos()))]
    pub scene: SceneName,
    /// The folder for the report. It is created if missing.
    #[arg(id = "replay_output", short = 'o', long = "output", value_name = "FOLDER", default_value = "replay")]
    pub output: PathBuf,
    /// Number of timed runs. More: less noise in the least times, and narrower intervals.
    #[arg(long, value_name = "K", default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub runs: u32,
    /// Times two variants in turn: flags in quotes, or folders with the library's shaders.
    ///
    /// Flags of a variant come after those outside. A folder is `crates/lanternfish/src` of any checkout. Prints a table of
    /// ratios, and writes no file.
    #[arg(long, num_args = 2, value_names = ["A", "B"], allow_hyphen_values = true)]
    pub pair: Vec<String>,
    /// The flags of `render` that apply here.
    #[command(flatten)]
    pub shared: SharedFlags<SimulationArgs>,
}

/// The flags of `render` that define the simulation and its rendering.
#[derive(Debug)]
pub(crate) struct SimulationArgs;

/// Ids of flags of `render` that do not apply here.
const OTHERS: [&str; 9] =
    ["scene", "output", "open", "time", "skip_existing", "accumulate", "timings", "report", "progress"];

impl Selection for SimulationArgs {
    fn flag(flag: &Arg) -> Option<Arg> {
        (!OTHERS.contains(&flag.get_id().as_str())).then(|| flag.clone())
    }
}

/// Replays and prints the results.
pub(crate) fn run(args: &ReplayArgs, matches: &ArgMatches) -> Result<(), CliError> {
    if !args.pair.is_empty() {
        return pair::run(args, matches);
    }
    let (shot, recorded) = simulation(&args.scene, matches)?;
    fs::create_dir_all(&args.output).map_err(|error| {
        CliError::new(format_args!("{}: {error}", args.output.display()), "name a folder that can be created")
    })?;
    let report = replayed(&args.scene, &shot, recorded, args.runs as usize)?;
    let file = |name: &str| args.output.join(name);
    output::write_text(&file("report.json"), &report.to_json())?;
    output::write_text(&file("passes.csv"), &report.passes_csv())?;
    output::write_text(&file("counts.csv"), &report.counts_csv())?;
    let page = file("report.html");
    output::write_text(&page, &page::html(&report))?;
    output::print(&format!("{}{}\n", page::summary(&report), page.display()))
}

/// Times, seconds, and cameras of frames.
type Cameras = Vec<(f32, Camera)>;

/// The simulation: a shot, and the chosen steps if it is a recording.
fn simulation(source: &SceneName, matches: &ArgMatches) -> Result<(Shot, Option<Cameras>), CliError> {
    let shot = shot::resolve(source, matches)?;
    let cameras = shot.recorded().map(|path| {
        let (first, count) = match shot.args.track.frames {
            None => (0, usize::MAX),
            Some(Frames::Count(count)) => (0, count as usize),
            Some(Frames::Span(span)) => (span.first as usize, (span.last - span.first) as usize + 1),
        };
        let cameras = path.cameras.iter().enumerate();
        cameras.map(|(i, camera)| (path.time(i), camera.clone())).skip(first).take(count).collect()
    });
    Ok((shot, cameras))
}

/// Counts and times the frames of a shot, from the given cameras if any.
fn replayed(source: &SceneName, shot: &Shot, recorded: Option<Cameras>, runs: usize) -> Result<Report, CliError> {
    let args = &shot.args;
    let mut progress = Progress::start(args.run.quiet);
    let plan = Plan::of(shot, recorded, &mut progress)?;
    if plan.frames() == 1 {
        progress.note("a single frame is replayed; --frames sets how many, or which");
    } else if !plan.moves() {
        progress.note("nothing moves in these frames: their images are the same");
    }
    let choice = args.run.adapter.clone().unwrap_or_default();
    let gpu = progress.step("adapter", "Opening the adapter", || Gpu::open(&choice))?;
    progress.warn(driver_warning(&gpu.device.adapter_info()));
    if !gpu.description.timestamps {
        progress.note("the adapter cannot time its passes: only host times are measured");
    }
    let rendered = plan.frames() * (runs + 1);
    if gpu.description.kind == wgpu::DeviceType::Cpu && rendered > MANY_FRAMES {
        progress.note(&format!(
            "{} frames are rendered {} times, without a graphics card; for a first look: --frames 8 --runs 1 --size 320x180",
            plan.frames(),
            runs + 1
        ));
    }
    let mut player = Player::new(&gpu, plan, &mut progress)?;
    let mut report = player.report(&shown(source.path(), source), args.scene.to_string(), runs, args.run.seed);
    player.measure(&mut report, &mut progress)?;
    progress.finish();
    Ok(report)
}

/// A file's name without its folder, which is irrelevant for the measurement.
fn shown(path: &Path, source: &SceneName) -> String {
    match (source.demo(), path.file_name()) {
        (None, Some(name)) => name.to_string_lossy().into_owned(),
        _ => source.to_string(),
    }
}
