//! Which extensions are understood.

use std::path::Path;

use super::fault::{Fault, Result};
use super::schema::Root;

/// Extensions that are read in full.
const SUPPORTED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_transform",
];

/// Refuses a file that requires an extension that is not understood; warns, once, of those that it only uses.
pub(super) fn check(root: &Root, file: &Path) -> Result<()> {
    let unknown = |name: &&String| !SUPPORTED.contains(&name.as_str());
    let required: Vec<_> = root.extensions_required.iter().filter(unknown).map(String::as_str).collect();
    if !required.is_empty() {
        return Err(Fault::Unsupported(required.join(", ")));
    }
    let used: Vec<_> = root.extensions_used.iter().filter(unknown).map(String::as_str).collect();
    if !used.is_empty() {
        tracing::warn!(
            "{}: read without these extensions, which are not supported: {}",
            file.display(),
            used.join(", ")
        );
    }
    Ok(())
}
