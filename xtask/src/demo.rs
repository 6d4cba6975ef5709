//! `cargo xtask demo`: from a fresh machine to an image.

use crate::{
    command::{self, workspace},
    program::{self, called},
};

/// The scene of the demo.
const SCENE: [&str; 5] = ["demo:atrium", "--lights", "rain:1000", "--seed", "1"];

/// Sets up, builds, and renders the built-in scene. `flags` go to `lanternfish render`, after the demo's own.
pub fn run(flags: Vec<String>, may_install: bool) -> Result<(), String> {
    let program = program::ready_as_tests(may_install)?;
    let rendering = workspace().join("lanternfish-demo.png");
    let mut render = called(&program, &["render"]);
    // The program prints the image's path last.
    command::run(render.args(SCENE).args(["--timings", "-o"]).arg(rendering).args(flags))?;
    eprintln!("==> The same in a window: cargo run --package lanternfish-cli -- view {}", SCENE.join(" "));
    Ok(())
}
