//! The programs, built: for the demo as tests build them, so that nothing is compiled twice; for measurements as users build them.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    command::{self, cargo, workspace},
    compiler,
    driver::{Driver, Purpose},
    hardware::programs,
};

/// Builds the command line with the features that tests build it with: cargo takes those of all packages and of what only tests and
/// examples need where one of these is requested, so an example is.
const AS_TESTS_DO: [&str; 6] = ["build", "--workspace", "--bin", "lanternfish", "--example", "own_device"];

/// Sets up what is missing, and builds the command line; returns its path. `cargo xtask test` has its dependencies then.
pub fn ready_as_tests(may_install: bool) -> Result<PathBuf, String> {
    let [command_line, _] = &programs::RELEASED;
    let build = || command_line.find(&programs::build(&mut cargo(AS_TESTS_DO))?);
    ready(build, |program, words| called(program, words), may_install)
}

/// A call of a program that is built, in the workspace's folder.
pub fn called(program: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(words).current_dir(workspace());
    command
}

/// Sets up what is missing, and builds the command line and the benches for release.
pub fn ready_for_release(may_install: bool) -> Result<(), String> {
    let packages = ["build", "--release", "--package", "lanternfish-cli", "--package", "lanternfish-bench"];
    ready(|| command::run(&mut cargo(packages)), |_, words| released("lanternfish-cli", words), may_install)
}

/// A call of a package's program, built for release, in the workspace's folder.
pub fn released(package: &str, words: &[&str]) -> Command {
    cargo(["run", "--quiet", "--release", "--package", package, "--"].iter().chain(words))
}

/// Sets up what is missing and builds; `lanternfish` calls what was built.
fn ready<T>(
    build: impl FnOnce() -> Result<T, String>,
    lanternfish: fn(&T, &[&str]) -> Command,
    may_install: bool,
) -> Result<T, String> {
    compiler::ensure(may_install)?;
    let mut driver = Driver::new(Purpose::RenderedImages, may_install);
    driver.before_build()?;
    let built = build()?;
    driver.after_build(|| lanternfish(&built, &["info", "--adapters"]))?;
    Ok(built)
}
