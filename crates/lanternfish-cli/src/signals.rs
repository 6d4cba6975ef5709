//! Signals that request termination: Ctrl-C, the system's, and that of a closed terminal.
//!
//! A signal ends the process at once, after half-written files are removed. A run that calls [`end_when_requested`]
//! checks [`requested`] instead and ends in its own time after the first signal.

use std::{
    io,
    sync::{
        OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use lanternfish_metrics::remove_unfinished;

/// Programs that end another (`timeout`, `cargo run`) may signal it twice at once, directly and through its group. A
/// signal within this time after the first counts as the same.
const ECHO: Duration = Duration::from_millis(500);

/// True if the first signal waits for the run.
static ENDS_WHEN_REQUESTED: AtomicBool = AtomicBool::new(false);
/// Time and number of the first signal.
static REQUESTED: OnceLock<(Instant, i32)> = OnceLock::new();

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
    // By the signal itself, so that the parent, such as a shell's loop, learns the cause.
    #[cfg(unix)]
    let _ = signal_hook::low_level::emulate_default_handler(signal);
    std::process::exit(128 + signal);
}

/// Starts to listen, in a separate thread.
#[cfg(unix)]
pub fn listen() -> io::Result<()> {
    use signal_hook::{
        consts::{SIGHUP, SIGINT, SIGTERM},
        iterator::Signals,
    };
    let is_ignored = |signal: &i32| {
        let mut action = std::mem::MaybeUninit::<libc::sigaction>::zeroed();
        // SAFETY: without a new action, the call only fills the one it is given, for which zeros are a valid value.
        unsafe {
            libc::sigaction(*signal, std::ptr::null(), action.as_mut_ptr()) == 0
                && action.assume_init().sa_sigaction == libc::SIG_IGN
        }
    };
    // Signals that the caller ignores stay ignored: `nohup`, and Ctrl-C for background jobs of a script.
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| !is_ignored(signal)))?;
    std::thread::Builder::new().name("signals".to_owned()).spawn(move || signals.forever().for_each(hear))?;
    Ok(())
}

#[cfg(windows)]
pub fn listen() -> io::Result<()> {
    // Number of Ctrl-C on other systems.
    ctrlc::set_handler(|| hear(2)).map_err(io::Error::other)
}

/// A browser has no signals.
#[cfg(not(any(unix, windows)))]
pub fn listen() -> io::Result<()> {
    let _ = hear;
    Ok(())
}

#[cfg(all(test, unix))]
mod tests {
    use std::{
        env, fs,
        io::{BufRead as _, BufReader, Read as _},
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
        listen().unwrap();
        let write = |file: &mut dyn io::Write| {
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
            command.args(["--exact", "signals::tests::child", "--ignored", "--nocapture"]).env(FOLDER, folder.path());
            // A caller that starts the tests in the background may ignore the signal, which processes inherit.
            let heed_signal = move || {
                // SAFETY: async-signal-safe, with the system's default handler.
                unsafe { libc::signal(signal, libc::SIG_DFL) };
                Ok(())
            };
            // SAFETY: the closure allocates nothing and takes no lock.
            unsafe { command.pre_exec(heed_signal) };
            let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
            let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
            assert!(lines.any(|line| line.unwrap() == "half written"), "the child ended early");
            assert_eq!(names(), 2, "the file and the temporary file beside it");
            // SAFETY: a signal to a process that has not been waited for.
            assert_eq!(unsafe { libc::kill(child.id() as i32, signal) }, 0);
            // Do not call wait() first, which closes standard input.
            let rest = lines.count();
            assert_eq!(child.wait().unwrap().signal(), Some(signal), "{rest} more lines");
            assert_eq!(names(), 1);
            assert_eq!(fs::read_to_string(folder.path().join("rendering")).unwrap(), "whole");
        }
    }
}
