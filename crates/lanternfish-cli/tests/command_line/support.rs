//! Functions that the tests of the command line share.

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

/// The program in a folder, without input, with the log variables of the test's environment removed.
pub fn lanternfish(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanternfish"));
    command.current_dir(folder).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// Sorted names of the files in a folder.
pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
