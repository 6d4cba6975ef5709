//! Reading scenes from files.

mod files;
mod gltf;
mod obj;
mod options;
mod pixels;
#[cfg(test)]
mod tests;

use std::ffi::OsStr;
use std::path::Path;

pub(crate) use files::read as read_file;
pub use options::LoadOptions;

use crate::{Scene, SceneError};

/// Reads a scene: a glTF 2.0 file (`.gltf`, `.glb`), a Wavefront file (`.obj`), or `demo:NAME` for a generated one.
///
/// What is read of a glTF file:
///
/// * The default scene (without one the first, without any all root nodes), its node tree resolved to world space.
///   Meshes, materials, textures and images that this scene does not use are left out.
/// * Triangle lists, strips and fans; all accessor forms. Points and lines are left out with a warning. Missing
///   normals become flat ones, and missing tangents are generated (MikkTSpace) where the material has a normal map.
///   Instances that stand in the place of a copy are left out with a warning, unless they blend.
/// * Textures as PNG, JPEG or WebP, up to 16,384 pixels a side and 1 GiB of pixels each, 16 bits a channel reduced to 8.
/// * In full: `EXT_lights_area` (a draft), `EXT_mesh_gpu_instancing`, `EXT_meshopt_compression`, `EXT_texture_webp`, `KHR_lights_punctual`,
///   `KHR_materials_emissive_strength`, `KHR_materials_ior`, `KHR_materials_specular`, `KHR_materials_transmission`,
///   `KHR_materials_unlit`, `KHR_mesh_quantization`, `KHR_meshopt_compression`, `KHR_texture_transform`.
/// * In part, with a warning of what is left out: `KHR_materials_clearcoat` without its normal map;
///   `KHR_materials_pbrSpecularGlossiness` without its texture;
///   `KHR_materials_volume` into the material, without its texture; `KHR_materials_{anisotropy, dispersion,
///   iridescence, sheen}` not at all.
/// * `KHR_materials_variants`: the default materials alone. Any other extension that the file requires is an error; one
///   that it only uses is a warning.
/// * Animations of nodes, skins and morph targets become the scene's [`Scene::motion`]; the scene is as the file puts it at rest.
///   Animations of anything else are counted in a warning.
///
/// What is read of a Wavefront file (`.obj`) with its MTL files: objects and groups as meshes, polygons as fans of triangles,
/// materials as metallic-roughness ones (from `Kd`, `Ke`, `Ks`, `Ns`, `Pr`, `Pm`, `d`, `Tr`, `illum`, `map_Kd`, `map_Ke`,
/// `map_d`, `norm` and, where it is a normal map, `map_Bump`). Missing normals become flat ones. A missing MTL file or
/// texture is a warning. Not read: smoothing groups, vertex colours, points, lines, curves.
///
/// Files are checked while they are read: offsets, counts and indices out of range, node cycles, and attributes of
/// unequal length are [`SceneError::Invalid`], and so are more than 4 Mi instances, and whatever is farther than
/// [`Scene::FARTHEST`] from the origin. What would need more memory than there is is refused before it is allocated
/// ([`SceneError::TooMuch`]). Devices and pipes are not read. Rules of the format that do no harm when broken are not checked.
///
/// Every file that the scene names is read, wherever it is: [`LoadOptions::confine`] is for files from strangers.
pub fn load(source: impl AsRef<OsStr>) -> Result<Scene, SceneError> {
    load_with(source, &LoadOptions::default())
}

/// Reads a scene as these options say, otherwise as [`load`].
pub fn load_with(source: impl AsRef<OsStr>, options: &LoadOptions) -> Result<Scene, SceneError> {
    let source = source.as_ref();
    let path = Path::new(source);
    if let Some(name) = source.to_str().and_then(|source| source.strip_prefix("demo:")) {
        only_scene(path, options)?;
        return crate::generate::demo(name);
    }
    let is = |ending: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
    let scene = if is("gltf") || is("glb") {
        gltf::load(path, options)?
    } else if is("obj") {
        only_scene(path, options)?;
        obj::load(path, options)?
    } else {
        return Err(SceneError::UnknownFormat { path: path.to_owned() });
    };
    scene.check_reach().map_err(|what| SceneError::Invalid { path: path.to_owned(), what })?;
    Ok(scene)
}

/// Refuses any scene but number 0 where the source holds only one.
fn only_scene(path: &Path, options: &LoadOptions) -> Result<(), SceneError> {
    match options.scene.as_deref() {
        None | Some("0") => Ok(()),
        Some(scene) => Err(SceneError::NoSuchScene {
            path: path.to_owned(),
            scene: scene.to_owned(),
            known: "only one, 0".to_owned(),
        }),
    }
}
