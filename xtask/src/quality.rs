//! `cargo xtask quality`: how good every technique is, and what it costs.

use std::process::{Command, Stdio};

use crate::{
    command::{self, workspace},
    release::{self, lanternfish},
};

/// Sets up, builds, and fills `target/quality`; `flags` go to `lanternfish bench quality`.
pub fn run(flags: Vec<String>, may_install: bool) -> Result<(), String> {
    release::ready(may_install)?;
    let mut bench = lanternfish(&["bench", "quality", "--output", "target/quality"]);
    if let Some(commit) = commit() {
        bench.args(["--commit", &commit]);
    }
    command::run(bench.args(flags))
}

/// What git calls this state of the sources; `None` without git, or outside a repository.
fn commit() -> Option<String> {
    let mut git = Command::new("git");
    let output = git.args(["describe", "--always", "--dirty"]).current_dir(workspace()).stderr(Stdio::null()).output();
    let output = output.ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
