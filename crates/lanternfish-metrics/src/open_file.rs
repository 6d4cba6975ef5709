//! Opening files to read.

use std::{
    fs::{self, File},
    io,
    path::Path,
};

/// Opens a file; pipes and devices are refused, which may have no end, and on which even opening may never return.
pub fn open_file(path: &Path) -> io::Result<File> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "this is a folder, a pipe or a device, not a file"));
    }
    File::open(path)
}
