//! From the name of a scene to the scene.

use std::{fs, path::Path};

use lanternfish_scene::Scene;

use crate::error::CliError;

/// Reads a scene of a file, by name or by number, or makes a built-in one.
///
/// Devices and pipes are refused: they may have no end, and reading them may never return.
pub fn load_part(source: &str, scene: Option<&str>) -> Result<Scene, CliError> {
    if !source.starts_with("demo:") && fs::metadata(Path::new(source)).is_ok_and(|m| !m.is_file()) {
        return Err(CliError::new(format_args!("{source}: this is no file"), "name a .gltf, .glb or .obj file"));
    }
    Ok(lanternfish_scene::load_scene(source, scene)?)
}
