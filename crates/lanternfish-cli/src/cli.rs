//! The program `lanternfish`: its commands and their entry points.

use std::{ffi::OsString, process::ExitCode, time::Instant};

use clap::{ArgMatches, Args, Parser, Subcommand};

#[cfg(feature = "papers")]
use crate::papers::{self, PapersArgs};
#[cfg(feature = "window")]
use crate::{
    args::view::{FIRST, WindowArgs},
    window,
};
use crate::{
    args::{RENDER_HELP, RENDER_SHORT_HELP, RenderArgs, TrustArgs},
    compare::{self, CompareArgs},
    doctor::{self, DoctorArgs},
    error::{self, CliError},
    frames::{self, FramesArgs},
    help::{self, HelpArgs},
    info::{self, InfoArgs},
    program,
    reference::{self, MergeArgs, ReferenceArgs},
    render,
    replay::{self, ReplayArgs},
    shot,
};

const EXAMPLES: &str = "\
Examples:
  lanternfish render demo:atrium --lights rain:1000 -o atrium.png
  lanternfish render scene.glb --view iso --sun 0.3,-1,-0.6,3 --exposure 1 -o scene.png
  lanternfish info scene.glb

`lanternfish help render` shows the flags of every day, `lanternfish help render --all` every flag.";

/// Renders scenes with thousands of lights and ray-traced shadows, on any GPU or none.
#[derive(Debug, Parser)]
#[command(name = "lanternfish", version, after_help = EXAMPLES, max_term_width = 100, arg_required_else_help = true)]
#[command(disable_help_flag = true, disable_help_subcommand = true, arg = help::flag("lanternfish"))]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
    #[command(flatten)]
    pub trust: TrustArgs,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Renders a scene to a PNG or EXR file.
    ///
    /// The last value of a repeated flag counts; --point, --disk and --rectangle add a light each time.
    // `cargo xtask demo FLAGS` puts FLAGS after its own.
    #[command(after_help = RENDER_SHORT_HELP, after_long_help = RENDER_HELP, args_override_self = true)]
    Render(Box<render::many::ManyArgs>),
    /// Opens a window on a scene: fly through it, change every setting, see the time of each pass.
    ///
    /// Takes the flags of `render`. Without a scene it shows the built-in atrium.
    #[cfg(feature = "window")]
    #[command(after_help = window::HELP, args_override_self = true)]
    #[command(override_usage = "lanternfish view [--record TRACK.toml] [--shaders FOLDER] [OPTIONS OF render] [SCENE]")]
    #[command(mut_args(help::hidden), mut_arg("scene", |scene| scene.required(false).default_value(FIRST)))]
    View(Box<WindowArgs>),
    /// Prints a shot: a file that stores these flags of `render`, with every flag as a key.
    ///
    /// Takes the flags of `render`. A path is written as it is given, and is read relative to the shot's folder. `-o
    /// NAME.toml` writes the shot to a file of this folder; any other -o is the image's.
    #[command(after_help = shot::HELP, args_override_self = true)]
    #[command(override_usage = "lanternfish shot [OPTIONS OF render] [-o SHOT.toml] <SCENE>")]
    #[command(mut_args(help::hidden))]
    Shot(Box<RenderArgs>),
    /// Lists the complete, broken and missing frames of a sequence.
    ///
    /// Decodes every pixel and compares the sizes with the requested one. Exits with 0 if all frames are complete, else
    /// with 1.
    #[command(after_help = frames::HELP, args_override_self = true)]
    Frames(Box<FramesArgs>),
    /// Path-traces the ground truth of an image on the CPU.
    ///
    /// Takes the flags of `render`. Ignores a shot's culling, shadows and other real-time techniques, and its output.
    #[command(after_help = reference::HELP, args_override_self = true)]
    Reference(Box<ReferenceArgs>),
    /// Merges parts of one ground truth, traced on many machines. The result equals that of a single run.
    #[command(after_help = reference::merge::HELP)]
    Merge(MergeArgs),
    /// Checks this machine: its adapters and techniques, correct images, rays per second.
    ///
    /// Renders small built-in scenes with every technique and compares them with a path tracer on the CPU; times rays
    /// through every tracer. Takes at most 3 minutes without a graphics card, 40 seconds with --quick.
    #[command(after_help = doctor::HELP)]
    Doctor(DoctorArgs),
    /// Prints the contents of a scene, or the adapters that can render it.
    Info(InfoArgs),
    /// Compares two images: error measures, an error map, and an exit code.
    ///
    /// A is the image under test, B the reference.
    #[command(after_help = compare::HELP)]
    Compare(Box<CompareArgs>),
    /// Plays a camera track frame by frame: times of every pass, counters of every frame.
    ///
    /// Takes the flags of `render`. Times come from --runs equal runs without readback; counters and image hashes come
    /// from one separate run. Writes report.html with plots, report.json, passes.csv and counts.csv.
    #[command(after_help = replay::HELP, args_override_self = true)]
    Replay(Box<ReplayArgs>),
    /// Renders a scene as each of the five papers, as all five at once, and by path tracing, on one sheet.
    ///
    /// Takes the flags of `render`, for every image; those of techniques override the papers'. Writes papers.html,
    /// papers.png and each image.
    #[cfg(feature = "papers")]
    #[command(after_help = papers::HELP, args_override_self = true)]
    #[command(override_usage = "lanternfish papers [--spp N] [OPTIONS OF render] [-o FOLDER] <SCENE>")]
    Papers(Box<PapersArgs>),
    /// Points to the separate program `lanternfish-bench`.
    #[command(hide = true)]
    Bench(BenchArgs),
    /// Prints the help of a command.
    Help(HelpArgs),
}

