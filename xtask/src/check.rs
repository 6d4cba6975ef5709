//! `cargo xtask check`: all checks other than tests.

use crate::{
    budgets,
    command::{cargo, run as step},
    interface, shader_stats, web,
};

/// Checks budgets of lines, then format and lints, with warnings as errors. With `--full` also lints for a browser,
/// documentation with its public items, and the hot passes of shaders.
pub fn run(words: &[String]) -> Result<(), String> {
    let is_full = match words {
        [] => false,
        [flag] if flag == "--full" => true,
        _ => return Err(format!("check takes --full, not {words:?}")),
    };
    budgets::check()?;
    step(&mut cargo(["fmt", "--all", "--check"]))?;
    step(&mut cargo(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    if !is_full {
        return Ok(());
    }
    web::check()?;
    interface::run(&[])?;
    shader_stats::check()
}
