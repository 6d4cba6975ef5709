//! The command line of Lanternfish: a glTF file in, a picture out.

mod args;
mod bench;
mod camera;
mod choices;
mod compare;
mod deep_images;
mod error;
mod info;
mod output;
mod parse;
mod progress;
mod reference;
mod render;
mod report;
mod scene;
mod shot;
mod stereo;

use std::{process::ExitCode, time::Instant};

use clap::Parser;

use args::{Cli, Command};
use error::CliError;

fn main() -> ExitCode {
    let started = Instant::now();
    error::install_panic_message();
    quieten_mesa();
    let cli = Cli::parse();
    scene::trust(cli.trust);
    let result = match cli.command {
        Command::Render(args) => shot::resolve(&args.scene).and_then(|shot| render::run(&shot, started)),
        Command::Shot(args) => shot::write(&args.scene),
        Command::Reference(args) => match reference::run(&args, started) {
            Ok(code) => return code,
            Err(error) => Err(error),
        },
        Command::Info(args) => info::run(&args),
        Command::DeepImages(args) => deep_images::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Compare(args) => return compare::main(&args),
    };
    match result {
        // Whoever read our output has seen enough (`lanternfish info … | head`).
        Ok(()) | Err(CliError::ReaderGone) => ExitCode::SUCCESS,
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
