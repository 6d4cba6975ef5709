//! Errors of reading a scene.

use std::path::PathBuf;

/// Why a scene, or an environment, could not be read. Messages say what, where, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file, or one it refers to, cannot be opened or read.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file that could not be read.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// More memory is needed than there is, or than may be used.
    #[error("{path}: {need}", path = path.display())]
    TooMuch {
        /// The file.
        path: PathBuf,
        /// What needs how much.
        need: lanternfish_limits::memory::TooMuch,
    },
    /// The file is to be read from its scene's folder alone, and is elsewhere ([`crate::LoadOptions::confine`]).
    #[error("{path}: not within the scene's folder, and no other is read", path = path.display())]
    Outside {
        /// The file, as the scene names it.
        path: PathBuf,
    },
    /// The file's ending names no format that is read.
    #[error("{path}: not a scene file (expected .gltf, .glb or .obj, or demo:NAME)", path = path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file's ending names no format of environments that is read.
    #[error("{path}: not an environment (expected .hdr or .exr)", path = path.display())]
    UnknownEnvironmentFormat {
        /// The file.
        path: PathBuf,
    },
    /// The content breaks the format's rules.
    #[error("{path}: {what}", path = path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the object's place in the file.
        what: String,
    },
    /// The file requires something that is not supported.
    #[error("{path}: requires {what}, which is not supported", path = path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The feature's or extension's name.
        what: String,
    },
    /// The file has no such scene.
    #[error("{path}: no scene {scene:?}; there are: {known}", path = path.display())]
    NoSuchScene {
        /// The file.
        path: PathBuf,
        /// What was requested.
        scene: String,
        /// What there is: indices and names.
        known: String,
    },
    /// No generated scene has that name.
    #[error("demo:{name}: no such scene; there are {known}")]
    UnknownDemo {
        /// What was requested.
        name: String,
        /// What there is.
        known: String,
    },
}
