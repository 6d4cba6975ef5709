//! Builds the programs: for the demo with the tests' features, so that nothing is compiled twice; for measurements in release
//! mode.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;

use crate::{
    command::{self, cargo, run_for_output, workspace},
    driver,
};

/// Builds the command line with the same features as the tests, but without windows, which are a third of the work. Cargo unifies
/// the features of all packages, and those of dev-dependencies only if a test or an example is requested, hence the example.
const AS_TESTS_DO: [&str; 7] =
    ["build", "--workspace", "--no-default-features", "--bin", "lanternfish", "--example", "own_device"];

/// Sets up missing packages, builds the command line and returns its path. `cargo xtask test` then has its dependencies built.
pub fn ready_as_tests(may_install: bool) -> Result<PathBuf, String> {
    ready(
        || find(&build(&mut cargo(AS_TESTS_DO))?, "lanternfish"),
        |program, words| called(program, words),
        may_install,
    )
}

/// Builds with cargo. Returns its messages, one line of JSON each.
pub fn build(command: &mut Command) -> Result<String, String> {
    run_for_output(command.arg("--message-format=json-render-diagnostics"))
}

/// The path of a program, from cargo's messages.
pub fn find(messages: &str, name: &str) -> Result<PathBuf, String> {
    let mut messages = messages.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let path = |message: Value| {
        let is_this = message["target"]["name"] == name && message["target"]["kind"][0] == "bin";
        message["executable"].as_str().filter(|_| is_this && message["profile"]["test"] == false).map(PathBuf::from)
    };
    messages.find_map(path).ok_or_else(|| format!("cargo built no program {name}"))
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

#[test]
fn programs_are_found_in_the_messages_of_cargo() {
    let messages = r#"
{"target":{"kind":["lib"],"name":"lanternfish"},"profile":{"test":false},"executable":null}
{"target":{"kind":["lib"],"name":"lanternfish"},"profile":{"test":true},"executable":"/t/lanternfish-1"}
{"target":{"kind":["bin"],"name":"lanternfish"},"profile":{"test":true},"executable":"/t/lanternfish-2"}
not JSON
{"target":{"kind":["bin"],"name":"lanternfish"},"profile":{"test":false},"executable":"/t/lanternfish"}
{"reason":"build-finished","success":true}
"#;
    assert_eq!(find(messages, "lanternfish"), Ok("/t/lanternfish".into()));
    assert!(find(messages, "lanternfish-bench").unwrap_err().contains("no program lanternfish-bench"));
}
