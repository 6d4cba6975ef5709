//! Panics as errors.

use std::{
    cell::Cell,
    panic::{self, AssertUnwindSafe},
    sync::Once,
};

thread_local! {
    /// True if a panic of this thread is caught and told as an error.
    static CATCHES: Cell<bool> = const { Cell::new(false) };
}

/// What `work` returns, or the message of its panic. For the code of others that reads bytes from outside: what it would end
/// the program with is a fault of these bytes.
///
/// The panic is not printed: the first call puts a hook before the program's own, which is left out within `work`, on this
/// thread. A hook that the program sets later prints it. Nothing that `work` had begun to change may be used after a panic.
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
        format!("its reader gives up: {}", text.as_deref().unwrap_or("it does not say why"))
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
        assert!(inner.0.contains("inside") && inner.1, "one within another leaves the outer one on");
        assert!(!CATCHES.get());
    }
}
