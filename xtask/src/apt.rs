//! Installs packages on Debian and Ubuntu.

use std::process::Command;

use crate::command::{find_program, run};

/// The flag that forbids installing anything.
pub const NO_INSTALL: &str = "--no-driver-install";

/// True on Debian and its derivatives.
pub fn is_there() -> bool {
    cfg!(target_os = "linux") && find_program("apt-get").is_some()
}

/// Installs packages; the flags `from` select the release.
pub fn install(from: &[&str], packages: &[&str]) -> Result<(), String> {
    let apt_get = ["env", "DEBIAN_FRONTEND=noninteractive", "apt-get"];
    // Some configured sources may be unreachable; only the installation must succeed.
    if let Err(error) = run(&mut as_root(&[&apt_get[..], &["update"]].concat())?) {
        eprintln!("{error}; trying to install anyway");
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
        return Err(format!(
            "no permission to install packages: run `{words}` as root, or call this with {NO_INSTALL}"
        ));
    };
    command.args(&words[1..]);
    Ok(command)
}
