//! `cargo xtask check`: all checks other than tests.

use crate::{
    budgets,
    command::{cargo, run as step},
    interface, shader_stats, web,
};

/// Checks budgets of lines, then format, lints, also for a browser, and documentation with its public items, with warnings as errors.
pub fn run() -> Result<(), String> {
    budgets::check()?;
    step(&mut cargo(["fmt", "--all", "--check"]))?;
    step(&mut cargo(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    web::check()?;
    interface::run(&[])?;
    shader_stats::check()
}
