//! Atomic file writes.

use std::{
    fs::{self, File, OpenOptions, Permissions},
    io::{self, BufWriter, ErrorKind, Write},
    iter::successors,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, Once, PoisonError},
};

use tempfile::{Builder, NamedTempFile};

/// Writes a file at `path` atomically: `write` fills a temporary file in the same folder, which is then renamed.
///
/// The rename replaces an existing file and keeps its permissions. If anything fails, the existing file is unchanged
/// and the temporary file is removed. A symbolic link is followed: its target is replaced. Pipes, devices and the
/// target of `/dev/stdout` get the complete content at once, or nothing. An error if [`check_writable`] returns one.
pub fn write_aside<E: From<io::Error>>(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<(), E> {
    let Some((target, permissions)) = replaced(path)? else {
        let mut content = Vec::new();
        write(&mut content)?;
        return Ok(OpenOptions::new().append(true).open(path)?.write_all(&content)?);
    };
    let mut unfinished = unfinished();
    let (file, aside) = create_in(folder_of(&target))?.into_parts();
    let name = aside.to_path_buf();
    unfinished.push(name.clone());
    drop(unfinished);
    let fill = move || -> Result<(), E> {
        permissions.map_or(Ok(()), |permissions| file.set_permissions(permissions))?;
        let mut writer = BufWriter::new(&file);
        write(&mut writer)?;
        writer.flush()?;
        // Without this, a crash of the machine after the rename could leave an empty file at the final path.
        Ok(file.sync_all()?)
    };
    let filled = fill();
    let mut unfinished = self::unfinished();
    let renamed = filled.and_then(|()| Ok(aside.persist(&target).map_err(|failed| failed.error)?));
    unfinished.retain(|path| *path != name);
    renamed
}

/// Returns an error if [`write_aside`] cannot write to `path`, so that a caller can check before long work. Reasons: a
/// folder, a read-only file, a name that is too long, a parent folder that is missing or not writable. Leaves no file.
pub fn check_writable(path: &Path) -> io::Result<()> {
    let Some((target, _)) = replaced(path)? else { return Ok(()) };
    let _unfinished = unfinished();
    // Only an attempt reveals permissions, read-only disks and quotas.
    create_in(folder_of(&target)).map(drop)
}

/// True if [`write_aside`] appends to `path` instead of replacing a file: a pipe, a device, or a file that this process
/// inherited open.
pub fn is_stream(path: &Path) -> bool {
    matches!(replaced(path), Ok(None))
}

/// The path that [`write_aside`] writes to for `path`, with links resolved; the file need not exist. All names of a
/// file have the same destination. `None` if the parent folder does not exist.
pub fn destination(path: &Path) -> Option<PathBuf> {
    let target = links(path).last()?;
    let folder = folder_of(&target).canonicalize().ok().filter(|folder| folder.is_dir())?;
    Some(folder.join(target.file_name()?))
}

/// Removes every temporary file of [`write_aside`], and blocks it from creating or renaming others. For a process that
/// was asked to terminate, which must exit after this call.
pub fn remove_unfinished() {
    let unfinished = unfinished();
    for path in unfinished.iter() {
        // Best effort: nobody could handle the error.
        let _ = fs::remove_file(path);
    }
    // Keeps the lock, so that other threads wait for the end of the process.
    std::mem::forget(unfinished);
}

/// Temporary files that are not yet renamed. Creating and renaming happen under its lock.
fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The file to replace, with links resolved, and its permissions if it exists. `None` for what is appended to: a pipe,
/// a device, a file that this process inherited open.
fn replaced(path: &Path) -> io::Result<Option<(PathBuf, Option<Permissions>)>> {
    let refused = |kind, what: &str| Err(io::Error::new(kind, what));
    // `name/` and `name/.` denote folders too, even if they do not exist.
    let bytes = path.as_os_str().as_encoded_bytes();
    if path.is_dir() || path.file_name().is_none_or(|name| !bytes.ends_with(name.as_encoded_bytes())) {
        return refused(ErrorKind::IsADirectory, "this is a folder");
    }
    let permissions = match fs::metadata(path) {
        Ok(there) if there.permissions().readonly() => {
            return refused(ErrorKind::PermissionDenied, "this file is read-only");
        }
        Ok(there) if !there.is_file() || is_given_open(path) => return Ok(None),
        // A rename would succeed even if the file is not writable.
        Ok(there) => OpenOptions::new().write(true).open(path).map(|_| Some(there.permissions()))?,
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => None,
        Err(error) => return Err(error),
    };
    if let Some(target) = destination(path) {
        return Ok(Some((target, permissions)));
    }
    let target = links(path).last().unwrap_or_default();
    refused(ErrorKind::NotFound, &format!("there is no folder {}", folder_of(&target).display()))
}

/// A path, followed by the target of each symbolic link in its chain, of which a system follows 40.
fn links(path: &Path) -> impl Iterator<Item = PathBuf> {
    successors(Some(path.to_owned()), |path| Some(folder_of(path).join(fs::read_link(path).ok()?))).take(41)
}

/// True if the path leads through the process's open files, as `/dev/stdout` does.
fn is_given_open(path: &Path) -> bool {
    let is_open = |folder: PathBuf| folder.starts_with("/proc") || folder.starts_with("/dev/fd");
    links(path).any(|link| folder_of(&link).canonicalize().is_ok_and(is_open))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

const PREFIX: &str = ".lanternfish-";
const SUFFIX: &str = ".partial";

/// Creates a temporary file with a short name, and the permissions of any new file.
fn create_in(folder: &Path) -> io::Result<NamedTempFile> {
    // Once, since a folder may hold thousands of frames.
    static SWEPT: Once = Once::new();
    SWEPT.call_once(|| sweep(folder));
    Builder::new().prefix(PREFIX).suffix(SUFFIX).make_in(folder, |path| File::create_new(path)).map_err(|error| {
        io::Error::new(error.kind(), format!("the folder {} cannot be written to ({error})", folder.display()))
    })
}

/// Removes what killed processes left in a folder a day ago. Best effort: the write itself does not depend on it.
fn sweep(folder: &Path) {
    let is_ours = |name: &str| name.starts_with(PREFIX) && name.ends_with(SUFFIX);
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let age = || entry.metadata().ok()?.modified().ok()?.elapsed().ok();
        if entry.file_name().to_str().is_some_and(is_ours) && age().is_some_and(|age| age.as_secs() > 24 * 60 * 60) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::{
        os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink},
        process::Command,
        thread,
        time::{Duration, SystemTime},
    };

    use super::*;

    /// An empty folder, and a file in it.
    fn place() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rendering");
        (folder, path)
    }

    fn files_in(folder: &Path) -> Vec<String> {
        let name = |entry: io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
        let mut names: Vec<_> = fs::read_dir(folder).unwrap().map(name).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_or_unchanged_and_keeps_its_permissions() {
        let (folder, path) = place();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let half = |file: &mut dyn Write| {
            file.write_all(b"half an im")?;
            Err(io::Error::other("the disk is full"))
        };
        write_aside(&path, half).unwrap_err();
        assert!(files_in(folder.path()).is_empty());
        for content in ["first", "second"] {
            write_aside(&path, |file| file.write_all(content.as_bytes())).unwrap();
            assert_eq!(write_aside(&path, half).unwrap_err().to_string(), "the disk is full");
            assert_eq!(fs::read_to_string(&path).unwrap(), content);
            let usual = folder.path().join("usual");
            fs::write(&usual, "").unwrap();
            assert_eq!(mode(&path), if content == "first" { mode(&usual) } else { 0o640 });
            fs::remove_file(usual).unwrap();
            fs::set_permissions(&path, Permissions::from_mode(0o640)).unwrap();
        }
        let late = |_: &mut dyn Write| {
            fs::remove_file(&path)?;
            fs::create_dir_all(path.join("a folder with something in it"))
        };
        write_aside(&path, late).unwrap_err();
        assert_eq!(files_in(folder.path()), ["rendering"]);
    }

    #[test]
    fn unwritable_paths_are_refused_and_unchanged() {
        let (folder, path) = place();
        fs::write(&path, "complete").unwrap();
        let refused = |name: &str, kind: ErrorKind, what: &str| {
            let path = folder.path().join(name);
            let before = check_writable(&path).unwrap_err();
            let error = write_aside(&path, |_| -> io::Result<()> { panic!("nothing is to be written") }).unwrap_err();
            assert_eq!((error.to_string(), error.kind()), (before.to_string(), kind), "{name}");
            assert!(before.to_string().contains(what), "{name}: {before}");
        };
        // Without a check, the last five would fail only at the rename, after all the work.
        for name in ["missing/rendering", "rendering/rendering"] {
            refused(name, ErrorKind::NotFound, "there is no folder");
        }
        for name in ["", "new/", "new/.", "rendering/", "new//"] {
            refused(name, ErrorKind::IsADirectory, "this is a folder");
        }
        refused(&"n".repeat(256), ErrorKind::InvalidFilename, "");
        fs::set_permissions(&path, Permissions::from_mode(0o400)).unwrap();
        refused("rendering", ErrorKind::PermissionDenied, "read-only");
        assert_eq!(fs::read_to_string(&path).unwrap(), "complete");
        let longest = folder.path().join("n".repeat(255));
        check_writable(&longest).unwrap();
        assert_eq!(files_in(folder.path()), ["rendering"]);
        write_aside(&longest, |file| file.write_all(b"image")).unwrap();
    }

    #[test]
    fn a_link_is_followed_and_stays_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("disk")).unwrap();
        for (target, link) in
            [("disk/rendering", "link"), ("link", "again"), ("nowhere/rendering", "astray"), ("cycle", "cycle")]
        {
            symlink(target, path(link)).unwrap();
        }
        // Its target does not exist at first.
        for content in ["first", "second"] {
            let one = destination(&path("disk/../disk/rendering"));
            assert!(one.is_some() && destination(&path("again")) == one);
            check_writable(&path("again")).unwrap();
            write_aside(&path("again"), |file| file.write_all(content.as_bytes())).unwrap();
            assert_eq!(fs::read_to_string(path("disk/rendering")).unwrap(), content);
        }
        assert!(["link", "again"].iter().all(|link| path(link).is_symlink()) && !path("disk/rendering").is_symlink());
        assert!(check_writable(&path("astray")).unwrap_err().to_string().contains("there is no folder"));
        check_writable(&path("cycle")).unwrap_err();
        assert_eq!(destination(&path("astray")), None);
        assert_eq!(files_in(folder.path()), ["again", "astray", "cycle", "disk", "link"]);
        assert_eq!(files_in(&path("disk")), ["rendering"]);
    }

    #[test]
    fn streams_get_the_complete_content() {
        let (folder, path) = place();
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        check_writable(&path).unwrap();
        let reader = thread::spawn({
            let path = path.clone();
            move || fs::read_to_string(path).unwrap()
        });
        write_aside(&path, |file| file.write_all(b"im").and_then(|()| file.write_all(b"age"))).unwrap();
        assert_eq!(reader.join().unwrap(), "image");
        assert!(fs::symlink_metadata(&path).unwrap().file_type().is_fifo() && is_stream(&path));
        assert_eq!(files_in(folder.path()), ["rendering"]);
        write_aside(Path::new("/dev/null"), |file| file.write_all(b"image")).unwrap();
        assert!(is_stream(Path::new("/dev/null")) && !is_stream(&folder.path().join("new")));
    }

    #[test]
    fn files_of_killed_processes_are_swept() {
        let (folder, _) = place();
        let old = SystemTime::now() - Duration::from_secs(2 * 24 * 60 * 60);
        for (name, age) in [(".lanternfish-1.partial", old), (".lanternfish-2.partial", SystemTime::now()), ("a", old)]
        {
            File::create(folder.path().join(name)).unwrap().set_modified(age).unwrap();
        }
        sweep(folder.path());
        assert_eq!(files_in(folder.path()), [".lanternfish-2.partial", "a"]);
    }
}
