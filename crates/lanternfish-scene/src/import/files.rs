//! Reading files whose names come from outside.

use std::io;
use std::path::Path;

/// The content of a regular file. Devices, pipes and folders are refused: they may have no end, or never answer.
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    // Asked before it is opened: opening a pipe waits for who writes to it.
    if !std::fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    std::fs::read(path)
}
