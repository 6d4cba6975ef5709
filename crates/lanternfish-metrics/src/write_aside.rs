//! Atomic file writes.

use std::{
    fs::{self, File, OpenOptions, Permissions},
    io::{self, BufWriter, Seek as _, Write as _},
    iter::successors,
    path::{Path, PathBuf},
    sync::{
        Mutex, MutexGuard, Once, PoisonError,
        atomic::{AtomicU32, Ordering},
    },
    time::Duration,
};

/// Writes a file at `path` atomically: `write` fills a temporary file in the same folder, which is then renamed.
///
/// The rename replaces an existing file and keeps its permissions. If anything fails, the existing file is unchanged and the
/// temporary file is removed. A symbolic link is followed: its target is replaced. Pipes, devices and the target of
/// `/dev/stdout` get the complete content at once, or nothing. An error if [`check_writable`] returns one.
pub fn write_aside<E: From<io::Error>>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), E> {
    match Destination::of(path)? {
        Destination::File { target, permissions } => {
            let (file, aside) = Aside::create_in(folder_of(&target))?;
            if let Some(permissions) = permissions {
                file.set_permissions(permissions)?;
            }
            let mut writer = BufWriter::new(file);
            write(&mut writer)?;
            writer.flush()?;
            // Without this, a crash of the machine after the rename could leave an empty file at the final path.
            writer.get_ref().sync_all()?;
            drop(writer);
            Ok(aside.rename(&target)?)
        }
        Destination::Stream => {
            let mut writer = BufWriter::new(tempfile::tempfile()?);
            write(&mut writer)?;
            let mut content = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
            content.rewind()?;
            io::copy(&mut content, &mut OpenOptions::new().append(true).open(path)?)?;
            Ok(())
        }
    }
}

/// Returns an error if [`write_aside`] cannot write to `path`, so that a caller can check before long work. Reasons: a folder, a
/// read-only file, a name that is too long, a parent folder that is missing or not writable. Leaves no file behind.
pub fn check_writable(path: &Path) -> io::Result<()> {
    match Destination::of(path)? {
        // Only an attempt reveals permissions, read-only disks and quotas.
        Destination::File { target, .. } => Aside::create_in(folder_of(&target)).map(drop),
        Destination::Stream => Ok(()),
    }
}

/// True if [`write_aside`] appends to `path` instead of replacing a file: a pipe, a device, or a file that this process inherited
/// open.
pub fn is_stream(path: &Path) -> bool {
    matches!(Destination::of(path), Ok(Destination::Stream))
}

/// The canonical path that [`write_aside`] writes to for `path`, with links resolved; the file need not exist. All names of a
/// file have the same destination. `None` if the parent folder does not exist.
pub fn destination(path: &Path) -> Option<PathBuf> {
    match path.canonicalize() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let target = links(path).last()?;
            Some(folder_of(&target).canonicalize().ok()?.join(target.file_name()?))
        }
        there => there.ok(),
    }
}

/// Removes every temporary file of [`write_aside`], and blocks it from creating or renaming others. For a process that was
/// asked to terminate, which must exit after this call.
pub fn remove_unfinished() {
    let unfinished = unfinished();
    for path in unfinished.iter() {
        // Best effort: nobody could handle the error.
        let _ = fs::remove_file(path);
    }
    // Keeps the lock, so that other threads wait for the end of the process.
    std::mem::forget(unfinished);
}

/// The target of a write.
enum Destination {
    /// A file's own path, with links resolved, and the permissions of an existing file.
    File { target: PathBuf, permissions: Option<Permissions> },
    /// A target that is appended to: a pipe, a device, a file that this process inherited open.
    Stream,
}

impl Destination {
    fn of(path: &Path) -> io::Result<Self> {
        let refused = |kind, what: &str| Err(io::Error::new(kind, what));
        // `name/` and `name/.` denote folders too, even if they do not exist.
        let bytes = path.as_os_str().as_encoded_bytes();
        if path.file_name().is_none_or(|name| !bytes.ends_with(name.as_encoded_bytes())) {
            return refused(io::ErrorKind::IsADirectory, "this is a folder");
        }
        match fs::metadata(path) {
            Ok(there) if there.is_dir() => refused(io::ErrorKind::IsADirectory, "this is a folder"),
            Ok(there) if there.permissions().readonly() => {
                refused(io::ErrorKind::PermissionDenied, "this file is read-only")
            }
            Ok(there) if !there.is_file() || is_given_open(path) => Ok(Self::Stream),
            Ok(there) => {
                // A rename succeeds even if the file is not writable.
                OpenOptions::new().write(true).open(path)?;
                Ok(Self::File { target: path.canonicalize()?, permissions: Some(there.permissions()) })
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let target = links(path).last().expect("at least the path itself");
                let folder = folder_of(&target);
                if !folder.is_dir() {
                    return refused(io::ErrorKind::NotFound, &format!("there is no folder {}", folder.display()));
                }
                Ok(Self::File { target, permissions: None })
            }
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => {
                refused(io::ErrorKind::NotFound, &format!("there is no folder {}", folder_of(path).display()))
            }
            Err(error) => Err(error),
        }
    }
}

