//! `cargo xtask demo`: from a fresh machine to a picture.

use crate::{
    command::{self, workspace},
    release::{self, lanternfish},
};

/// Sets up, builds, and renders the built-in scene; `flags` go to `lanternfish render`, after the demo's own.
pub fn run(flags: Vec<String>, may_install: bool) -> Result<(), String> {
    release::ready(may_install)?;
    let picture = workspace().join("lanternfish-demo.png");
    let mut render = lanternfish(&["render", "demo:atrium", "--lights", "rain:1000", "--seed", "1", "--timings"]);
    // The picture's path is the last thing it prints.
    command::run(render.arg("-o").arg(picture).args(flags))
}
