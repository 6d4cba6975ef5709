//! The command line of Lanternfish: a glTF file in, a picture out.

mod args;
mod camera;
mod choices;
mod error;
mod info;
mod output;
mod parse;
mod progress;
mod render;
mod report;

use std::{process::ExitCode, time::Instant};

use clap::Parser;

use args::{Cli, Command};
use error::CliError;

fn main() -> ExitCode {
    let started = Instant::now();
    error::install_panic_message();
    let result = match Cli::parse().command {
        Command::Render(args) => render::run(&args, started),
        Command::Info(args) => info::run(&args),
    };
    match result {
        // Whoever read our output has seen enough (`lanternfish info … | head`).
        Ok(()) | Err(CliError::ReaderGone) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
