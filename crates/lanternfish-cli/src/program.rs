//! Start and end of every program of the project.

use std::{
    io::{self, Write as _},
    process::ExitCode,
};

use clap::{ArgMatches, Parser};

use crate::{
    error::{self, CliError},
    mistakes,
    output::printed,
    signals,
};

/// Parses this process's arguments and runs `work` with them, as declared and as given. Prints help and argument errors. Call
/// it first in `main`, before any other thread starts.
pub fn run<P: Parser>(work: impl FnOnce(P, &ArgMatches) -> ExitCode) -> ExitCode {
    error::install_panic_message();
    lanternfish_papers::register();
    quieten_mesa();
    if let Err(error) = signals::install() {
        error::say(&CliError::new(format_args!("cannot listen to signals: {error}"), ""));
        return ExitCode::FAILURE;
    }
    let matches = P::command().try_get_matches();
    match matches.and_then(|matches| Ok((P::from_arg_matches(&matches)?, matches))) {
        Ok((arguments, matches)) => work(arguments, &matches),
        Err(mut error) => {
            mistakes::explain(&mut error);
            told(print(&error))
        }
    }
}

/// Prints the error, if any, and returns the process's exit code.
pub fn told(result: Result<u8, CliError>) -> ExitCode {
    match result {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            error::say(&error);
            ExitCode::FAILURE
        }
    }
}

/// Prints clap's message, an argument error or the text of `--help` and `--version`, and returns the exit code.
fn print(error: &clap::Error) -> Result<u8, CliError> {
    printed(error.print().and_then(|()| io::stdout().flush()))?;
    Ok(u8::try_from(error.exit_code()).unwrap_or(u8::MAX))
}

/// Mesa's device-select layer asks Wayland for the preferred adapter. Without a desktop session it reports an "error" on
/// standard error (seen with Mesa 22.3), and there is no preference to apply.
fn quieten_mesa() {
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: called first in `main`, before any thread could read the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
