//! Reading files whose paths come from scene files or the user.

use std::cell::RefCell;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use lanternfish_limits::memory::{Budget, TooMuch};

use super::LoadOptions;
use crate::SceneError;

/// Why a file is not read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FileError {
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error(transparent)]
    TooMuch(#[from] TooMuch),
    /// The file is outside the scene's folder, and reading is confined to that folder.
    #[error("not within the scene's folder, and no other is read")]
    Outside,
}

impl FileError {
    /// The error for the file at `path`.
    pub fn at(self, path: &Path) -> SceneError {
        let path = path.to_owned();
        match self {
            Self::Io(source) => SceneError::Io { path, source },
            Self::TooMuch(need) => SceneError::TooMuch { path, need },
            Self::Outside => SceneError::Outside { path },
        }
    }
}

/// Reads the files of a scene: holds the scene's folder, the confinement and the memory budget.
pub(crate) struct Files<'a> {
    pub budget: &'a Budget,
    folder: PathBuf,
    /// The only files that exist, if they are in memory.
    held: Option<&'a Held>,
    /// Folder (links resolved) that must contain every file; `None`: files may be anywhere.
    confined_to: Option<PathBuf>,
}

/// Files in memory, by their paths.
pub(crate) type Held = [(PathBuf, Vec<u8>)];

thread_local! {
    static HELD: RefCell<Rc<Held>> = RefCell::new(Rc::new([]));
}

/// Files that a thread reads in place of those on disk, if there are any, from now on: a browser has no disk. They are found as by
/// [`load_files`](crate::load_files).
#[doc(hidden)]
pub fn hold_files(files: Vec<(PathBuf, Vec<u8>)>) {
    HELD.set(files.into());
}

/// The files that this thread holds.
pub(super) fn held() -> Option<Rc<Held>> {
    HELD.with_borrow(|files| (!files.is_empty()).then(|| files.clone()))
}

impl<'a> Files<'a> {
    /// The files of the scene at `path`: those that are held, or on disk. An error if `options` confine them to its folder and that cannot be resolved.
    pub fn beside(
        path: &Path,
        options: &LoadOptions,
        held: Option<&'a Held>,
        budget: &'a Budget,
    ) -> Result<Self, SceneError> {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let real = || if folder.as_os_str().is_empty() { Path::new(".") } else { &folder }.canonicalize();
        let confined_to = (options.confine && held.is_none())
            .then(real)
            .transpose()
            .map_err(|error| FileError::Io(error).at(path))?;
        Ok(Self { budget, folder, held, confined_to })
    }

    /// The content of the scene file itself.
    pub fn scene(&self, path: &Path) -> Result<Vec<u8>, SceneError> {
        self.open(path).map_err(|error| error.at(path))
    }

    /// Path of a file that the scene names.
    pub fn path(&self, name: &Path) -> PathBuf {
        self.folder.join(name)
    }

    /// True if there is a file that the scene might name.
    pub fn has(&self, name: &Path) -> bool {
        let path = self.path(name);
        self.held.map_or_else(|| path.is_file(), |held| find(held, &path).is_some())
    }

    /// The content of a file that the scene names. Absolute paths are refused.
    pub fn named(&self, name: &Path) -> Result<Vec<u8>, FileError> {
        let mut depth = 0i64;
        for component in name.components() {
            match component {
                Component::Prefix(_) | Component::RootDir => {
                    let what = "not a path relative to the scene's";
                    return Err(io::Error::new(io::ErrorKind::InvalidInput, what).into());
                }
                Component::Normal(_) => depth += 1,
                Component::ParentDir => depth -= 1,
                Component::CurDir => {}
            }
            // Checked before any file access, so that the error does not reveal whether the file exists.
            if depth < 0 && self.confined_to.is_some() {
                return Err(FileError::Outside);
            }
        }
        self.open(&self.path(name))
    }

    /// The content of a regular file. Devices, pipes and folders are refused: they may be endless or block forever.
    fn open(&self, path: &Path) -> Result<Vec<u8>, FileError> {
        let name = || format!("{} needs", path.file_name().unwrap_or(path.as_os_str()).display());
        if let Some(held) = self.held {
            let bytes = find(held, path).ok_or(io::Error::from(io::ErrorKind::NotFound))?;
            self.budget.read(bytes.len() as u64, name)?;
            return Ok(bytes.to_vec());
        }
        let file = match &self.confined_to {
            None => open_regular(path)?,
            Some(folder) => {
                let real = path.canonicalize().map_err(|error| unresolved(path, folder, error))?;
                if !real.starts_with(folder) {
                    return Err(FileError::Outside);
                }
                let file = open_regular(&real)?;
                // A folder may have been replaced by a link since the check.
                if opened_path(&file).unwrap_or(real).starts_with(folder) {
                    file
                } else {
                    return Err(FileError::Outside);
                }
            }
        };
        let length = file.metadata()?.len();
        self.budget.read(length, name)?;
        let mut bytes = Vec::with_capacity(length as usize);
        file.take(length).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

/// The held file of this path, else the first of this name: files that are dropped on a page have lost their folders.
fn find<'a>(held: &'a Held, path: &Path) -> Option<&'a [u8]> {
    let of_path = held.iter().find(|(own, _)| own == path);
    let found = of_path.or_else(|| held.iter().find(|(own, _)| own.file_name() == path.file_name()));
    found.map(|(_, bytes)| &bytes[..])
}

/// The error for a path that cannot be resolved. It is [`FileError::Outside`] if the longest existing part of the path leads
/// out of `folder` or is a dangling link, so that the error does not reveal which files exist outside.
fn unresolved(path: &Path, folder: &Path, error: io::Error) -> FileError {
    let there = path.ancestors().find(|path| path.symlink_metadata().is_ok());
    let leads_out = |path: &Path| !path.canonicalize().is_ok_and(|real| real.starts_with(folder));
    if there.is_some_and(leads_out) { FileError::Outside } else { FileError::Io(error) }
}

/// The content of a file that the user names, within `budget`.
pub(crate) fn read(path: &Path, budget: &Budget) -> Result<Vec<u8>, SceneError> {
    let held = held();
    Files { budget, folder: PathBuf::new(), held: held.as_deref(), confined_to: None }.scene(path)
}

fn open_regular(path: &Path) -> io::Result<File> {
    let refused = || io::Error::new(io::ErrorKind::InvalidInput, "not a regular file");
    // Checked before opening: opening a pipe blocks until a writer opens it.
    if !fs::metadata(path)?.is_file() {
        return Err(refused());
    }
    let file = File::open(path)?;
    if file.metadata()?.is_file() { Ok(file) } else { Err(refused()) }
}

/// The path of an open file, on systems that provide it.
fn opened_path(file: &File) -> Option<PathBuf> {
    #[cfg(target_os = "linux")]
    {
        use std::os::fd::AsRawFd;
        fs::read_link(format!("/proc/self/fd/{}", file.as_raw_fd())).ok()
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = file;
        None
    }
}