/// The words after `bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    words: Vec<OsString>,
}

/// The entry point of the program `lanternfish`: runs the process's arguments and returns its exit code. Call it first
/// in `main`.
pub fn main() -> ExitCode {
    ExitCode::from(begin())
}

/// As [`main`], for a program that lives in another one: `program` starts this one in another process, before
/// `arguments`.
pub fn main_of(program: Vec<OsString>, arguments: Vec<OsString>) -> u8 {
    program::embed(program, arguments);
    begin()
}

fn begin() -> u8 {
    let started = Instant::now();
    program::run(|cli: Cli, matches| {
        cli.trust.obey();
        // Of this one, 1 is a result.
        let failed = if matches!(cli.command, Command::Compare(_)) { 2 } else { 1 };
        run(cli, matches, started).unwrap_or_else(|error| {
            error::say(&error);
            failed
        })
    })
}

/// Runs a command. `matches` holds the arguments as given, to tell them from defaults. Returns the exit code.
pub(crate) fn run(cli: Cli, matches: &ArgMatches, started: Instant) -> Result<u8, CliError> {
    let matches = matches.subcommand().map_or(matches, |(_, matches)| matches);
    match cli.command {
        Command::Render(args) => {
            render::many::run(&args, matches, started).map(|is_complete| if is_complete { 0 } else { 1 })
        }
        #[cfg(feature = "window")]
        Command::View(args) => {
            shot::resolve(&args.render.scene, matches).and_then(|shot| window::run(shot, &args.window)).map(|()| 0)
        }
        Command::Shot(args) => shot::write(&args.scene, matches).map(|()| 0),
        Command::Frames(args) => frames::run(&args, matches),
        Command::Reference(args) => reference::run(&args, matches, started),
        Command::Merge(args) => reference::merge::run(&args).map(|()| 0),
        Command::Doctor(args) => doctor::run(&args),
        Command::Info(args) => info::run(&args).map(|()| 0),
        Command::Bench(args) => Err(not_here(&args)),
        Command::Help(args) => help::run::<Cli>(&args).map(|()| 0),
        #[cfg(feature = "papers")]
        Command::Papers(args) => papers::run(&args, matches, cli.trust).map(|()| 0),
        Command::Compare(args) => compare::run(&args),
        Command::Replay(args) => replay::run(&args, matches).map(|()| 0),
    }
}

/// Benches are in a separate program, which users need not have.
fn not_here(args: &BenchArgs) -> CliError {
    let words: String = args.words.iter().map(|word| format!(" {}", word.display())).collect();
    CliError::new("bench: benches are a separate program", format!("run `lanternfish-bench{words}`"))
}
