//! `cargo xtask audit`: what a release checks beyond `check`, with tools that take minutes to install.

use crate::command::{cargo, find_program, run, run_for_output, workspace};

/// Checks licences, advisories and sources of all dependencies by `deny.toml`, and that the public interface has not changed since
/// the last release in a way that its version number hides. Before the first release there is nothing to compare with.
pub fn run_audit() -> Result<(), String> {
    let releases =
        run_for_output(std::process::Command::new("git").args(["tag", "--list", "v*"]).current_dir(workspace()))?;
    let programs = ["cargo-deny", "cargo-semver-checks"];
    let programs = if releases.is_empty() { &programs[..1] } else { &programs };
    if let Some(program) = programs.iter().find(|program| find_program(program).is_none()) {
        return Err(format!("no {program}: cargo install --locked {program}"));
    }
    run(&mut cargo(["deny", "check"]))?;
    if releases.is_empty() {
        eprintln!("LEFT OUT: cargo-semver-checks: no tag v*, so nothing is released");
        return Ok(());
    }
    run(&mut cargo(["semver-checks", "--workspace"]))
}
