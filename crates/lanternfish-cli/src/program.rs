//! Start and end of every program of the project.

use std::{
    env,
    ffi::OsString,
    io::{self, Write as _},
    process::Command,
    sync::OnceLock,
};

use clap::{ArgMatches, Parser};

use crate::{
    error::{self, CliError},
    mistakes,
    output::printed,
    signals,
};

/// The words that start this program, and its arguments. Without a value they are the process's own.
static WORDS: OnceLock<(Vec<OsString>, Vec<OsString>)> = OnceLock::new();

/// Sets what another process of this program starts with, and the arguments: for programs that live in another one, as in Python's.
pub fn embed(program: Vec<OsString>, arguments: Vec<OsString>) {
    WORDS.set((program, arguments)).expect("a process is one program");
}

/// The arguments, without the program's name.
pub fn arguments() -> Vec<OsString> {
    WORDS.get().map_or_else(|| env::args_os().skip(1).collect(), |(_, arguments)| arguments.clone())
}

/// Another process of this program, without arguments yet.
pub fn again() -> Result<Command, CliError> {
    if let Some((program, _)) = WORDS.get() {
        let mut command = Command::new(&program[0]);
        command.args(&program[1..]);
        return Ok(command);
    }
    let program = env::current_exe().map_err(|error| CliError::new(format_args!("this program: {error}"), ""))?;
    Ok(Command::new(program))
}

/// Parses the arguments and runs `work` with them, as declared and as given. Prints help and argument errors. Returns the exit code.
/// Call it first in `main`, before any other thread starts.
pub fn run<P: Parser>(work: impl FnOnce(P, &ArgMatches) -> u8) -> u8 {
    error::install_panic_message();
    quieten_mesa();
    if let Err(error) = signals::listen() {
        error::say(&CliError::new(format_args!("cannot listen to signals: {error}"), ""));
        return 1;
    }
    match parse(arguments()) {
        Ok((arguments, matches)) => work(arguments, &matches),
        Err(error) => told(print(&error)),
    }
}

/// Arguments as declared and as given.
pub(crate) fn parse<P: Parser>(words: Vec<OsString>) -> Result<(P, ArgMatches), clap::Error> {
    let mut command = P::command();
    let name = OsString::from(command.get_name());
    let matches = command.try_get_matches_from_mut([name].into_iter().chain(words));
    matches.and_then(|matches| Ok((P::from_arg_matches(&matches)?, matches))).map_err(|mut error| {
        mistakes::explain(&mut error);
        error
    })
}

/// Prints the error, if any, and returns the process's exit code.
pub fn told(result: Result<u8, CliError>) -> u8 {
    result.unwrap_or_else(|error| {
        error::say(&error);
        1
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_embedded_program_starts_again_as_it_was_started() {
        assert_eq!(again().unwrap().get_program(), env::current_exe().unwrap());
        embed(["python3", "-m", "lanternfish"].map(OsString::from).into(), vec!["doctor".into()]);
        let again = again().unwrap();
        assert_eq!((again.get_program(), arguments()), ("python3".as_ref(), vec!["doctor".into()]));
        assert!(again.get_args().eq(["-m", "lanternfish"]));
    }
}
