//! `cargo xtask test`: every test.
//!
//! A test that cannot run here (no ray query, no shared assets) passes, and says so by appending a line to the file
//! that `LANTERNFISH_LEFT_OUT` names:
//! - `LEFT OUT: name: reason`: this adapter cannot. A failure where `LANTERNFISH_REQUIRE_ALL` is 1.
//! - `LEFT OUT (shared): name: reason`: assets outside the repository are missing. Never a failure.

use std::{
    env::{self, consts::EXE_SUFFIX},
    fs,
    path::{Path, PathBuf},
    process::Command,
    thread,
    time::Instant,
};

use crate::{
    command::{cargo, run as step, succeeds},
    compiler,
    driver::{Driver, Purpose},
};

/// How a line starts that says an adapter could not.
const LEFT_OUT: &str = "LEFT OUT: ";

/// Everything that is built for tests but the tests in documentation. Each call names the same, so that nothing is built twice.
pub const TARGETS: [&str; 6] = ["test", "--workspace", "--lib", "--bins", "--tests", "--examples"];

/// Tests at a time without nextest; `gpu` in `.config/nextest.toml`.
const MOST_AT_ONCE: usize = 4;

pub fn run(may_install: bool) -> Result<(), String> {
    let started = Instant::now();
    compiler::ensure(may_install)?;
    let mut driver = Driver::new(Purpose::Tests, may_install);
    driver.before_build()?;
    step(cargo(TARGETS).arg("--no-run"))?;
    // The tests of the command line have it built, beside this program.
    let here = env::current_exe().map_err(|error| format!("where this program lies: {error}"))?;
    let lanternfish = here.with_file_name(format!("lanternfish{EXE_SUFFIX}"));
    driver.after_build(|| {
        let mut command = Command::new(&lanternfish);
        command.args(["info", "--adapters"]);
        command
    })?;

    let list = List::new();
    let mut result = Ok(());
    for mut tests in test_commands() {
        result = result.and(step(tests.env("LANTERNFISH_LEFT_OUT", &list.0)));
    }
    let left_out = list.lines();
    if left_out.is_empty() {
        eprintln!("\nnothing was left out");
    } else {
        eprintln!("\nleft out:\n  {}", left_out.join("\n  "));
    }
    result?;
    check_left_out(&left_out, env::var_os("LANTERNFISH_REQUIRE_ALL").is_some_and(|value| value == "1"))?;
    eprintln!("all tests passed in {:.0} s", started.elapsed().as_secs_f64());
    Ok(())
}

/// Every test once, no more of them at a time than nextest is configured for.
fn test_commands() -> Vec<Command> {
    let documentation = cargo(["test", "--workspace", "--doc"]);
    if succeeds(&mut cargo(["nextest", "--version"])) {
        return vec![documentation, cargo(["nextest", "run", "--workspace"])];
    }
    let threads = thread::available_parallelism().map_or(1, |count| count.get().min(MOST_AT_ONCE));
    let mut tests = cargo(TARGETS);
    tests.args(["--no-fail-fast", "--", &format!("--test-threads={threads}")]);
    vec![documentation, tests]
}

/// An error if something had to run and did not.
fn check_left_out(lines: &[String], all_required: bool) -> Result<(), String> {
    let count = lines.iter().filter(|line| line.starts_with(LEFT_OUT)).count();
    if all_required && count > 0 {
        return Err(format!("{count} tests were left out, and LANTERNFISH_REQUIRE_ALL=1 wants all of them"));
    }
    Ok(())
}

/// The file that tests append to, removed when dropped.
struct List(PathBuf);

impl List {
    fn new() -> Self {
        let path = env::temp_dir().join(format!("lanternfish-left-out-{}", std::process::id()));
        // One of a process of the same number that was killed.
        let _ = fs::remove_file(&path);
        Self(path)
    }

    /// Each line once, in order: a test may run in more than one way.
    fn lines(&self) -> Vec<String> {
        sorted_lines(&fs::read_to_string(Path::new(&self.0)).unwrap_or_default())
    }
}

impl Drop for List {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

fn sorted_lines(text: &str) -> Vec<String> {
    let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
    lines.sort();
    lines.dedup();
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_the_adapter_cannot_do_fails_and_only_where_all_is_required() {
        let lines = sorted_lines(
            "LEFT OUT (shared): sponza: no assets\nLEFT OUT: rays: no ray query\nLEFT OUT: rays: no ray query\n",
        );
        assert_eq!(lines.len(), 2);
        assert!(check_left_out(&lines, true).unwrap_err().starts_with("1 tests"));
        assert_eq!(check_left_out(&lines, false), Ok(()));
        assert_eq!(check_left_out(&lines[..1], true), Ok(()));
    }
}
