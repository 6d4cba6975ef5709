//! Import of Wavefront OBJ files with MTL materials. The steps and their modules:
//!
//! 1. `clean` checks and normalises the text, so that errors have line numbers
//! 2. `tobj` parses it; `materials::clean` does the same for the MTL files that it names
//! 3. `textures` decodes images on all cores; `materials` converts materials
//! 4. this module converts shapes to meshes

mod clean;
mod materials;
#[cfg(test)]
mod tests;
mod textures;

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::path::Path;

use glam::{Affine3A, Vec2, Vec3};
use lanternfish_limits::caught;

use super::LoadOptions;
use super::files::{FileError, Files, Held};
use crate::{
    Instance, Mesh, Primitive, Scene, SceneError,
    generate::{Shape, Surface},
    linear_from_srgb,
};
use materials::Materials;

/// Warnings about a file; each is logged once.
pub(super) type Notes = BTreeSet<String>;

/// Largest number of names that warnings of one kind list.
const MOST_NAMES: usize = 8;

/// Reads the file at `path`; see [`crate::import::load`] for the supported parts.
pub(super) fn load(path: &Path, options: &LoadOptions, held: Option<&Held>) -> Result<Scene, SceneError> {
    let budget = options.budget();
    let files = Files::beside(path, options, held, &budget)?;
    let mut scene = read(&files.scene(path)?, path, &files)?;
    scene.instances.iter_mut().for_each(|instance| instance.world_from_object = options.up.world_from_file());
    Ok(scene)
}

/// Reads the content of a file; `path` names the scene.
fn read(file: &[u8], path: &Path, files: &Files) -> Result<Scene, SceneError> {
    let invalid = |what: String| SceneError::Invalid { path: path.to_owned(), what };
    let mut notes = Notes::new();
    let too_much = |need| SceneError::TooMuch { path: path.to_owned(), need };
    let take_text = |bytes| files.budget.take(bytes, || "its text needs".to_owned()).map_err(too_much);
    // Each byte of invalid UTF-8 becomes three.
    take_text(3 * file.len() as u64)?;
    let text = String::from_utf8_lossy(file);
    take_text(clean::MOST_GROWTH * text.len() as u64)?;
    let mut plain = clean::clean(&text, &mut notes).map_err(invalid)?;
    let own = path.with_extension("mtl").file_name().unwrap_or_default().to_string_lossy().into_owned();
    if !plain.materials.is_empty() && !plain.text.contains("mtllib ") && files.has(Path::new(&own)) {
        plain.text.insert_str(0, &format!("mtllib {own}\n"));
        notes.insert(format!("it names no MTL file; {own} is read"));
    }
    files.budget.take(plain.bytes_needed(), || format!("{} triangles need", plain.triangles)).map_err(too_much)?;
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..Default::default() };
    let (missing, mut garbled) = (RefCell::new(Notes::new()), RefCell::new(Notes::new()));
    let refused = Cell::new(None);
    let library = |name: &str| {
        let bytes = files.named(Path::new(name))?;
        let need = materials::bytes_needed(&bytes);
        Ok(files.budget.take(need, || format!("the materials of {name} need")).map(|()| bytes)?)
    };
    let read_library = |name: &Path| {
        let name = name.to_string_lossy().replace('\\', "/");
        let bytes = library(&name).or_else(|error| match (error, library(&own)) {
            (FileError::Io(error), Ok(bytes)) => {
                garbled.borrow_mut().insert(format!("{name}: {error}; {own} is read instead"));
                Ok(bytes)
            }
            (FileError::Io(_), Err(FileError::TooMuch(need))) => Err(need.into()),
            (error, _) => Err(error),
        });
        match bytes {
            Ok(bytes) => {
                let text = materials::clean(&String::from_utf8_lossy(&bytes), &name, &mut garbled.borrow_mut());
                return tobj::load_mtl_buf(&mut text.as_bytes());
            }
            Err(FileError::TooMuch(need)) => refused.set(Some(need)),
            Err(error) => {
                missing.borrow_mut().insert(format!("{name}: {error}; surfaces"));
            }
        }
        Err(tobj::LoadError::OpenFileFailed)
    };
    let (models, library) = caught(|| tobj::load_obj_buf(&mut plain.text.as_bytes(), &options, read_library))
        .map_err(invalid)?
        .map_err(|error| invalid(error.to_string()))?;
    if let Some(need) = refused.take() {
        return Err(too_much(need));
    }
    let missing = missing.into_inner();

    let models: Vec<_> = models.into_iter().filter(|model| !model.mesh.indices.is_empty()).collect();
    let mut library = library.unwrap_or_default();
    let of = |mesh: &tobj::Mesh| mesh.material_id.filter(|id| *id < library.len());
    let is_mapped = models.iter().filter_map(|model| of(&model.mesh)).any(|id| materials::is_mapped(&library[id]));
    let has_uv = models.iter().any(|model| !model.mesh.texcoords.is_empty());
    let image = if is_mapped || !has_uv { None } else { textures::own_image(path, files) };
    // The warning about a missing library already covers its materials.
    let is_unknown = |name: &&String| missing.is_empty() && !library.iter().any(|material| material.name == **name);
    let unknown: Vec<_> = plain.materials.iter().filter(is_unknown).collect();
    let white = image.as_ref().map_or("become white, of albedo 0.8".to_owned(), |image| format!("show {image}"));
    note_unknown(&unknown, &white, &mut notes);
    notes.extend(missing.iter().map(|what| format!("{what} {white}")));
    notes.append(garbled.get_mut());
    if let Some(image) = &image {
        notes.insert(format!("no material has a texture; {image}, which has the file's name, is the base colour"));
        library.push(tobj::Material::default());
        library.iter_mut().for_each(|material| material.diffuse_texture = Some(image.clone()));
    }
    // The last is that of faces without a material.
    let source = |mesh: &tobj::Mesh| match image {
        Some(_) => mesh.material_id.and_then(|id| library.get(id)).or(library.last()),
        None => mesh.material_id.and_then(|id| library.get(id)),
    };
    let used = models.iter().filter_map(|model| source(&model.mesh));
    // Colours of vertices are multiplied with it.
    let default = if plain.is_colored { 1.0 } else { 0.8 };
    let mut materials = Materials::new(used, default, files, &mut notes).map_err(too_much)?;
    // Some programs write bytes.
    let brightest = models.iter().flat_map(|model| &model.mesh.vertex_color).copied().fold(0.0, f32::max);
    let color_range = if brightest > 1.0 { 255.0 } else { 1.0 };
    let mut scene =
        Scene { name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(), ..Scene::default() };
    for model in models {
        let material = materials.index(source(&model.mesh), files.budget, &mut notes).map_err(too_much)?;
        let normal_mapped = materials.list[material].normal_texture.is_some();
        let mut primitive = primitive(&model.mesh, Surface { material, texture_size: 1.0, normal_mapped }, color_range);
        // Scanned files have the same colours in both.
        if materials.list[material].base_color_texture.is_some() {
            primitive.colors.clear();
        }
        // `tobj` splits an object with several materials into several models of the same name.
        let name = plain.name(&model.name);
        match scene.meshes.last_mut().filter(|mesh| mesh.name == name) {
            Some(mesh) => mesh.primitives.push(primitive),
            None => scene.meshes.push(Mesh { name: name.to_owned(), primitives: vec![primitive] }),
        }
    }
    scene.instances = (0..scene.meshes.len())
        .map(|mesh| {
            let name = scene.meshes[mesh].name.clone();
            Instance { name, mesh, world_from_object: Affine3A::IDENTITY }
        })
        .collect();
    materials.finish(&mut scene);
    for note in notes {
        tracing::warn!("{}: {note}", path.display());
    }
    Ok(scene)
}

