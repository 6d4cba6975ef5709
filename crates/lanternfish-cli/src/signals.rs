//! Requests to end: Ctrl-C, the system's, those of a terminal that is gone.
//!
//! A signal ends the process at once, but for files that are half written: those are removed. A run that calls
//! [`end_when_requested`] hears the first in its own time, by [`requested`].

use std::{
    io,
    sync::{
        OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use lanternfish_metrics::remove_unfinished;

/// Who ends a program for another (`timeout`, `cargo run`) may signal it twice at once, by itself and with its group: what
/// comes so soon after the first is the first again.
const ECHO: Duration = Duration::from_millis(500);

/// True if the first signal waits for the run.
static ENDS_WHEN_REQUESTED: AtomicBool = AtomicBool::new(false);
/// When the first came, and its number.
static REQUESTED: OnceLock<(Instant, i32)> = OnceLock::new();

/// Starts to listen, in a thread of its own.
pub fn install() -> io::Result<()> {
    system::listen(hear)
}

/// From here on the first signal is told by [`requested`] and does nothing else; a second one ends the process.
pub fn end_when_requested() {
    ENDS_WHEN_REQUESTED.store(true, Ordering::Relaxed);
}

/// Whether somebody wants the run to end: what the process exits with then, as shells have it: 128 and the signal's number.
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
        // What the caller ignores stays ignored: `nohup`, and Ctrl-C where a script put the job in the background.
        let heard = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| !is_ignored(*signal));
        let mut signals = Signals::new(heard)?;
        thread::Builder::new().name("signals".to_owned()).spawn(move || signals.forever().for_each(hear))?;
        Ok(())
    }

    fn is_ignored(signal: i32) -> bool {
        let mut action = MaybeUninit::<libc::sigaction>::zeroed();
        // Safety: without a new action, the call only fills the one it is given, for which zeros are a value too.
        unsafe {
            libc::sigaction(signal, ptr::null(), action.as_mut_ptr()) == 0
                && action.assume_init().sa_sigaction == libc::SIG_IGN
        }
    }

    /// Ends the process as the signal would have: who waits for it, a shell's loop, learns that it was the signal.
    pub fn end_by(signal: i32) {
        if emulate_default_handler(signal).is_err() {
            std::process::exit(128 + signal);
        }
    }
}

#[cfg(not(unix))]
mod system {
    use std::io;

    /// What Ctrl-C is elsewhere.
    const SIGINT: i32 = 2;

    pub fn listen(hear: fn(i32)) -> io::Result<()> {
        ctrlc::set_handler(move || hear(SIGINT)).map_err(io::Error::other)
    }

    pub fn end_by(signal: i32) {
        std::process::exit(128 + signal);
    }
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

    /// The process that is signalled: writes half a file, says so, and waits for ever.
    #[test]
    #[ignore = "only as a child of the test below"]
    fn child() {
        let Some(folder) = env::var_os(FOLDER) else { return };
        install().unwrap();
        let write = |file: &mut io::BufWriter<fs::File>| {
            file.write_all(b"half a pict")?;
            file.flush()?;
            println!("\nhalf written");
            // Standard input stays open for as long as the parent lives.
            io::stdin().read_exact(&mut [0])
        };
        lanternfish_metrics::write_aside(&Path::new(&folder).join("rendering"), write).unwrap();
    }

    #[test]
    fn a_signal_amid_a_write_leaves_what_was_there_and_nothing_else() {
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
            // Who starts the tests in the background may have had the signal ignored, which processes inherit.
            let heed_signal = move || {
                // SAFETY: async-signal-safe, with a handler that the system itself has.
                unsafe { libc::signal(signal, libc::SIG_DFL) };
                Ok(())
            };
            // SAFETY: the closure allocates nothing and takes no lock.
            unsafe { command.pre_exec(heed_signal) };
            let mut child = command.spawn().unwrap();
            let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
            assert!(lines.any(|line| line.unwrap() == "half written"), "the child ended early");
            assert_eq!(names(), 2, "the file and what is written beside it");
            // The shell's own: a bare machine has no program of that name.
            let kill = Command::new("sh").args(["-c", &format!("kill -{signal} {}", child.id())]).status();
            assert!(kill.unwrap().success());
            // Not wait(), which would close standard input first.
            let rest = lines.count();
            assert_eq!(child.wait().unwrap().signal(), Some(signal), "{rest} more lines");
            assert_eq!(names(), 1);
            assert_eq!(fs::read_to_string(folder.path().join("rendering")).unwrap(), "whole");
        }
    }
}
