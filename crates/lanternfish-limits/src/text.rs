//! Texts of files that a user names.

use std::{fs, io, io::Read as _, path::Path};

/// Largest text, bytes.
const MOST: u64 = 64 << 20;

/// Reads a file in UTF-8 of at most 64 MiB. Pipes and devices are errors: they may be endless, or never answer.
pub fn read_text(path: &Path) -> io::Result<String> {
    let refused = |what: &str| Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    let size = fs::metadata(path)?;
    if !size.is_file() {
        return refused("this is no file");
    }
    let mut text = String::new();
    fs::File::open(path)?.take(MOST + 1).read_to_string(&mut text)?;
    if text.len() as u64 > MOST { refused("it is larger than 64 MiB") } else { Ok(text) }
}

#[cfg(test)]
#[test]
fn only_files_of_bounded_size_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("text");
    fs::write(&path, "größe").unwrap();
    assert_eq!(read_text(&path).unwrap(), "größe");
    fs::File::create(&path).unwrap().set_len(MOST + 1).unwrap();
    assert!(read_text(&path).unwrap_err().to_string().contains("64 MiB"));
    assert!(read_text(folder.path()).is_err() && read_text(&folder.path().join("none")).is_err());
    assert!(!Path::new("/dev/zero").exists() || read_text(Path::new("/dev/zero")).is_err());
}
