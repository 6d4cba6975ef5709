//! Scene files.

mod files;
mod gltf;
mod obj;

use std::path::Path;

pub(crate) use files::read as read_file;

use crate::{Scene, SceneError};

/// Reads a scene: a glTF 2.0 file (`.gltf`, `.glb`), a Wavefront file (`.obj`), or `demo:NAME` for a generated one.
///
/// What is read of a glTF file:
///
/// * The default scene (without one the first, without any all root nodes), its node tree resolved to world space.
///   Meshes, materials, textures and images that this scene does not use are left out.
/// * Triangle lists, strips and fans; all accessor forms. Points and lines are left out with a warning. Missing
///   normals become flat ones, and missing tangents are generated (MikkTSpace) where the material has a normal map.
/// * Textures as PNG, JPEG or WebP, up to 16,384 pixels a side and 1 GiB of pixels each, 16 bits a channel reduced to 8.
/// * In full: `EXT_mesh_gpu_instancing`, `EXT_meshopt_compression`, `EXT_texture_webp`, `KHR_lights_punctual`,
///   `KHR_materials_emissive_strength`, `KHR_materials_ior`, `KHR_materials_unlit`, `KHR_mesh_quantization`,
///   `KHR_meshopt_compression`, `KHR_texture_transform`.
/// * In part, with a warning of what is left out: `KHR_materials_specular` without its textures;
///   `KHR_materials_transmission` as blending, alpha being what is not transmitted, and at least a tenth so that
///   highlights are seen; `KHR_materials_pbrSpecularGlossiness` without its texture;
///   `KHR_materials_volume` into the material, without its texture; `KHR_materials_{anisotropy, clearcoat, dispersion,
///   iridescence, sheen}` not at all.
/// * Of `KHR_materials_variants` the default materials. Any other extension that the file requires is an error; one
///   that it only uses is a warning.
/// * Not read: animations, morph targets and skins. A skinned mesh is placed by its own node, undeformed.
///
/// Of a Wavefront file (`.obj`) with its MTL files: objects and groups as meshes, polygons as fans of triangles,
/// materials as metallic-roughness ones (from `Kd`, `Ke`, `Ks`, `Ns`, `Pr`, `Pm`, `d`, `Tr`, `illum`, `map_Kd`, `map_Ke`,
/// `map_d`, `norm` and, where it is a normal map, `map_Bump`). Missing normals become flat ones. A missing MTL file or
/// texture is a warning. Not read: smoothing groups, vertex colours, points, lines, curves.
///
/// Files are checked while they are read: offsets, counts and indices out of range, node cycles, and attributes of
/// unequal length are [`SceneError::Invalid`], and so are more than 256 Mi vertices and indices together, or 4 Mi
/// instances. Devices and pipes are not read. Rules of the format that do no harm when broken are not checked.
pub fn load(source: &str) -> Result<Scene, SceneError> {
    load_scene(source, None)
}

/// Reads one of a file's scenes: that of the name `scene`, else that of the index that it spells; without one the
/// default scene. Otherwise as [`load`]. [`SceneError::NoSuchScene`] lists the scenes that there are.
pub fn load_scene(source: &str, scene: Option<&str>) -> Result<Scene, SceneError> {
    if let Some(name) = source.strip_prefix("demo:") {
        only_scene(source, scene)?;
        return crate::generate::demo(name);
    }
    let path = Path::new(source);
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    if ending.eq_ignore_ascii_case("gltf") || ending.eq_ignore_ascii_case("glb") {
        return gltf::load(path, scene);
    }
    if ending.eq_ignore_ascii_case("obj") {
        only_scene(source, scene)?;
        return obj::load(path);
    }
    Err(SceneError::UnknownFormat { path: path.to_owned() })
}

/// Refuses any other scene than the first for a source that holds only one.
fn only_scene(source: &str, scene: Option<&str>) -> Result<(), SceneError> {
    match scene {
        None | Some("0") => Ok(()),
        Some(scene) => Err(SceneError::NoSuchScene {
            path: source.into(),
            scene: scene.to_owned(),
            known: "only one, 0".to_owned(),
        }),
    }
}
