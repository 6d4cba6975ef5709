//! The programs, built: for the demo as tests build them, so that nothing is compiled twice; for measurements as users build them.

use std::{path::PathBuf, process::Command};

use crate::{
    command::{self, cargo, workspace},
    compiler,
    driver::{Driver, Purpose},
};

/// Builds the command line with the features that tests build it with: cargo takes those of all packages and of what only tests and
/// examples need where one of these is asked for, so an example is.
const AS_TESTS_DO: [&str; 6] = ["build", "--workspace", "--bin", "lanternfish", "--example", "own_device"];

/// Sets up what is missing, and builds the command line. `cargo xtask test` has its dependencies then.
pub fn ready_as_tests(may_install: bool) -> Result<(), String> {
    ready(cargo(AS_TESTS_DO), built_as_tests, may_install)
}

/// A call of it, in the workspace's folder.
pub fn built_as_tests(words: &[&str]) -> Command {
    let folder = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| "target".into(), PathBuf::from);
    let mut command = Command::new(workspace().join(folder).join("debug").join("lanternfish"));
    command.args(words).current_dir(workspace());
    command
}

/// Sets up what is missing, and builds the command line and the benches for release.
pub fn ready_for_release(may_install: bool) -> Result<(), String> {
    let packages = ["build", "--release", "--package", "lanternfish-cli", "--package", "lanternfish-bench"];
    ready(cargo(packages), |words| released("lanternfish-cli", words), may_install)
}

/// A call of a package's program, built for release, in the workspace's folder.
pub fn released(package: &str, words: &[&str]) -> Command {
    cargo(["run", "--quiet", "--release", "--package", package, "--"].iter().chain(words))
}

fn ready(mut build: Command, lanternfish: fn(&[&str]) -> Command, may_install: bool) -> Result<(), String> {
    compiler::ensure(may_install)?;
    let mut driver = Driver::new(Purpose::Pictures, may_install);
    driver.before_build()?;
    command::run(&mut build)?;
    driver.after_build(|| lanternfish(&["info", "--adapters"]))
}

#[test]
fn the_demo_is_built_with_the_features_of_tests() {
    // An example makes cargo take the features of tests; the packages are the same.
    assert!(AS_TESTS_DO.contains(&"--example") && AS_TESTS_DO.contains(&"--workspace"));
    assert!(crate::test::TARGETS.contains(&"--workspace") && crate::test::TARGETS.contains(&"--examples"));
    assert!(workspace().join("crates/lanternfish/examples/own_device.rs").is_file());
}
