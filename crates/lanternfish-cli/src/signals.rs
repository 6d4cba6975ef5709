//! Signals that request termination: Ctrl-C, the system's, and that of a closed terminal.
//!
//! A signal ends the process at once, after half-written files are removed. A run that calls [`end_when_requested`] checks
//! [`requested`] instead and ends in its own time after the first signal.

use std::{
    io,
    sync::{
        OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use lanternfish_metrics::remove_unfinished;

/// Programs that end another (`timeout`, `cargo run`) may signal it twice at once, directly and through its group. A signal
/// within this time after the first counts as the same.
const ECHO: Duration = Duration::from_millis(500);

/// True if the first signal waits for the run.
static ENDS_WHEN_REQUESTED: AtomicBool = AtomicBool::new(false);
/// Time and number of the first signal.
static REQUESTED: OnceLock<(Instant, i32)> = OnceLock::new();

/// Starts to listen, in a separate thread.
pub fn install() -> io::Result<()> {
    system::listen(hear)
}

/// From now on the first signal only sets [`requested`]; a second one ends the process.
pub fn end_when_requested() {
    ENDS_WHEN_REQUESTED.store(true, Ordering::Relaxed);
}

/// The exit code if the run is requested to end, as in shells: 128 plus the signal's number.
pub fn requested() -> Option<u8> {
    REQUESTED.get().map(|(_, signal)| 128 + *signal as u8)
}

fn hear(signal: i32) {
    let first = || REQUESTED.get_or_init(|| (Instant::now(), signal)).0;
    if ENDS_WHEN_REQUESTED.load(Ordering::Relaxed) && first().elapsed() <= ECHO {
        return;
    }
    remove_unfinished();
    system::end_by(signal);
}

#[cfg(unix)]
mod system {
    use std::{io, mem::MaybeUninit, ptr, thread};

    use signal_hook::{
        consts::{SIGHUP, SIGINT, SIGTERM},
        iterator::Signals,
        low_level::emulate_default_handler,
    };

    pub fn listen(hear: fn(i32)) -> io::Result<()> {
        // Signals that the caller ignores stay ignored: `nohup`, and Ctrl-C for background jobs of a script.
        let heard = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| !is_ignored(*signal));
        let mut signals = Signals::new(heard)?;
        thread::Builder::new().name("signals".to_owned()).spawn(move || signals.forever().for_each(hear))?;
        Ok(())
    }

    fn is_ignored(signal: i32) -> bool {
        let mut action = MaybeUninit::<libc::sigaction>::zeroed();
        // SAFETY: without a new action, the call only fills the one it is given, for which zeros are a valid value.
        unsafe {
            libc::sigaction(signal, ptr::null(), action.as_mut_ptr()) == 0
                && action.assume_init().sa_sigaction == libc::SIG_IGN
        }
    }

    /// Ends the process by the signal itself, so that its parent, such as a shell's loop, learns the cause.
    pub fn end_by(signal: i32) {
        if emulate_default_handler(signal).is_err() {
            std::process::exit(128 + signal);
        }
    }
}

#[cfg(windows)]
mod system {
    use std::io;

    /// Number of Ctrl-C on other systems.
    const SIGINT: i32 = 2;

    pub fn listen(hear: fn(i32)) -> io::Result<()> {
        ctrlc::set_handler(move || hear(SIGINT)).map_err(io::Error::other)
    }

    pub fn end_by(signal: i32) {
        std::process::exit(128 + signal);
    }
}

/// A browser has no signals.
#[cfg(not(any(unix, windows)))]
mod system {
    pub fn listen(_: fn(i32)) -> std::io::Result<()> {
        Ok(())
    }

    pub fn end_by(_: i32) {}
}

#[cfg(all(test, unix))]
mod tests {
    use std::{
        env, fs,
        io::{BufRead as _, BufReader, Read as _, Write as _},
        os::unix::process::{CommandExt as _, ExitStatusExt as _},
        path::Path,
        process::{Command, Stdio},
    };

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

    use super::*;

    const FOLDER: &str = "LANTERNFISH_TEST_FOLDER";

    /// The child process: writes half a file, reports that, and waits forever.
    #[test]
    #[ignore = "only as a child of the test below"]
    fn child() {
        let Some(folder) = env::var_os(FOLDER) else { return };
        install().unwrap();
        let write = |file: &mut io::BufWriter<fs::File>| {
            file.write_all(b"half a pict")?;
            file.flush()?;
            println!("\nhalf written");
            // Standard input stays open while the parent lives.
            io::stdin().read_exact(&mut [0])
        };
        lanternfish_metrics::write_aside(&Path::new(&folder).join("rendering"), write).unwrap();
    }

    #[test]
    fn a_signal_during_a_write_leaves_the_old_file_only() {
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            let folder = tempfile::tempdir().unwrap();
            fs::write(folder.path().join("rendering"), "whole").unwrap();
            let names = || fs::read_dir(folder.path()).unwrap().count();
            let mut command = Command::new(env::current_exe().unwrap());
            command
                .args(["--exact", "signals::tests::child", "--ignored", "--nocapture"])
                .env(FOLDER, folder.path())
                .stdin(Stdio::piped())
                .stdout(Stdio::piped());
            // A caller that starts the tests in the background may ignore the signal, which processes inherit.
            let heed_signal = move || {
                // SAFETY: async-signal-safe, with the system's default handler.
                unsafe { libc::signal(signal, libc::SIG_DFL) };
                Ok(())
            };
            // SAFETY: the closure allocates nothing and takes no lock.
            unsafe { command.pre_exec(heed_signal) };
            let mut child = command.spawn().unwrap();
            let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
            assert!(lines.any(|line| line.unwrap() == "half written"), "the child ended early");
            assert_eq!(names(), 2, "the file and the temporary file beside it");
            // Use the shell's built-in kill: a minimal machine has no such program.
            let kill = Command::new("sh").args(["-c", &format!("kill -{signal} {}", child.id())]).status();
            assert!(kill.unwrap().success());
            // Do not call wait() first, which closes standard input.
            let rest = lines.count();
            assert_eq!(child.wait().unwrap().signal(), Some(signal), "{rest} more lines");
            assert_eq!(names(), 1);
            assert_eq!(fs::read_to_string(folder.path().join("rendering")).unwrap(), "whole");
        }
    }
}
