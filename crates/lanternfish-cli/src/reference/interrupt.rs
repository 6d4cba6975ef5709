//! Ctrl-C: the first asks to stop, the second stops.

use std::sync::{
    Mutex, MutexGuard, PoisonError,
    atomic::{AtomicBool, Ordering},
};

use crate::error::CliError;

/// What a shell gives a program that Ctrl-C ended: 128 and the signal's number.
pub const EXIT: u8 = 130;

static ASKED: AtomicBool = AtomicBool::new(false);
static WRITING: Mutex<()> = Mutex::new(());

/// From here on Ctrl-C, and a polite request of the system to end, are heard by [`asked`]; a second one ends the process,
/// though not within [`while_writing`].
pub fn install() -> Result<(), CliError> {
    ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::SeqCst) {
            let _whole = lock();
            std::process::exit(EXIT.into());
        }
    })
    .map_err(|error| CliError::new(format_args!("signals cannot be listened to: {error}"), ""))
}

/// Whether somebody wants the run to end.
pub fn asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}

/// Work that leaves parts of files if it is cut off.
pub fn while_writing<T>(work: impl FnOnce() -> T) -> T {
    let _whole = lock();
    work()
}

fn lock() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}
