//! `cargo xtask audit`: what a release checks beyond `check`, with tools that take minutes to install.

use crate::command::{cargo, find_program, run};

/// Checks licences, advisories and sources of all dependencies by `deny.toml`, and that the public interface has not changed since
/// the last release in a way that its version number hides.
pub fn run_audit() -> Result<(), String> {
    for (program, package) in [("cargo-deny", "cargo-deny"), ("cargo-semver-checks", "cargo-semver-checks")] {
        if find_program(program).is_none() {
            return Err(format!("no {program}: cargo install --locked {package}"));
        }
    }
    run(&mut cargo(["deny", "check"]))?;
    run(&mut cargo(["semver-checks", "--workspace"]))
}
