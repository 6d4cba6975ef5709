//! Effects of signals on a run.

use std::{
    io::{BufRead as _, BufReader, Lines},
    path::Path,
    process::{Child, ChildStderr, Command, Stdio},
};

use lanternfish_metrics::read_exr_attributes;

use super::*;

/// Starts `reference` from a shell that runs `before` first, and waits for the estimate of its duration.
fn started(folder: &Path, before: &str) -> (Child, Lines<BufReader<ChildStderr>>) {
    let line = format!(
        "{before} exec '{}' reference demo:cornell --size 32x32 --until-error 1e-9 -o a.exr",
        env!("CARGO_BIN_EXE_lanternfish")
    );
    let mut command = Command::new("sh");
    command.current_dir(folder).env_remove("RUST_LOG").stdin(Stdio::null()).args(["-c", &line]);
    // A caller that starts the tests in the background may ignore signals. Child processes inherit that, and a shell cannot
    // undo it.
    let heed_signals = || {
        for signal in [libc::SIGINT, libc::SIGTERM, libc::SIGHUP] {
            // SAFETY: async-signal-safe, with the system's default handler.
            unsafe { libc::signal(signal, libc::SIG_DFL) };
        }
        Ok(())
    };
    // SAFETY: the closure allocates nothing and takes no lock.
    unsafe { std::os::unix::process::CommandExt::pre_exec(&mut command, heed_signals) };
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.any(|line| is_estimate(&line.unwrap())), "it ended without an estimate");
    (child, lines)
}

/// Sends the signals at once: the stopped process gets them when it continues, however slow the machine is.
fn kill(child: &Child, signals: [&str; 2]) {
    let [first, second] = signals;
    let line = ["-STOP", first, second, "-CONT"].map(|signal| format!("kill {signal} {}", child.id())).join("; ");
    assert!(Command::new("sh").args(["-c", &line]).status().unwrap().success());
}

/// Two signals at once, as `timeout` sends them. Either of two pending signals may be delivered first.
#[track_caller]
fn write_the_samples_so_far(signals: [&str; 2], codes: [i32; 2]) {
    let folder = Folder::new();
    let (child, lines) = started(&folder.path(""), "");
    kill(&child, signals);
    let stderr = lines.map(|line| line.unwrap() + "\n").collect::<String>();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.code().is_some_and(|code| codes.contains(&code)), "{:?}: {stderr}", output.status);
    assert_eq!(output.stdout, b"a.exr\n", "{stderr}");
    let samples = || {
        let attributes = read_exr_attributes(&folder.path("a.exr")).unwrap();
        attributes["lanternfish.samples"].parse::<u64>().unwrap()
    };
    let count = samples();
    let said = format!("note: stopped at {count} samples per pixel; the same command with --resume continues\n");
    assert_eq!(more_than_usual(&stderr), said);
    assert_eq!(folder.names(""), ["a.exr"]);
    folder.done(&format!("reference demo:cornell --size 32x32 --spp {} --resume -o a.exr", count + 3));
    assert_eq!(samples(), count + 3);
}

#[test]
fn a_signal_writes_the_samples_so_far() {
    write_the_samples_so_far(["-INT", "-TERM"], [130, 143]);
}

#[test]
#[ignore = "full"]
fn every_signal_writes_the_samples_so_far() {
    write_the_samples_so_far(["-TERM", "-TERM"], [143, 143]);
    write_the_samples_so_far(["-HUP", "-TERM"], [129, 143]);
}

#[test]
fn a_signal_that_the_caller_ignores_is_ignored() {
    let folder = Folder::new();
    // As `nohup` does.
    let (child, lines) = started(&folder.path(""), "trap '' HUP;");
    kill(&child, ["-HUP", "-INT"]);
    assert!(lines.count() > 0);
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(130));
}
