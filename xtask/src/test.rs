//! `cargo xtask test`: everything the project checks itself with.
//!
//! A test that cannot run here (no ray query, no shared assets) passes, and says so by appending a line to the file
//! that `LANTERNFISH_LEFT_OUT` names:
//! - `LEFT OUT: name: reason`: this adapter cannot. A failure where `LANTERNFISH_REQUIRE_ALL` is 1.
//! - `LEFT OUT (shared): name: reason`: assets outside the repository are missing. Never a failure.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use crate::{
    command::{cargo, run as step, succeeds},
    driver,
};

/// How a line starts that says an adapter could not.
const LEFT_OUT: &str = "LEFT OUT: ";

pub fn run() -> Result<(), String> {
    let started = Instant::now();
    driver::ensure_driver()?;
    step(&mut cargo(["fmt", "--all", "--check"]))?;
    step(&mut cargo(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    step(cargo(["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))?;
    driver::ensure_adapter(|| cargo(["run", "--quiet", "--package", "lanternfish-cli", "--", "info", "--adapters"]))?;

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
    eprintln!("all checks passed in {:.0} s", started.elapsed().as_secs_f64());
    Ok(())
}

/// Every test once. Those that use the adapter (their names start with `gpu_`) one at a time: nextest is configured
/// so, the plain harness is told so.
fn test_commands() -> Vec<Command> {
    if succeeds(&mut cargo(["nextest", "--version"])) {
        return vec![cargo(["test", "--workspace", "--doc"]), cargo(["nextest", "run", "--workspace"])];
    }
    eprintln!("cargo-nextest is not installed: using cargo test, which is slower");
    vec![
        cargo(["test", "--workspace", "--no-fail-fast", "--", "--skip", "gpu_"]),
        cargo(["test", "--workspace", "--no-fail-fast", "gpu_", "--", "--test-threads=1"]),
    ]
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
