//! The command line of Lanternfish: a glTF file in, a picture out.

mod args;
mod bench;
mod camera;
mod choices;
mod compare;
mod deep_images;
mod doctor;
mod error;
mod farm;
mod flags;
mod frames;
mod help;
mod info;
mod legend;
mod light_rig;
mod motion;
mod output;
mod parse;
mod pictures;
mod plot;
mod progress;
mod recording;
mod reference;
mod render;
mod replay;
mod report;
mod scene;
mod shot;
mod signals;
mod stereo;
mod window;

use std::{process::ExitCode, time::Instant};

use clap::Parser;

use args::{Cli, Command};
use error::CliError;

fn main() -> ExitCode {
    let started = Instant::now();
    error::install_panic_message();
    quieten_mesa();
    if let Err(error) = signals::install() {
        error::say(&CliError::new(format_args!("signals cannot be listened to: {error}"), ""));
        return ExitCode::FAILURE;
    }
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return told(help::told_by(&error)),
    };
    scene::trust(cli.trust);
    told(match cli.command {
        Command::Render(args) => shot::resolve(&args.scene).and_then(|shot| render::run(&shot, started)).map(|()| 0),
        Command::View(args) => {
            shot::resolve(&args.render.scene).and_then(|shot| window::run(shot, &args.window)).map(|()| 0)
        }
        Command::Shot(args) => shot::write(&args.0.scene).map(|()| 0),
        Command::Frames(args) => frames::run(&args),
        Command::Farm(args) => farm::run(&args).map(|()| 0),
        Command::Reference(args) => reference::run(&args, started),
        Command::Merge(args) => reference::merge::run(&args).map(|()| 0),
        Command::Doctor(args) => doctor::run(&args),
        Command::Info(args) => info::run(&args).map(|()| 0),
        Command::DeepImages(args) => deep_images::run(&args).map(|()| 0),
        Command::Bench(args) => bench::run(&args).map(|()| 0),
        Command::Help(args) => help::run(&args).map(|()| 0),
        Command::Compare(args) => return compare::main(&args),
        Command::Replay(args) => return replay::main(&args),
    })
}

/// What the process exits with, after the error is told, if there is one.
fn told(result: Result<u8, CliError>) -> ExitCode {
    match result {
        Ok(code) => ExitCode::from(code),
        // Whoever read our output has seen enough (`lanternfish info … | head`).
        Err(CliError::ReaderGone) => ExitCode::SUCCESS,
        Err(error) => {
            error::say(&error);
            ExitCode::FAILURE
        }
    }
}

/// Mesa's layer that sorts adapters by what the desktop prefers asks Wayland, which complains on standard error, as an
/// "error", where nobody is logged in (seen with Mesa 22.3). Without a desktop there is nothing to prefer.
fn quieten_mesa() {
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Safety: called first in `main`, before any thread could read the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
