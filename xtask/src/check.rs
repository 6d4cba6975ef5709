//! `cargo xtask check`: all checks other than tests.

use crate::{
    budgets,
    command::{cargo, run as step},
    interface, program, shader_stats, web,
};

/// Checks budgets of lines, then format and lints, with warnings as errors. With `--full` also lints for a browser
/// and without features, documentation with its public items, and the hot passes of shaders.
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
    without_features()?;
    interface::run(&[])?;
    shader_stats::check()
}

/// The command line without papers and windows. `workspace-hack` and the features of tests give dependencies the
/// features with which they are compiled anyway.
const WITHOUT_FEATURES: &str = "--package lanternfish-cli --package workspace-hack --no-default-features --features \
                                lanternfish/testing,lanternfish-gpu/testing";

/// Lints the command line without its features, builds it, and reads what it says of what it lacks.
fn without_features() -> Result<(), String> {
    let cargo = |task| cargo([task].into_iter().chain(WITHOUT_FEATURES.split(' ')));
    step(cargo("clippy").args(["--", "-D", "warnings"]))?;
    let program = program::find(&program::build(&mut cargo("build"))?, "lanternfish")?;
    for words in ["view", "papers x", "render x --as five", "render x --culling raster-grid", "shot x --vpl-map 64"] {
        let words: Vec<_> = words.split(' ').collect();
        let output = program::called(&program, &words).output().map_err(|error| format!("{words:?}: {error}"))?;
        let said = String::from_utf8_lossy(&output.stderr);
        if output.status.success() || !said.contains("which this program was built without") {
            return Err(format!("{words:?} is not refused for lack of a feature: {said}"));
        }
    }
    Ok(())
}
