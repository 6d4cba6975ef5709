//! A memory budget that is checked before allocation: a header of a few bytes can claim any amount, and the system kills a
//! process that exceeds its memory without a message.

use std::{
    fmt,
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

use crate::machine;

/// Memory limit of the process, bytes; 0: no limit was set.
static LIMIT: AtomicU64 = AtomicU64::new(0);

/// Limits the memory of this process to `bytes`: larger requests are refused. Without a limit, the bound is the free memory at
/// the time of the request: the available memory, or the rest of the control group or address space if that is less (Linux;
/// 16 GB on other systems).
pub fn set_limit(bytes: u64) {
    LIMIT.store(bytes.max(1), Relaxed);
}

/// More memory is needed than is free.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} {} of memory, {}", Bytes(*.needed), Rest(*.free, *.limit))]
pub struct TooMuch {
    /// Subject and verb of the message: "3 images need".
    pub what: String,
    /// Bytes needed.
    pub needed: u64,
    /// Bytes free.
    pub free: u64,
    /// The limit that was set, bytes; `None`: the bound is the machine's free memory.
    pub limit: Option<u64>,
}

/// A budget from which allocations are reserved before they are made.
#[derive(Debug)]
#[doc(hidden)]
pub struct Budget {
    free: u64,
    limit: Option<u64>,
    taken: AtomicU64,
    /// Most bytes by what was read; `u64::MAX`: it does not matter.
    proportionate: AtomicU64,
}

/// Bytes that the content of a file may take if no limit was set, and further bytes for each that was read: more than any honest image, whose
/// plain areas take hundreds of bytes for one, and less than what a file made for it claims.
const ANY_FILE: u64 = 2 << 30;
const PER_BYTE: u64 = 256;

impl Budget {
    /// The memory that this process may still allocate: the rest of the [limit](set_limit), or the machine's free memory.
    pub fn of_process() -> Self {
        let limit = Some(LIMIT.load(Relaxed)).filter(|limit| *limit > 0);
        let free = match limit {
            Some(limit) => limit.saturating_sub(machine::used().unwrap_or(0)),
            None => machine::free().unwrap_or(16_000_000_000),
        };
        Self { free, limit, taken: AtomicU64::new(0), proportionate: AtomicU64::new(u64::MAX) }
    }

    /// As [`Self::of_process`], and without a limit in proportion to what is [read](Self::read).
    pub fn of_file() -> Self {
        let budget = Self::of_process();
        let most = if budget.limit.is_none() { ANY_FILE } else { u64::MAX };
        Self { proportionate: AtomicU64::new(most), ..budget }
    }

    /// Reserves the bytes of a file that is read.
    pub fn read(&self, bytes: u64, what: impl FnOnce() -> String) -> Result<(), TooMuch> {
        let more = |most: u64| Some(most.saturating_add(bytes.saturating_mul(PER_BYTE)));
        let _ = self.proportionate.fetch_update(Relaxed, Relaxed, more);
        self.take(bytes, what)
    }

    /// A budget of `bytes`, whatever the process uses already.
    pub fn of(bytes: u64) -> Self {
        let (taken, proportionate) = (AtomicU64::new(0), AtomicU64::new(u64::MAX));
        Self { free: bytes, limit: Some(bytes), taken, proportionate }
    }

    /// Reserves `bytes` permanently; an error if fewer are free. `what` is subject and verb of the message: "3 images need".
    pub fn take(&self, bytes: u64, what: impl FnOnce() -> String) -> Result<(), TooMuch> {
        let (most, limit) = self.most();
        let add = |taken: u64| taken.checked_add(bytes).filter(|taken| *taken <= most);
        match self.taken.fetch_update(Relaxed, Relaxed, add) {
            Ok(_) => Ok(()),
            Err(taken) => {
                let free = most.saturating_sub(taken);
                Err(TooMuch { what: what(), needed: bytes, free, limit })
            }
        }
    }

    /// Returns an error if fewer than `bytes` are free; reserves nothing.
    pub fn check(&self, bytes: u64, what: impl FnOnce() -> String) -> Result<(), TooMuch> {
        let (most, limit) = self.most();
        let free = most.saturating_sub(self.taken.load(Relaxed));
        if bytes <= free { Ok(()) } else { Err(TooMuch { what: what(), needed: bytes, free, limit }) }
    }

    /// Most bytes to take in all, and the limit that this is.
    fn most(&self) -> (u64, Option<u64>) {
        match self.proportionate.load(Relaxed) {
            most if most < self.free => (most, Some(most)),
            _ => (self.free, self.limit),
        }
    }
}

/// Formats a byte count as `6.7 GB`.
struct Bytes(u64);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 as f64 {
            bytes if bytes >= 1e9 => write!(f, "{:.1} GB", bytes / 1e9),
            bytes if bytes >= 1e6 => write!(f, "{:.1} MB", bytes / 1e6),
            bytes => write!(f, "{:.1} kB", bytes / 1e3),
        }
    }
}

/// Bytes free, and the limit that they are the rest of.
struct Rest(u64, Option<u64>);

impl fmt::Display for Rest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.1 {
            Some(limit) => write!(f, "the limit is {}, of which {} are left", Bytes(limit), Bytes(self.0)),
            None => write!(f, "and {} are free", Bytes(self.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without a limit a file of a few bytes takes 2 GiB at most, and a large one more.
    #[test]
    fn a_files_content_is_in_proportion_to_its_size() {
        let budget = Budget { free: u64::MAX, ..Budget::of_file() };
        let take = |bytes| budget.take(bytes, || "an image needs".to_owned());
        budget.read(1000, String::new).unwrap();
        let error = take(3 << 30).unwrap_err();
        assert!(
            error.limit.is_some_and(|limit| limit >> 30 == 2) && error.to_string().contains("the limit is 2.1 GB"),
            "{error}"
        );
        budget.read(10 << 20, String::new).unwrap();
        take(3 << 30).unwrap();
    }

    #[test]
    fn reserved_memory_is_not_free() {
        let budget = Budget::of(10_000_000);
        assert!(budget.take(6_000_000, || unreachable!("it is free")).is_ok());
        assert!(budget.check(4_000_000, || unreachable!("it is free")).is_ok());
        let error = budget.take(4_100_000, || "3 images need".to_owned()).unwrap_err();
        assert_eq!(error.to_string(), "3 images need 4.1 MB of memory, the limit is 10.0 MB, of which 4.0 MB are left");
        assert!(budget.take(4_000_000, String::new).is_ok() && budget.take(1, String::new).is_err());
        assert!(Budget::of(u64::MAX).take(u64::MAX, String::new).is_ok());
        let twice = Budget::of(u64::MAX);
        assert!(twice.take(u64::MAX, String::new).is_ok() && twice.take(u64::MAX, String::new).is_err());
    }

    #[test]
    fn the_machine_has_a_finite_amount() {
        let machine = Budget::of_process();
        assert!(machine.check(1_000_000, || "a megabyte needs".to_owned()).is_ok());
        let error = machine.take(1 << 60, || "everything needs".to_owned()).unwrap_err();
        assert_eq!((error.needed, error.limit), (1 << 60, None));
        assert!(error.to_string().ends_with("are free"), "{error}");
    }
}
