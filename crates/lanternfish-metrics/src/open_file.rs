//! Opens files for reading.

use std::{
    fs::{self, File},
    io,
    path::Path,
};

/// Opens a file for reading. Pipes and devices are refused: they may have no end, and opening one may block forever.
pub fn open_file(path: &Path) -> io::Result<File> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "this is a folder, a pipe or a device, not a file"));
    }
    File::open(path)
}