/// Adds warnings about materials that no library defines; `white`: what becomes of their faces.
fn note_unknown(names: &[&String], white: &str, notes: &mut Notes) {
    for name in names.iter().take(MOST_NAMES) {
        notes.insert(format!("usemtl {name}: there is no such material; its faces {white}"));
    }
    if names.len() > MOST_NAMES {
        notes.insert(format!("usemtl: and {} more materials that do not exist", names.len() - MOST_NAMES));
    }
}

/// Converts a mesh to a primitive: flips v and adds flat normals if there are none. Tangents are averaged over the triangles of each vertex.
/// Colours are sRGB-encoded, from 0 to `color_range`.
fn primitive(mesh: &tobj::Mesh, surface: Surface, color_range: f32) -> Primitive {
    let vectors = |list: &[f32]| list.as_chunks::<3>().0.iter().copied().map(Vec3::from).collect::<Vec<_>>();
    let mut shape = Shape {
        positions: vectors(&mesh.positions),
        normals: vectors(&mesh.normals),
        // The origin of texture coordinates is the bottom left in OBJ, the top left in `Primitive`.
        uv: mesh.texcoords.as_chunks::<2>().0.iter().map(|[u, v]| Vec2::new(*u, 1.0 - v)).collect(),
        indices: mesh.indices.clone(),
    };
    let linear = |value: f32| linear_from_srgb((value / color_range * 255.0).round() as u8);
    let mut colors: Vec<_> = vectors(&mesh.vertex_color).iter().map(|color| color.map(linear).extend(1.0)).collect();
    let has_uv = !shape.uv.is_empty();
    shape.uv.resize(shape.positions.len(), Vec2::ZERO);
    if shape.normals.is_empty() {
        if !colors.is_empty() {
            colors = shape.indices.iter().map(|i| colors[*i as usize]).collect();
        }
        make_flat(&mut shape);
    } else {
        repair(&mut shape);
    }
    let mut primitive = Primitive { colors, ..surface.primitive(shape) };
    if !has_uv {
        primitive.uv0.clear();
    }
    primitive
}

/// Gives every corner its own vertex, with the normal of its triangle.
fn make_flat(shape: &mut Shape) {
    let corners = std::mem::take(&mut shape.indices);
    shape.positions = corners.iter().map(|i| shape.positions[*i as usize]).collect();
    shape.uv = corners.iter().map(|i| shape.uv[*i as usize]).collect();
    shape.normals = shape.positions.as_chunks::<3>().0.iter().flat_map(|t| [triangle_normal(t); 3]).collect();
    shape.indices = (0..corners.len() as u32).collect();
}

/// Normalises the normals. A normal without a direction becomes that of a triangle that uses its vertex.
fn repair(shape: &mut Shape) {
    let directions: Vec<_> = shape.normals.iter().map(|normal| direction(*normal)).collect();
    for triangle in shape.indices.as_chunks::<3>().0 {
        for index in triangle.map(|i| i as usize) {
            let flat = || triangle_normal(&triangle.map(|i| shape.positions[i as usize]));
            shape.normals[index] = directions[index].unwrap_or_else(flat);
        }
    }
}

fn triangle_normal([a, b, c]: &[Vec3; 3]) -> Vec3 {
    direction((*b - *a).cross(*c - *a)).unwrap_or(Vec3::Y)
}

/// Unit vector along `v`; `None` if `v` has no direction.
fn direction(v: Vec3) -> Option<Vec3> {
    v.try_normalize().filter(|unit| unit.is_normalized())
}
