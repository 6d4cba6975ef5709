//! The command line, built as users build it.

use std::process::Command;

use crate::{
    command::{self, cargo},
    driver,
};

/// Sets up what is missing, and builds.
pub fn ready() -> Result<(), String> {
    driver::ensure_driver()?;
    command::run(&mut cargo(["build", "--release", "--package", "lanternfish-cli"]))?;
    driver::ensure_adapter(|| lanternfish(&["info", "--adapters"]))
}

/// A call of it, in the workspace's folder.
pub fn lanternfish(words: &[&str]) -> Command {
    cargo(["run", "--quiet", "--release", "--package", "lanternfish-cli", "--"].iter().chain(words))
}
