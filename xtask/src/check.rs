//! `cargo xtask check`: all checks other than tests.

use crate::{
    budgets,
    command::{cargo, run as step},
    interface, shader_stats,
};

/// Checks budgets of lines, then format, lints and documentation with its public items, with warnings as errors.
pub fn run() -> Result<(), String> {
    budgets::check()?;
    step(&mut cargo(["fmt", "--all", "--check"]))?;
    step(&mut cargo(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    interface::run(&[])?;
    shader_stats::check()
}
