//! `cargo xtask check`: all checks other than tests.

use crate::{
    budgets,
    command::{cargo, run as step},
    shader_stats,
};

/// Checks budgets of lines, then format, lints and documentation, with warnings as errors.
pub fn run() -> Result<(), String> {
    budgets::check()?;
    step(&mut cargo(["fmt", "--all", "--check"]))?;
    step(&mut cargo(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    step(cargo(["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))?;
    shader_stats::check()
}
