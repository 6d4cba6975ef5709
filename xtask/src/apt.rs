//! Installing packages of Debian and Ubuntu.

use std::process::Command;

use crate::command::{find_program, run};

/// The flag against installing anything.
pub const NO_INSTALL: &str = "--no-driver-install";

/// Whether this is Debian, or like it.
pub fn is_there() -> bool {
    cfg!(target_os = "linux") && find_program("apt-get").is_some()
}

/// Installs packages; `from` are flags that choose the release.
pub fn install(from: &[&str], packages: &[&str]) -> Result<(), String> {
    let apt_get = ["env", "DEBIAN_FRONTEND=noninteractive", "apt-get"];
    // Standing sources may be partly out of reach: whether the install works is what counts.
    if let Err(error) = run(&mut as_root(&[&apt_get[..], &["update"]].concat())?) {
        eprintln!("{error}; trying all the same");
    }
    run(&mut as_root(&[&apt_get[..], &["install", "--yes", "--no-install-recommends"], from, packages].concat())?)
}

/// A command as root, directly or through sudo.
pub fn as_root(words: &[&str]) -> Result<Command, String> {
    let is_root = Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0");
    let mut command = if is_root {
        Command::new(words[0])
    } else if let Some(sudo) = find_program("sudo") {
        let mut command = Command::new(sudo);
        command.arg(words[0]);
        command
    } else {
        let words = words.join(" ");
        return Err(format!("no right to install packages: run `{words}` as root, or call this with {NO_INSTALL}"));
    };
    command.args(&words[1..]);
    Ok(command)
}
