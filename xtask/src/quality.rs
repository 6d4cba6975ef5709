//! `cargo xtask quality`: how good every technique is, and what it costs.

use crate::{command, release};

/// Sets up, builds, and fills `target/quality`; `flags` go to `lanternfish-bench quality`.
pub fn run(flags: Vec<String>, may_install: bool) -> Result<(), String> {
    release::ready(&["lanternfish-bench"], may_install)?;
    let mut bench = release::bench(&["quality", "--output", "target/quality"]);
    if let Some(commit) = command::commit() {
        bench.args(["--commit", &commit]);
    }
    command::run(bench.args(flags))
}
