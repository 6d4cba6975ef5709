//! glTF 2.0. The steps, each a module:
//!
//! 1. `container`: JSON and BIN chunk; `schema`: the JSON as structs; `extensions`: what is required
//! 2. `buffers`, `uri`: the bytes; `meshopt`: compressed ones, when they are asked for
//! 3. `scenes`: the one asked for; `hierarchy`: its nodes in world space; `meshes::Used`: what they use
//! 4. `materials` (`surface`: their extensions), `textures`
//! 5. `images` are decoded while `meshes` are read: `primitive` (`accessor`, `topology`, `normals`, `tangents`)
//! 6. `lights`, `cameras` and instances (`instancing`) are placed
//!
//! The JSON is parsed with types of our own: other readers refuse accessors without data or `KHR_mesh_quantization`,
//! or trust indices.

mod accessor;
mod buffers;
mod cameras;
mod container;
mod extensions;
mod fault;
mod hierarchy;
mod images;
mod instancing;
mod lights;
mod materials;
mod meshes;
mod meshopt;
mod normals;
mod notes;
mod objects;
mod primitive;
mod scenes;
mod schema;
mod surface;
mod tangents;
#[cfg(test)]
mod tests;
mod textures;
mod topology;
mod uri;
mod vertices;

use std::collections::{BTreeSet, HashSet};
use std::path::Path;

use accessor::Accessors;
use buffers::Buffers;
use fault::{Fault, Place, Result, invalid};
use glam::Affine3A;
use hierarchy::Placed;
use instancing::MAX_INSTANCES;
use lanternfish_limits::memory::Budget;
use meshes::Used;
use notes::Notes;
use objects::Objects;
use schema::Root;
use serde::Deserialize;
use textures::Textures;

use super::LoadOptions;
use super::files::Files;
use crate::{Instance, Material, Mesh, Scene, SceneError};

/// What drawing a primitive that is placed takes: nothing here, but who places many asks for more than can be looked through.
const BYTES_PER_PLACED: u64 = 256;

/// Reads the file at `path`; see [`crate::import::load_with`] for what of it.
pub(super) fn load(path: &Path, options: &LoadOptions) -> std::result::Result<Scene, SceneError> {
    let budget = options.budget();
    let files = Files::beside(path, options, &budget)?;
    let file = files.scene(path)?;
    read(&file, path, options.scene.as_deref(), &files).map_err(|fault| fault.at(path))
}

/// Reads the content of a file; `path` names the scene.
fn read(file: &[u8], path: &Path, scene: Option<&str>, files: &Files) -> Result<Scene> {
    let parts = container::split(file)?;
    let root = parse(parts.json, files.budget)?;
    extensions::check(&root, path)?;
    let scene = scenes::select(&root, scene)?;
    let buffers = Buffers::load(&root, parts.bin, files)?;
    let nodes = hierarchy::resolve(&root, scene)?;
    let used = Used::find(&root, &nodes)?;

    let mut notes = Notes::default();
    let mut textures = Textures::default();
    let mut materials: Vec<Material> = Vec::with_capacity(used.materials.len());
    for file_index in &used.materials {
        materials.push(match file_index {
            Some(index) => materials::read(&root, *index, &mut textures, &mut notes)?,
            None => Material::default(),
        });
    }
    let accessors = Accessors::new(&root, &buffers);
    let (images, meshes) = rayon::join(
        || images::decode_all(&root, &textures.images, &buffers, files),
        || meshes::read_all(&accessors, &used, &materials, files.budget, &mut notes),
    );
    let mut scene = Scene {
        name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        meshes: meshes?,
        materials,
        textures: textures.textures,
        images: images?,
        samplers: textures.samplers,
        ..Default::default()
    };
    for placed in &nodes {
        place(&mut scene, &accessors, &used, placed, files.budget, &mut notes)
            .place(|| format!("nodes[{}]", placed.index))?;
    }
    drop_copies(&mut scene, &mut notes);
    let placed: u64 = scene.instances.iter().map(|i| scene.meshes[i.mesh].primitives.len() as u64).sum();
    files.budget.check(placed.saturating_mul(BYTES_PER_PLACED), || format!("{placed} placed primitives need"))?;
    note_what_moves(&root, &nodes, &used, &mut notes);
    notes.log(path);
    Ok(scene)
}

