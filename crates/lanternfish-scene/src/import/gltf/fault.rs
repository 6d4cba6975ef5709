//! Import errors without the path of the scene file.

use std::path::{Path, PathBuf};

use lanternfish_limits::{memory::TooMuch, printable_name};

use crate::{SceneError, import::files::FileError};

/// [`SceneError`] without the scene's path, which [`Fault::at`] adds once, at the top.
#[derive(Debug)]
pub(super) enum Fault {
    /// The content breaks the format's rules.
    Invalid(String),
    /// The file requires this, which is not supported.
    Unsupported(String),
    /// The file has no such scene.
    NoSuchScene { scene: String, known: String },
    /// The file has no such variant of its materials.
    NoSuchVariant { variant: String, known: String },
    /// A file that the scene refers to cannot be read.
    Io { path: PathBuf, source: std::io::Error },
    /// A file that the scene refers to is outside the folder that may be read.
    Outside { path: PathBuf },
    /// The import needs more memory than its limit.
    TooMuch(TooMuch),
}

impl From<TooMuch> for Fault {
    fn from(need: TooMuch) -> Self {
        Self::TooMuch(need)
    }
}

pub(super) type Result<T> = std::result::Result<T, Fault>;

/// The content breaks the format's rules.
pub(super) fn invalid(what: impl Into<String>) -> Fault {
    Fault::Invalid(what.into())
}

impl Fault {
    /// The error for a file at `path` that the scene names and that cannot be read.
    pub fn of_file(error: FileError, path: PathBuf) -> Self {
        match error {
            FileError::Io(source) => Self::Io { path, source },
            FileError::TooMuch(need) => Self::TooMuch(need),
            FileError::Outside => Self::Outside { path },
        }
    }

    /// A copy. An I/O error is copied by its kind and message.
    pub fn copy(&self) -> Self {
        match self {
            Self::Invalid(what) => Self::Invalid(what.clone()),
            Self::Unsupported(what) => Self::Unsupported(what.clone()),
            Self::NoSuchScene { scene, known } => Self::NoSuchScene { scene: scene.clone(), known: known.clone() },
            Self::NoSuchVariant { variant, known } => {
                Self::NoSuchVariant { variant: variant.clone(), known: known.clone() }
            }
            Self::Io { path, source } => {
                Self::Io { path: path.clone(), source: std::io::Error::new(source.kind(), source.to_string()) }
            }
            Self::Outside { path } => Self::Outside { path: path.clone() },
            Self::TooMuch(need) => Self::TooMuch(need.clone()),
        }
    }

    /// The error for the scene file `path`.
    pub fn at(self, path: &Path) -> SceneError {
        match self {
            Self::Invalid(what) => SceneError::Invalid { path: path.to_owned(), what: printable_name(&what) },
            Self::Unsupported(what) => SceneError::Unsupported { path: path.to_owned(), what: printable_name(&what) },
            Self::NoSuchScene { scene, known } => {
                SceneError::NoSuchScene { path: path.to_owned(), scene, known: printable_name(&known) }
            }
            Self::NoSuchVariant { variant, known } => {
                SceneError::NoSuchVariant { path: path.to_owned(), variant, known: printable_name(&known) }
            }
            Self::Io { path, source } => SceneError::Io { path, source },
            Self::Outside { path } => SceneError::Outside { path },
            Self::TooMuch(need) => SceneError::TooMuch { path: path.to_owned(), need },
        }
    }
}

/// Adds the location in the file to an error.
pub(super) trait Place {
    /// Puts the location `place` before the message.
    fn place(self, place: impl FnOnce() -> String) -> Self;
}

impl<T> Place for Result<T> {
    fn place(self, place: impl FnOnce() -> String) -> Self {
        self.map_err(|fault| match fault {
            Fault::Invalid(what) => Fault::Invalid(format!("{}: {what}", place())),
            Fault::Unsupported(what) => Fault::Unsupported(format!("{what} (at {})", place())),
            other => other,
        })
    }
}

/// The element at an index from the file; `list` is the list's name in the file.
pub(super) fn item<'a, T>(items: &'a [T], index: usize, list: &str) -> Result<&'a T> {
    items.get(index).ok_or_else(|| invalid(format!("{list}[{index}] is referred to, but there are {}", items.len())))
}
