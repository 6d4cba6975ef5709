//! `cargo xtask check`: all that is not a test.

use crate::command::{cargo, run as step};

/// Format, lints and documentation, with warnings as errors.
pub fn run() -> Result<(), String> {
    step(&mut cargo(["fmt", "--all", "--check"]))?;
    step(&mut cargo(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    step(cargo(["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))
}
