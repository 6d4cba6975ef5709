//! `cargo xtask check`: all checks other than tests.

use crate::{
    command::{cargo, run as step},
    compiler, interface, shader_stats,
};

/// Checks format, lints and documentation, with warnings as errors. Lints run the build scripts, which need a C++ compiler.
pub fn run(may_install: bool) -> Result<(), String> {
    compiler::ensure(may_install)?;
    step(&mut cargo(["fmt", "--all", "--check"]))?;
    step(&mut cargo(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    step(cargo(["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))?;
    // What users compile: without the features that the project's other crates require.
    step(&mut cargo(["check", "--package", "lanternfish", "--examples"]))?;
    step(&mut cargo(["check", "--package", "lanternfish-hemisphere", "--no-default-features", "--lib"]))?;
    interface::run(&[])?;
    shader_stats::check()
}
