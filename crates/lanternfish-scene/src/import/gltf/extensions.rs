//! Supported extensions, and the check of a file's extensions.

use std::path::Path;

use super::fault::{Fault, Result};
use super::schema::Root;

/// Supported extensions. Some are supported in part; the modules that read them note the rest.
const SUPPORTED: &[&str] = &[
    "EXT_lights_area",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Refuses a file that requires an unsupported extension. One warning lists the unsupported extensions that the file only uses.
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
    if let Some(version) = root.asset.min_version.as_ref().filter(|version| *version != "2.0") {
        tracing::warn!("{}: requires glTF {version}; read as 2.0", file.display());
    }
    Ok(())
}
