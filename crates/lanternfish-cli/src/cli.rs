//! The program `lanternfish`: its commands, and what each of them runs.

use std::{ffi::OsString, process::ExitCode, time::Instant};

use clap::{ArgMatches, Args, Parser, Subcommand};

use crate::{
    args::{RENDER_HELP, RENDER_SHORT_HELP, RenderArgs, ShotArgs, TrustArgs, view::WindowArgs},
    compare::{self, CompareArgs},
    deep_images::{self, DeepImagesArgs},
    doctor::{self, DoctorArgs},
    error::CliError,
    farm::{self, FarmArgs},
    frames::{self, FramesArgs},
    help::{self, HelpArgs},
    info::{self, InfoArgs},
    program::{self, told},
    reference::{self, MergeArgs, ReferenceArgs},
    render,
    replay::{self, ReplayArgs},
    shot, window,
};

const EXAMPLES: &str = "\
Examples:
  lanternfish render demo:atrium --lights rain:1000 -o atrium.png
  lanternfish render scene.glb --view iso --sun 0.3,-1,-0.6,3 --exposure 1 -o scene.png
  lanternfish info scene.glb

`lanternfish help render` shows the flags of every day, `lanternfish help render --all` every flag.";

/// Renders scenes with thousands of lights and ray-traced shadows, on any GPU, or none.
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
    /// The last use of a repeated flag counts; --point, --disk and --rectangle add a light each time.
    // `cargo xtask demo FLAGS` puts FLAGS after its own.
    #[command(after_help = RENDER_SHORT_HELP, after_long_help = RENDER_HELP, args_override_self = true)]
    Render(Box<RenderArgs>),
    /// Opens a window on a scene: fly through it, change every setting, see what each pass costs.
    ///
    /// Takes the flags of `render`; without a scene it shows the built-in atrium.
    #[command(after_help = window::HELP, args_override_self = true)]
    #[command(
        override_usage = "lanternfish view [--record TRACK.toml] [--shaders FOLDER] [OPTIONS OF render] [SCENE]\n       \
        lanternfish view IMAGE [IMAGE...]"
    )]
    View(Box<WindowArgs>),
    /// Prints a shot: a file that renders what these flags render, with every flag as a key.
    ///
    /// Takes the flags of `render`. A path is written as it is given, and is read relative to the shot's folder.
    #[command(after_help = shot::HELP, args_override_self = true)]
    #[command(override_usage = "lanternfish shot [OPTIONS OF render] <SCENE>")]
    Shot(Box<ShotArgs>),
    /// Says which frames of a sequence are there and whole, and names the others.
    ///
    /// Every pixel is decoded, and sizes are compared with what is requested. Exits with 0 if all are whole, else with 1.
    #[command(after_help = frames::HELP, args_override_self = true)]
    Frames(Box<FramesArgs>),
    /// Writes a job that renders a sequence on many machines, for Open Job Description.
    ///
    /// The job renders chunks of frames, in any order and at once, and verifies them with `lanternfish frames`.
    #[command(after_help = farm::HELP)]
    Farm(FarmArgs),
    /// Traces every path light takes, on the processor: the ground truth of an image.
    ///
    /// Takes what `render` takes. What a shot says of culling, shadows and the like has no meaning here and is left aside, as
    /// is the shot's output.
    #[command(after_help = reference::HELP, args_override_self = true)]
    Reference(Box<ReferenceArgs>),
    /// Adds up parts of one ground truth, traced on many machines: the same file as traced at once.
    #[command(after_help = reference::merge::HELP)]
    Merge(MergeArgs),
    /// Checks this machine: which adapters and techniques it has, whether images are right, how fast it is.
    ///
    /// Renders small built-in scenes by every technique and compares them with a path tracer on the processor; times rays, sorting and
    /// the passes of a fixed frame. Takes three minutes at most without a graphics card, 40 seconds with --quick.
    #[command(after_help = doctor::HELP)]
    Doctor(DoctorArgs),
    /// Prints what a scene holds, or which adapters can render it.
    Info(InfoArgs),
    /// Says how two images differ: in numbers, in an image, and by its exit code.
    ///
    /// A is the image under test, B the reference.
    #[command(after_help = compare::HELP)]
    Compare(Box<CompareArgs>),
    /// Plays a camera track frame by frame: what every pass takes, what every frame counts, and what became slower.
    ///
    /// Takes the flags of `render`. Times are of --runs equal runs, in which nothing is read back; counts and images' hashes are of
    /// one run of their own. Writes report.html with plots, report.json, passes.csv and counts.csv.
    #[command(after_help = replay::HELP, args_override_self = true)]
    Replay(Box<ReplayArgs>),
    /// Shows the scene as sorted rays: deep images as points in the scene, by layers, or by how many surfaces each texel holds.
    ///
    /// Takes the camera of `render`. What a shot says of lights, look and technique has no meaning here and is left aside, as is
    /// the shot's output.
    #[command(after_help = deep_images::HELP, args_override_self = true)]
    DeepImages(Box<DeepImagesArgs>),
    /// Is a program of its own, `lanternfish-bench`.
    #[command(hide = true)]
    Bench(BenchArgs),
    /// Prints this, or the help of a command.
    Help(HelpArgs),
}

/// What was said after `bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    words: Vec<OsString>,
}

/// The program `lanternfish`, from this process's arguments to its exit code. To be called first in `main`.
pub fn main() -> ExitCode {
    let started = Instant::now();
    program::run(|cli: Cli, matches| {
        let said = matches.subcommand().map_or(matches, |(_, said)| said);
        run(cli, said, started)
    })
}

/// Runs a command. `said`: its arguments as they were given, for what knows them from defaults.
fn run(cli: Cli, said: &ArgMatches, started: Instant) -> ExitCode {
    cli.trust.obey();
    told(match cli.command {
        Command::Render(args) => {
            shot::resolve(&args.scene, said).and_then(|shot| render::run(&shot, started)).map(|()| 0)
        }
        Command::View(args) => {
            shot::resolve(&args.render.scene, said).and_then(|shot| window::run(shot, &args.window)).map(|()| 0)
        }
        Command::Shot(args) => shot::write(&args.0.scene, said).map(|()| 0),
        Command::Frames(args) => frames::run(&args, said),
        Command::Farm(args) => farm::run(&args).map(|()| 0),
        Command::Reference(args) => reference::run(&args, said, started),
        Command::Merge(args) => reference::merge::run(&args).map(|()| 0),
        Command::Doctor(args) => doctor::run(&args),
        Command::Info(args) => info::run(&args).map(|()| 0),
        Command::DeepImages(args) => deep_images::run(&args, said).map(|()| 0),
        Command::Bench(args) => Err(not_here(&args)),
        Command::Help(args) => help::run::<Cli>(&args).map(|()| 0),
        Command::Compare(args) => return compare::main(&args),
        Command::Replay(args) => return replay::main(&args, said),
    })
}

/// Benches are in another program, which users need not have.
fn not_here(args: &BenchArgs) -> CliError {
    let words: String = args.words.iter().map(|word| format!(" {}", word.display())).collect();
    CliError::new("bench: benches are a program of their own", format!("run `lanternfish-bench{words}`"))
}
