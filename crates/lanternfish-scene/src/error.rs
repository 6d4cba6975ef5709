//! Errors of reading a scene.

use std::path::PathBuf;

/// An error of reading a scene or an environment. Messages give the fault, its location, and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file, or one it refers to, cannot be opened or read.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file that could not be read.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// More memory is needed than is free or allowed.
    #[error("{path}: {need}", path = path.display())]
    TooMuch {
        /// The file.
        path: PathBuf,
        /// The request that was refused.
        need: lanternfish_limits::memory::TooMuch,
    },
    /// The file is outside the scene's folder, to which reading is confined ([`crate::LoadOptions::confine`]).
    #[error("{path}: not within the scene's folder, and no other is read", path = path.display())]
    Outside {
        /// The file's path in the scene.
        path: PathBuf,
    },
    /// The file's extension is not that of a supported scene format.
    #[error("{path}: not a scene file (expected .gltf, .glb or .obj, or demo:NAME)", path = path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file's extension is not that of a supported environment format.
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
        /// The fault, and the object's location in the file.
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
        /// The requested name.
        scene: String,
        /// Available scenes: indices and names.
        known: String,
    },
    /// The file has no such variant of its materials.
    #[error("{path}: no variant {variant:?}; there are: {known}", path = path.display())]
    NoSuchVariant {
        /// The file.
        path: PathBuf,
        /// The requested name.
        variant: String,
        /// Available variants: indices and names.
        known: String,
    },
    /// No generated scene has that name.
    #[error("demo:{name}: no such scene; there are {known}")]
    UnknownDemo {
        /// The requested name.
        name: String,
        /// Available names.
        known: String,
    },
}