/// A path, followed by the target of each symbolic link in its chain.
fn links(path: &Path) -> impl Iterator<Item = PathBuf> {
    // The system has followed them before, so the chain is finite.
    successors(Some(path.to_owned()), |path| Some(folder_of(path).join(fs::read_link(path).ok()?)))
}

/// True if the path leads through the process's open files, as `/dev/stdout` does.
fn is_given_open(path: &Path) -> bool {
    links(path).any(|link| {
        folder_of(&link).canonicalize().is_ok_and(|folder| folder.starts_with("/proc") || folder.starts_with("/dev/fd"))
    })
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Temporary files that are not yet renamed.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Age from which on a temporary file belongs to no process that still runs.
const OLD: Duration = Duration::from_secs(24 * 60 * 60);

/// Removes what killed processes left in a folder. Best effort: the write itself does not depend on it.
fn sweep(folder: &Path) {
    let is_ours = |name: &str| name.starts_with(".lanternfish-") && name.ends_with(".partial");
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let age = || entry.metadata().ok()?.modified().ok()?.elapsed().ok();
        if entry.file_name().to_str().is_some_and(is_ours) && age().is_some_and(|age| age > OLD) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// A temporary file in the target's folder, removed when dropped unless it was renamed.
struct Aside {
    path: PathBuf,
}

impl Aside {
    /// Creates a file with a short, unique name.
    fn create_in(folder: &Path) -> io::Result<(File, Self)> {
        static SERIAL: AtomicU32 = AtomicU32::new(0);
        // Once, since a folder may hold thousands of frames.
        static SWEPT: Once = Once::new();
        SWEPT.call_once(|| sweep(folder));
        let mut unfinished = unfinished();
        loop {
            let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!(".lanternfish-{}-{serial}.partial", std::process::id()));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => {
                    unfinished.push(path.clone());
                    return Ok((file, Self { path }));
                }
                // Left by a killed process with the same process id: try the next name.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => {
                    let what = format!("the folder {} cannot be written to ({error})", folder.display());
                    return Err(io::Error::new(error.kind(), what));
                }
            }
        }
    }

    fn rename(self, target: &Path) -> io::Result<()> {
        let mut unfinished = unfinished();
        fs::rename(&self.path, target)?;
        unfinished.retain(|path| *path != self.path);
        Ok(())
    }
}

