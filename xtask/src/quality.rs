//! `cargo xtask quality`: quality and cost of every technique.

use crate::{command, program};

/// Sets up, builds, and fills `target/quality`. `flags` go to `lanternfish-bench quality`.
pub fn run(flags: Vec<String>, may_install: bool) -> Result<(), String> {
    program::ready_for_release(may_install)?;
    let mut bench = program::released("lanternfish-bench", &["quality", "--output", "target/quality"]);
    if let Some(commit) = command::commit() {
        bench.args(["--commit", &commit]);
    }
    command::run(bench.args(flags))
}
