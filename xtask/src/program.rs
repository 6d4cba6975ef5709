//! Builds the programs: for the demo with the tests' features, so that nothing is compiled twice; for measurements in release
//! mode.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    command::{self, cargo, workspace},
    driver,
    hardware::programs,
};

/// Builds the command line with the same features as the tests, but without windows, which are a third of the work. Cargo unifies
/// the features of all packages, and those of dev-dependencies only if a test or an example is requested, hence the example.
const AS_TESTS_DO: [&str; 7] =
    ["build", "--workspace", "--no-default-features", "--bin", "lanternfish", "--example", "own_device"];

/// Sets up missing packages, builds the command line and returns its path. `cargo xtask test` then has its dependencies built.
pub fn ready_as_tests(may_install: bool) -> Result<PathBuf, String> {
    let [command_line, _] = &programs::RELEASED;
    let build = || command_line.find(&programs::build(&mut cargo(AS_TESTS_DO))?);
    ready(build, |program, words| called(program, words), may_install)
}

/// A command that runs a built program in the workspace's folder.
pub fn called(program: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(words).current_dir(workspace());
    command
}

/// Sets up missing packages, and builds the command line and the benches in release mode.
pub fn ready_for_release(may_install: bool) -> Result<(), String> {
    let packages = ["build", "--release", "--package", "lanternfish-cli", "--package", "lanternfish-bench"];
    ready(|| command::run(&mut cargo(packages)), |_, words| released("lanternfish-cli", words), may_install)
}

/// A command that runs a package's program, built in release mode, in the workspace's folder.
pub fn released(package: &str, words: &[&str]) -> Command {
    cargo(["run", "--quiet", "--release", "--package", package, "--"].iter().chain(words))
}

/// Sets up missing packages and builds; `lanternfish` runs the built program.
fn ready<T>(
    build: impl FnOnce() -> Result<T, String>,
    lanternfish: fn(&T, &[&str]) -> Command,
    may_install: bool,
) -> Result<T, String> {
    driver::before_build(may_install)?;
    let built = build()?;
    driver::after_build(may_install, false, || lanternfish(&built, &["info", "--adapters"]))?;
    Ok(built)
}
