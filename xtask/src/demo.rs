//! `cargo xtask demo`: from a fresh machine to a picture.

use std::process::Command;

use crate::{
    command::{self, cargo, workspace},
    driver,
};

/// Sets up, builds, and renders the built-in scene; `flags` go to `lanternfish render`, after the demo's own.
pub fn run(flags: Vec<String>) -> Result<(), String> {
    driver::ensure_driver()?;
    command::run(&mut cargo(["build", "--release", "--package", "lanternfish-cli"]))?;
    driver::ensure_adapter(|| lanternfish(&["info", "--adapters"]))?;
    let picture = workspace().join("lanternfish-demo.png");
    let mut render = lanternfish(&["render", "demo:atrium", "--lights", "rain:1000", "--seed", "1", "--timings"]);
    // The picture's path is the last thing it prints.
    command::run(render.arg("-o").arg(picture).args(flags))
}

fn lanternfish(words: &[&str]) -> Command {
    cargo(["run", "--quiet", "--release", "--package", "lanternfish-cli", "--"].iter().chain(words))
}
