//! What any input to the importer must come to; shared by the fuzz target and the bounded test.

use std::path::{Path, PathBuf};

use lanternfish_scene::{SceneError, load};

/// Runs inputs through files of a folder, which is otherwise empty.
pub struct Harness {
    folder: PathBuf,
}

impl Harness {
    /// Writes its inputs to `folder`.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned() }
    }

    /// Loads `bytes` as a file with that ending; whether it is a scene. Panics unless it is a scene that keeps the
    /// promises of its types, or an error of the file.
    pub fn check(&self, bytes: &[u8], ending: &str) -> bool {
        let path = self.folder.join("input").with_extension(ending);
        std::fs::write(&path, bytes).expect("the folder can be written to");
        match load(path.to_str().expect("a plain name")) {
            Ok(scene) => match scene.validate() {
                Ok(()) => true,
                Err(what) => panic!("loaded, but is no valid scene: {what}"),
            },
            Err(error) => {
                // An unknown format or demo would be a fault of the harness.
                let of_harness = matches!(error, SceneError::UnknownFormat { .. } | SceneError::UnknownDemo { .. });
                assert!(!of_harness && !error.to_string().is_empty(), "{error}");
                false
            }
        }
    }
}

/// The ending that content of unknown origin is given.
pub fn ending(bytes: &[u8]) -> &'static str {
    match bytes.iter().find(|byte| !byte.is_ascii_whitespace()) {
        _ if bytes.starts_with(b"glTF") => "glb",
        Some(b'{') => "gltf",
        _ => "obj",
    }
}
