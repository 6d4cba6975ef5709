//! Runs other programs and prints their command lines.

use std::{
    ffi::OsStr,
    io::{self, Read as _, Write as _},
    path::{Path, PathBuf},
    process::{Command, ExitStatus, Stdio},
};

/// The workspace's folder, independent of the current folder.
pub fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask lies in the workspace")
}

/// The folders of the workspace's crates.
#[cfg(test)]
pub fn packages() -> Vec<PathBuf> {
    let folders = ["crates", "papers"].map(|folder| std::fs::read_dir(workspace().join(folder)).expect("it is there"));
    folders.into_iter().flatten().map(|entry| entry.expect("it can be read").path()).collect()
}

/// The cargo that runs this task, in the workspace's folder.
pub fn cargo<S: AsRef<OsStr>>(words: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or("cargo".into()));
    command.args(words).current_dir(workspace());
    command
}

/// Prints the command line and runs it. Returns an error unless it succeeds.
pub fn run(command: &mut Command) -> Result<(), String> {
    told(command, Command::status)
}

/// As [`run`], with `input` on its standard input and without its standard output.
pub fn run_with_input(command: &mut Command, input: &str) -> Result<(), String> {
    told(command.stdin(Stdio::piped()).stdout(Stdio::null()), |command| {
        let mut child = command.spawn()?;
        // A program that stops reading states the reason by its exit status.
        let _ = child.stdin.take().expect("it is piped").write_all(input.as_bytes());
        child.wait()
    })
}

/// As [`run`]; returns its standard output.
pub fn run_for_output(command: &mut Command) -> Result<String, String> {
    let mut text = Vec::new();
    told(command.stdout(Stdio::piped()), |command| {
        let mut child = command.spawn()?;
        child.stdout.take().expect("it is piped").read_to_end(&mut text)?;
        child.wait()
    })?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}

fn told(command: &mut Command, run: impl FnOnce(&mut Command) -> io::Result<ExitStatus>) -> Result<(), String> {
    let line = line(command);
    eprintln!("==> {line}");
    match run(command) {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{line}: {status}")),
        Err(error) => Err(format!("{line}: {error}")),
    }
}

/// True if a command succeeds. Prints nothing.
pub fn succeeds(command: &mut Command) -> bool {
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|s| s.success())
}

/// The path of a program, if it can be called by name.
pub fn find_program(name: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders).map(|folder| folder.join(name)).find(|path| path.is_file())
}

/// The command as typed in a shell.
fn line(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let program = program.file_name().unwrap_or(program.as_os_str()).to_string_lossy().into_owned();
    let variables = command
        .get_envs()
        .filter_map(|(name, value)| Some(format!("{}={}", name.to_string_lossy(), value?.to_string_lossy())));
    let words = command.get_args().map(|word| word.to_string_lossy().into_owned());
    variables.chain([program]).chain(words).collect::<Vec<_>>().join(" ")
}

/// Git's description of the sources; `None` without git, or outside a repository.
pub fn commit() -> Option<String> {
    let mut git = Command::new("git");
    let output = git.args(["describe", "--always", "--dirty"]).current_dir(workspace()).stderr(Stdio::null()).output();
    let output = output.ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_printed_as_typed() {
        let mut command = Command::new("some/folder/cargo");
        command.args(["doc", "--no-deps"]).env("RUSTDOCFLAGS", "-Dwarnings");
        assert_eq!(line(&command), "RUSTDOCFLAGS=-Dwarnings cargo doc --no-deps");
    }

    #[cfg(unix)]
    #[test]
    fn a_command_reads_its_input_and_returns_its_output() {
        let mut reads = Command::new("sh");
        assert_eq!(run_with_input(reads.args(["-c", "test \"$(cat)\" = 'two words'"]), "two words\n"), Ok(()));
        assert!(run_with_input(&mut Command::new("false"), &"much ".repeat(100_000)).is_err());
        assert_eq!(run_for_output(Command::new("echo").arg("two words")).as_deref(), Ok("two words\n"));
        assert!(run_for_output(&mut Command::new("false")).is_err());
    }

    #[test]
    fn a_failing_command_is_an_error_that_names_it() {
        let error = run(&mut Command::new("no-such-program-at-all")).unwrap_err();
        assert!(error.starts_with("no-such-program-at-all: "), "{error}");
        assert!(!succeeds(&mut Command::new("no-such-program-at-all")));
        assert!(find_program("no-such-program-at-all").is_none());
    }
}
