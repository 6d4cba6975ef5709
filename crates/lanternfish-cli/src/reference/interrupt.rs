//! Ctrl-C: the first asks to stop, the second stops.

use std::{
    sync::{Mutex, MutexGuard, OnceLock, PoisonError},
    time::{Duration, Instant},
};

use crate::error::CliError;

/// What a shell gives a program that Ctrl-C ended: 128 and the signal's number.
pub const EXIT: u8 = 130;

/// Who ends a program for another (`timeout`, `cargo run`) may signal it twice at once, by itself and with its group: what
/// comes so soon after the first is the first again.
const ECHO: Duration = Duration::from_millis(500);

/// When somebody first did.
static ASKED: OnceLock<Instant> = OnceLock::new();
static WRITING: Mutex<()> = Mutex::new(());

/// From here on Ctrl-C, and a polite request of the system to end, are heard by [`asked`]; a second one ends the process,
/// though not within [`while_writing`].
pub fn install() -> Result<(), CliError> {
    ctrlc::set_handler(|| {
        if ASKED.get_or_init(Instant::now).elapsed() > ECHO {
            let _whole = lock();
            std::process::exit(EXIT.into());
        }
    })
    .map_err(|error| CliError::new(format_args!("signals cannot be listened to: {error}"), ""))
}

/// Whether somebody wants the run to end.
pub fn asked() -> bool {
    ASKED.get().is_some()
}

/// Work that leaves parts of files if it is cut off.
pub fn while_writing<T>(work: impl FnOnce() -> T) -> T {
    let _whole = lock();
    work()
}

fn lock() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}
