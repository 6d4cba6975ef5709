//! `cargo xtask check`: all checks other than tests.

use crate::{
    budgets,
    command::{cargo, run as step},
    interface, shader_stats,
};

/// Checks budgets of lines, then format, lints and documentation, with warnings as errors.
pub fn run() -> Result<(), String> {
    budgets::check()?;
    step(&mut cargo(["fmt", "--all", "--check"]))?;
    step(&mut cargo(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    step(cargo(["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))?;
    // What users compile: without the features that the project's other crates require.
    step(&mut cargo(["check", "--package", "lanternfish", "--examples"]))?;
    step(&mut cargo(["check", "--package", "lanternfish-hemisphere", "--no-default-features", "--lib"]))?;
    interface::run(&[])?;
    shader_stats::check()
}
