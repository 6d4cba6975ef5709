//! Benches from words to files: one program, so that it is linked once.

mod clustered;
mod deep_images;
mod history;
mod indirect;
mod moving;
mod photons;
mod quality;
mod virtual_lights;

use std::{
    path::Path,
    process::{Command, Stdio},
};

/// The program in a folder, without input, whatever the tests' own surroundings say of logs.
fn program(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanternfish-bench"));
    command.current_dir(folder).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}