/// Notes what would bend or move what is shown. Surfaces stay as they are stored.
fn note_what_moves(root: &Root, nodes: &[Placed], used: &Used, notes: &mut Notes) {
    let skins: BTreeSet<_> = nodes.iter().filter(|at| at.node.mesh.is_some()).filter_map(|at| at.node.skin).collect();
    notes.add_all("skins: what they bend is drawn as it is stored", skins.len());
    let targets = |mesh: &usize| root.meshes[*mesh].primitives.iter().map(|primitive| primitive.targets.len()).max();
    let targets = used.meshes.keys().filter_map(targets).sum();
    notes.add_all("morph targets: what they bend is drawn as it is stored", targets);
    notes.add_all("animations: what they move stays where it is", root.animations.len());
}

/// Bytes that parsing takes of an object, at most: the largest of a list, which doubles as it grows.
const BYTES_PER_OBJECT: u64 = 2 * size_of::<schema::Material>() as u64;
const _: () = assert!(
    size_of::<schema::Material>() >= size_of::<schema::Node>()
        && size_of::<schema::Material>() >= size_of::<schema::Image>()
        && size_of::<schema::Material>() >= size_of::<schema::Accessor>()
        && size_of::<schema::Material>() >= size_of::<schema::BufferView>()
);
/// And of a number, a string or a map's entry, beside its text.
const BYTES_PER_ITEM: u64 = 96;

/// Parses the JSON, once there is memory for what it may become: a list of `{}` takes hundreds of times its text.
fn parse<'a>(json: &'a [u8], budget: &Budget) -> Result<Root<'a>> {
    let (mut objects, mut items) = (0, 1);
    for byte in json {
        match byte {
            b'{' => objects += 1,
            b',' => items += 1,
            _ => {}
        }
    }
    let need = json.len() as u64 + BYTES_PER_OBJECT * objects + BYTES_PER_ITEM * items;
    budget.take(need, || format!("JSON of {objects} objects needs"))?;
    let mut reader = serde_json::Deserializer::from_slice(json);
    let root = Root::deserialize(Objects(&mut reader)).and_then(|root| reader.end().map(|()| root));
    let root = root.map_err(|error| invalid(format!("JSON: {error}")))?;
    let required = root.asset.min_version.as_ref().unwrap_or(&root.asset.version);
    // Minor versions add to the format. There is none beyond 2.0 yet; one to come is tried, and warned about.
    if required.starts_with("2.") { Ok(root) } else { Err(Fault::Unsupported(format!("glTF {required}"))) }
}

/// Leaves out the instances that stand where another of the same mesh stands: of surfaces that are not blended nothing more is
/// seen, and a ray would meet every one.
fn drop_copies(scene: &mut Scene, notes: &mut Notes) {
    let blends = |mesh: &Mesh| mesh.primitives.iter().any(|p| scene.materials[p.material].is_blended());
    let blends: Vec<bool> = scene.meshes.iter().map(blends).collect();
    let mut known = HashSet::new();
    scene.instances.retain(|instance| {
        let place = instance.world_from_object.to_cols_array().map(f32::to_bits);
        let stays = blends[instance.mesh] || known.insert((instance.mesh, place));
        if !stays {
            notes.add("instances that stand in the place of a copy");
        }
        stays
    });
}

/// Adds what is at a node: an instance, a light, a camera.
fn place(
    scene: &mut Scene,
    accessors: &Accessors,
    used: &Used,
    placed: &Placed,
    budget: &Budget,
    notes: &mut Notes,
) -> Result<()> {
    let (root, node) = (accessors.root, placed.node);
    if let Some(mesh) = node.mesh {
        let nodes_from_objects = match &node.extensions.instancing {
            Some(instancing) => instancing::read(accessors, instancing, node.name.len(), budget)?,
            None => vec![Affine3A::IDENTITY],
        };
        if scene.instances.len() + nodes_from_objects.len() > MAX_INSTANCES {
            return Err(invalid(format!("with it there are more than {MAX_INSTANCES} instances")));
        }
        for node_from_object in nodes_from_objects {
            let world_from_object = placed.world_from_node * node_from_object;
            if !world_from_object.is_finite() {
                return Err(invalid("EXT_mesh_gpu_instancing: a transform is not finite"));
            }
            scene.instances.push(Instance { name: node.name.clone(), mesh: used.meshes[&mesh], world_from_object });
        }
    }
    if let Some(light) = &node.extensions.light {
        scene.lights.extend(lights::read(root, light.light, placed, notes)?);
    }
    if let Some(light) = &node.extensions.area_light {
        scene.lights.extend(lights::read_area(root, light.light, placed, notes)?);
    }
    if let Some(camera) = node.camera {
        scene.cameras.push(cameras::read(root, camera, placed)?);
    }
    Ok(())
}
