//! The command line, built as users build it.

use std::process::Command;

use crate::{
    command::{self, cargo},
    compiler,
    driver::{Driver, Purpose},
};

/// Sets up what is missing, and builds.
pub fn ready(may_install: bool) -> Result<(), String> {
    compiler::ensure(may_install)?;
    let mut driver = Driver::new(Purpose::Pictures, may_install);
    driver.before_build()?;
    command::run(&mut cargo(["build", "--release", "--package", "lanternfish-cli"]))?;
    driver.after_build(|| lanternfish(&["info", "--adapters"]))
}

/// A call of it, in the workspace's folder.
pub fn lanternfish(words: &[&str]) -> Command {
    cargo(["run", "--quiet", "--release", "--package", "lanternfish-cli", "--"].iter().chain(words))
}
