//! Files that are whole or not there.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    sync::atomic::{AtomicU32, Ordering},
};

/// Puts a file at `path` that is whole or not there: `write` fills a file beside it, which is then renamed.
///
/// What stood at `path` before is replaced by the rename, and is untouched when anything fails; the file beside is then
/// removed. The folder must exist.
pub fn write_aside<E: From<io::Error>>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), E> {
    let (file, aside) = Aside::create_for(path)?;
    let mut writer = BufWriter::new(file);
    write(&mut writer)?;
    writer.flush()?;
    // Without this, a crash of the machine after the rename could leave an empty file under the final name.
    writer.get_ref().sync_all()?;
    drop(writer);
    fs::rename(&aside.path, path)?;
    Ok(())
}

/// A file beside the final one, removed when dropped unless it was renamed.
struct Aside {
    path: PathBuf,
}

impl Aside {
    /// A new file in the folder of `path`, with a name nobody else has.
    fn create_for(path: &Path) -> io::Result<(File, Self)> {
        static SERIAL: AtomicU32 = AtomicU32::new(0);
        let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not a file name"))?;
        loop {
            let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
            let mut aside = std::ffi::OsString::from(".");
            aside.push(name);
            aside.push(format!(".{}-{serial}.partial", std::process::id()));
            let aside = path.with_file_name(aside);
            match OpenOptions::new().write(true).create_new(true).open(&aside) {
                Ok(file) => return Ok((file, Self { path: aside })),
                // Left by a process of the same number that was killed: take the next name.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
    }
}

impl Drop for Aside {
    fn drop(&mut self) {
        // Best effort: the error that led here is the one to report.
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files_in(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn the_file_is_replaced_whole_and_nothing_else_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture");
        for content in ["first", "second"] {
            write_aside(&path, |file| file.write_all(content.as_bytes())).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), content);
        }
        assert_eq!(files_in(folder.path()), ["picture"]);
    }

    #[test]
    fn a_failed_write_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture");
        let fail = |file: &mut BufWriter<File>| {
            file.write_all(b"half a pict")?;
            Err(io::Error::other("the disk is full"))
        };
        assert_eq!(write_aside(&path, fail).unwrap_err().to_string(), "the disk is full");
        assert!(files_in(folder.path()).is_empty(), "left behind: {:?}", files_in(folder.path()));

        fs::write(&path, "whole").unwrap();
        write_aside(&path, fail).unwrap_err();
        assert_eq!(fs::read_to_string(&path).unwrap(), "whole");
        assert_eq!(files_in(folder.path()), ["picture"]);
    }

    #[test]
    fn a_failed_rename_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture");
        fs::create_dir_all(path.join("a folder with something in it")).unwrap();
        write_aside(&path, |file| file.write_all(b"picture")).unwrap_err();
        assert_eq!(files_in(folder.path()), ["picture"]);
    }
}
