//! What every program of the project does before its work and after it.

use std::{
    io::{self, Write as _},
    process::ExitCode,
};

use clap::{ArgMatches, Parser};

use crate::{
    error::{self, CliError},
    signals,
};

/// Reads this process's arguments and runs `work` with them: as they are declared, and as they were given. Prints help, and mistakes in
/// the arguments. To be called first in `main`, before there is any other thread.
pub fn run<P: Parser>(work: impl FnOnce(P, &ArgMatches) -> ExitCode) -> ExitCode {
    error::install_panic_message();
    lanternfish_papers::register();
    quieten_mesa();
    if let Err(error) = signals::install() {
        error::say(&CliError::new(format_args!("signals cannot be listened to: {error}"), ""));
        return ExitCode::FAILURE;
    }
    let matches = P::command().try_get_matches();
    match matches.and_then(|matches| Ok((P::from_arg_matches(&matches)?, matches))) {
        Ok((arguments, matches)) => work(arguments, &matches),
        Err(error) => told(print(&error)),
    }
}

/// What the process exits with, after the error is told, if there is one.
pub fn told(result: Result<u8, CliError>) -> ExitCode {
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

/// Prints what clap has to say of the arguments, a mistake or what `--help` and `--version` ask for, and gives what the
/// process exits with.
fn print(error: &clap::Error) -> Result<u8, CliError> {
    error.print().and_then(|()| io::stdout().flush()).map_err(CliError::from_stdout)?;
    Ok(u8::try_from(error.exit_code()).unwrap_or(u8::MAX))
}

/// Mesa's layer that sorts adapters by what the desktop prefers asks Wayland, which complains on standard error, as an
/// "error", where nobody is logged in (seen with Mesa 22.3). Without a desktop there is nothing to prefer.
fn quieten_mesa() {
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Safety: called first in `main`, before any thread could read the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
