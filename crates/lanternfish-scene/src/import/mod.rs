//! Import of scenes from glTF and Wavefront OBJ files.

mod files;
mod gltf;
mod obj;
mod options;
mod pixels;
#[cfg(test)]
mod tests;

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use files::Held;
pub use files::hold_files;
pub(crate) use files::read as read_file;
pub use options::{LoadOptions, UpAxis};

use crate::{Scene, SceneError};

/// Reads a scene: a glTF 2.0 file (`.gltf`, `.glb`), a Wavefront file (`.obj`), or `demo:NAME` for a generated one.
///
/// Supported parts of glTF:
///
/// * The default scene, else the first; all root nodes if the file has no scene. The node tree is resolved to world space.
///   Meshes, materials, textures and images that this scene does not use are left out.
/// * Triangle lists, strips and fans; all accessor forms. Missing normals become flat ones, and missing tangents are
///   generated (MikkTSpace) where the material has a normal map.
/// * Points as octahedra, and segments of lines, line strips and line loops as closed prisms of three sides, each of
///   eight triangles. Their radius is 1/1000 of the diagonal of the world-space box about all points and lines (of 1 m
///   if the box has no extent). Missing normals point away from the point or the segment.
/// * Duplicate instances (same mesh, same transform) are left out with a warning, unless they are transparent.
/// * Textures as PNG, JPEG, WebP or KTX2 (Basis Universal), up to 16,384 pixels a side and 1 GiB of pixels each. Channels of 16
///   bits are reduced to 8. A missing or damaged image is a warning: surfaces lack its texture.
/// * In full: `EXT_lights_area` (a draft), `EXT_mesh_gpu_instancing`, `EXT_meshopt_compression`, `EXT_texture_webp`,
///   `KHR_draco_mesh_compression`, `KHR_lights_punctual`, `KHR_materials_clearcoat`, `KHR_materials_diffuse_transmission`,
///   `KHR_materials_dispersion`, `KHR_materials_emissive_strength`, `KHR_materials_ior`, `KHR_materials_pbrSpecularGlossiness`
///   (converted), `KHR_materials_specular`, `KHR_materials_transmission`, `KHR_materials_unlit`,
///   `KHR_mesh_quantization`, `KHR_meshopt_compression`, `KHR_node_visibility`, `KHR_texture_basisu`,
///   `KHR_texture_transform`.
/// * In part, with a warning about the rest: `KHR_materials_volume` without its texture; `KHR_materials_{anisotropy, iridescence, sheen}` with the means of those
///   textures for which the clear coat's or another one leaves no place.
/// * `KHR_materials_variants`: the materials of [`LoadOptions::variant`], else the default ones.
/// * Any other extension is an error if the file requires it, and a warning if the file only uses it.
/// * Animations of nodes, skins and morph targets become the scene's [`Scene::motion`]; the scene has the file's rest
///   pose. `KHR_animation_pointer`: pointers to the translation, rotation, scale and weights of nodes, and to the
///   color, intensity and range of lights of `KHR_lights_punctual`. Animations of anything else are counted in a
///   warning for each kind.
///
/// Supported parts of a Wavefront file (`.obj`) with its MTL files: objects and groups as meshes, polygons as triangle fans,
/// materials as metallic-roughness ones (from `Kd`, `Ke`, `Ks`, `Ns`, `Pr`, `Pm`, `d`, `Tr`, `illum`, `map_Kd`, `map_Ke`,
/// `map_d`, `norm` and, where it is a normal map, `map_Bump`). Missing normals become flat ones. Instead of a missing MTL file that
/// of the scene's own name is read. A missing one or a missing texture is a warning. Not supported: smoothing groups, vertex colours, points, lines, curves.
///
/// Every file that the scene names is read, wherever it is. Set [`LoadOptions::confine`] for files from untrusted sources.
///
/// # Errors
///
/// * [`SceneError::Invalid`]: offsets, counts or indices out of range, node cycles, attributes of unequal length, more
///   than 4 Mi instances, or geometry farther than [`Scene::FARTHEST`] from the origin. Harmless violations of the
///   format are not checked.
/// * [`SceneError::TooMuch`]: the import needs more memory than is available. It is returned before the allocation.
/// * [`SceneError::Io`]: a file cannot be read. Devices and pipes are refused.
pub fn load(source: impl AsRef<OsStr>) -> Result<Scene, SceneError> {
    load_with(source, &LoadOptions::default())
}

/// Reads a scene with `options`; otherwise the same as [`load`].
pub fn load_with(source: impl AsRef<OsStr>, options: &LoadOptions) -> Result<Scene, SceneError> {
    let source = source.as_ref();
    let path = Path::new(source);
    if let Some(name) = source.to_str().and_then(|source| source.strip_prefix("demo:")) {
        has_no_parts(path, options)?;
        return crate::generate::demo(name);
    }
    read(path, options, files::held().as_deref())
}

/// Reads a scene from memory: the file of `files` whose path is `path`. What it names is found among the others, by path or else by file
/// name. Otherwise the same as [`load`]; [`LoadOptions::confine`] has no effect, for nothing else is read.
pub fn load_files(
    path: impl AsRef<Path>,
    files: &[(PathBuf, Vec<u8>)],
    options: &LoadOptions,
) -> Result<Scene, SceneError> {
    read(path.as_ref(), options, Some(files))
}

fn read(path: &Path, options: &LoadOptions, held: Option<&Held>) -> Result<Scene, SceneError> {
    let is = |ending: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
    let scene = if is("gltf") || is("glb") {
        gltf::load(path, options, held)?
    } else if is("obj") {
        has_no_parts(path, options)?;
        obj::load(path, options, held)?
    } else {
        return Err(SceneError::UnknownFormat { path: path.to_owned() });
    };
    scene.check_reach().map_err(|fault| SceneError::Invalid { path: path.to_owned(), what: fault.to_string() })?;
    Ok(scene)
}

/// Rejects any scene but index 0, and any variant, for sources with a single scene.
fn has_no_parts(path: &Path, options: &LoadOptions) -> Result<(), SceneError> {
    if let Some(variant) = &options.variant {
        let (variant, known) = (variant.clone(), "none".to_owned());
        return Err(SceneError::NoSuchVariant { path: path.to_owned(), variant, known });
    }
    match options.scene.as_deref() {
        None | Some("0") => Ok(()),
        Some(scene) => Err(SceneError::NoSuchScene {
            path: path.to_owned(),
            scene: scene.to_owned(),
            known: "only one, 0".to_owned(),
        }),
    }
}
