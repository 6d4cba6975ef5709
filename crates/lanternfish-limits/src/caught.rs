//! Panics as errors.

use std::{
    cell::Cell,
    panic::{self, AssertUnwindSafe},
    sync::Once,
};

thread_local! {
    /// True while panics of this thread are caught and returned as errors.
    static CATCHES: Cell<bool> = const { Cell::new(false) };
}

/// Runs `work` and returns its result, or the message of its panic as an error. Meant for third-party decoders of untrusted
/// bytes: a panic there is a fault of the input.
///
/// The panic is not printed. The first call installs a panic hook that skips the program's hook within `work` on this thread. A
/// hook that the program sets later prints the panic. After a panic, do not use anything that `work` modifies.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !CATCHES.get() {
                before(info);
            }
        }));
    });
    let outer = CATCHES.replace(true);
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    CATCHES.set(outer);
    result.map_err(|payload| {
        let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
        format!("its decoder failed: {}", text.as_deref().unwrap_or("no message"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error_and_the_next_call_works() {
        assert_eq!(caught(|| 7), Ok(7));
        let zero = std::hint::black_box(0);
        assert!(caught(|| 1 / zero).unwrap_err().contains("divide by zero"));
        assert!(caught(|| panic!("byte {}", 5)).unwrap_err().ends_with("byte 5"));
        let inner = caught(|| (caught(|| panic!("inside")).unwrap_err(), CATCHES.get())).unwrap();
        assert!(inner.0.contains("inside") && inner.1, "an inner call leaves the outer one active");
        assert!(!CATCHES.get());
    }
}
