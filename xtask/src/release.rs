//! The command line, built as users build it.

use std::process::Command;

use crate::{
    command::{self, cargo},
    compiler,
    driver::{Driver, Purpose},
};

/// Sets up what is missing, and builds the command line and other packages.
pub fn ready(others: &[&str], may_install: bool) -> Result<(), String> {
    compiler::ensure(may_install)?;
    let mut driver = Driver::new(Purpose::Pictures, may_install);
    driver.before_build()?;
    let others = others.iter().flat_map(|package| ["--package", *package]);
    command::run(cargo(["build", "--release", "--package", "lanternfish-cli"]).args(others))?;
    driver.after_build(|| lanternfish(&["info", "--adapters"]))
}

/// A call of it, in the workspace's folder.
pub fn lanternfish(words: &[&str]) -> Command {
    call("lanternfish-cli", words)
}

/// A call of the benches, in the workspace's folder.
pub fn bench(words: &[&str]) -> Command {
    call("lanternfish-bench", words)
}

fn call(package: &str, words: &[&str]) -> Command {
    cargo(["run", "--quiet", "--release", "--package", package, "--"].iter().chain(words))
}
