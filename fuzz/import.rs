//! Fuzz target: loads arbitrary bytes as a scene file.

#![no_main]

mod harness;

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;

static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a folder"));

fuzz_target!(|bytes: &[u8]| {
    harness::Harness::new(FOLDER.path()).check(bytes, harness::ending(bytes));
});