impl Drop for Aside {
    fn drop(&mut self) {
        let mut unfinished = unfinished();
        // Only if it has not been renamed. Best effort: the error that led here is the one to report.
        if let Some(index) = unfinished.iter().position(|path| *path == self.path) {
            let _ = fs::remove_file(&self.path);
            unfinished.swap_remove(index);
        }
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
    fn the_file_is_replaced_and_no_temporary_file_remains() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rendering");
        for content in ["first", "second"] {
            write_aside(&path, |file| file.write_all(content.as_bytes())).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), content);
        }
        assert_eq!(files_in(folder.path()), ["rendering"]);
    }

    #[test]
    fn a_failed_write_leaves_the_existing_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rendering");
        let fail = |file: &mut BufWriter<File>| {
            file.write_all(b"half an im")?;
            Err(io::Error::other("the disk is full"))
        };
        assert_eq!(write_aside(&path, fail).unwrap_err().to_string(), "the disk is full");
        assert!(files_in(folder.path()).is_empty(), "left behind: {:?}", files_in(folder.path()));

        fs::write(&path, "complete").unwrap();
        write_aside(&path, fail).unwrap_err();
        assert_eq!(fs::read_to_string(&path).unwrap(), "complete");
        assert_eq!(files_in(folder.path()), ["rendering"]);
    }

    #[test]
    fn the_longest_valid_name_is_written() {
        let folder = tempfile::tempdir().unwrap();
        for length in [240, 255] {
            let path = folder.path().join("n".repeat(length));
            check_writable(&path).unwrap();
            write_aside(&path, |file| file.write_all(b"image")).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), "image");
        }
        let error = check_writable(&folder.path().join("n".repeat(256))).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidFilename, "{error}");
        assert_eq!(files_in(folder.path()).len(), 2);
    }

    #[test]
    fn unwritable_paths_are_refused_and_unchanged() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rendering");
        let refused = |path: &Path| {
            let before = check_writable(path).unwrap_err();
            let error = write_aside(path, |_| -> io::Result<()> { panic!("nothing is to be written") }).unwrap_err();
            assert_eq!(error.to_string(), before.to_string());
            error
        };
        fs::write(&path, "complete").unwrap();
        let permissions = fs::metadata(&path).unwrap().permissions();
        let mut read_only = permissions.clone();
        read_only.set_readonly(true);
        fs::set_permissions(&path, read_only).unwrap();
        assert!(refused(&path).to_string().contains("read-only"));
        fs::set_permissions(&path, permissions).unwrap();
        for name in ["missing/rendering", "rendering/rendering"] {
            let error = refused(&folder.path().join(name));
            assert_eq!(error.kind(), io::ErrorKind::NotFound, "{error}");
        }
        assert_eq!(refused(folder.path()).kind(), io::ErrorKind::IsADirectory);
        // These would otherwise fail only at the rename, after all the work.
        for name in ["new/", "new/.", "rendering/", "new//"] {
            let error = refused(&folder.path().join(name));
            assert_eq!(error.kind(), io::ErrorKind::IsADirectory, "{name}: {error}");
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), "complete");
        assert_eq!(files_in(folder.path()), ["rendering"]);
    }

    #[cfg(unix)]
    mod unix {
        use std::{
            os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink},
            process::Command,
            thread,
        };

        use super::*;

        #[test]
        fn a_link_is_followed_and_stays_a_link() {
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            fs::create_dir(path("disk")).unwrap();
            symlink("disk/rendering", path("link")).unwrap();
            symlink("link", path("link to a link")).unwrap();
            // Its target does not exist at first.
            for content in ["first", "second"] {
                check_writable(&path("link to a link")).unwrap();
                write_aside(&path("link to a link"), |file| file.write_all(content.as_bytes())).unwrap();
                assert_eq!(fs::read_to_string(path("disk/rendering")).unwrap(), content);
                assert!(!fs::symlink_metadata(path("disk/rendering")).unwrap().is_symlink());
            }
            for link in ["link", "link to a link"] {
                assert!(fs::symlink_metadata(path(link)).unwrap().is_symlink(), "{link}");
            }
            assert_eq!(files_in(&path("disk")), ["rendering"]);
            symlink("nowhere/rendering", path("astray")).unwrap();
            assert!(check_writable(&path("astray")).unwrap_err().to_string().contains("there is no folder"));
            symlink("cycle", path("cycle")).unwrap();
            check_writable(&path("cycle")).unwrap_err();
            assert_eq!(files_in(folder.path()), ["astray", "cycle", "disk", "link", "link to a link"]);
        }

        #[test]
        fn a_destination_has_one_name() {
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            fs::create_dir(path("disk")).unwrap();
            symlink("disk/rendering", path("link")).unwrap();
            symlink("cycle", path("cycle")).unwrap();
            for _ in 0..2 {
                let one = destination(&path("disk/rendering"));
                assert!(one.is_some() && destination(&path("link")) == one);
                assert_eq!(destination(&path("disk/../disk/rendering")), one);
                // In the second iteration it exists.
                fs::write(path("disk/rendering"), "rendering").unwrap();
            }
            assert_eq!((destination(&path("cycle")), destination(&path("nowhere/rendering"))), (None, None));
            assert!(is_stream(Path::new("/dev/null")) && !is_stream(&path("link")) && !is_stream(&path("new")));
        }

        #[test]
        fn a_replaced_file_keeps_its_permissions() {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("rendering");
            fs::write(&path, "before").unwrap();
            fs::set_permissions(&path, Permissions::from_mode(0o640)).unwrap();
            write_aside(&path, |file| file.write_all(b"rendering")).unwrap();
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
        }

        #[test]
        fn a_pipe_is_written_to_and_stays_a_pipe() {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("pipe");
            assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
            check_writable(&path).unwrap();
            let reader = thread::spawn({
                let path = path.clone();
                move || fs::read_to_string(path).unwrap()
            });
            let backwards = |file: &mut BufWriter<File>| {
                // Seeks as the EXR writer does.
                file.write_all(b"--age")?;
                file.rewind()?;
                file.write_all(b"im")
            };
            write_aside(&path, backwards).unwrap();
            assert_eq!(reader.join().unwrap(), "image");
            assert!(fs::symlink_metadata(&path).unwrap().file_type().is_fifo());
            assert_eq!(files_in(folder.path()), ["pipe"]);
        }

        #[test]
        fn a_device_is_written_to() {
            let null = Path::new("/dev/null");
            check_writable(null).unwrap();
            write_aside(null, |file| file.write_all(b"rendering")).unwrap();
            assert!(fs::symlink_metadata(null).unwrap().file_type().is_char_device());
        }
    }

    #[test]
    fn files_of_killed_processes_are_swept() {
        let folder = tempfile::tempdir().unwrap();
        let old = std::time::SystemTime::now() - 2 * OLD;
        for (name, is_old) in
            [(".lanternfish-1-0.partial", true), (".lanternfish-2-0.partial", false), ("a.partial", true)]
        {
            let file = File::create(folder.path().join(name)).unwrap();
            if is_old {
                file.set_modified(old).unwrap();
            }
        }
        sweep(folder.path());
        let left = |name| folder.path().join(name).exists();
        assert!(!left(".lanternfish-1-0.partial") && left(".lanternfish-2-0.partial") && left("a.partial"));
    }

    #[test]
    fn a_failed_rename_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rendering");
        let late = |_: &mut BufWriter<File>| fs::create_dir_all(path.join("a folder with something in it"));
        write_aside(&path, late).unwrap_err();
        assert_eq!(files_in(folder.path()), ["rendering"]);
    }
}
