//! Import of glTF 2.0. The steps and their modules:
//!
//! 1. `container`: JSON and BIN chunks; `schema`: the JSON as structs; `extensions`: check of required extensions
//! 2. `buffers`, `uri`: bytes of buffers; `meshopt`: compressed buffer views, decoded on first use
//! 3. `scenes`, `variants`: selection of the requested scene and materials; `hierarchy`: its nodes in world space;
//!    `meshes::Used`: the meshes and materials in use
//! 4. `materials` (extensions in `surface`), `textures`
//! 5. `images` and `meshes` in parallel; each `primitive` uses `accessor`, `topology`, `normals` and `tangents`,
//!    and `thin` for points and lines
//! 6. `lights`, `cameras` and instances (`instancing`) of the nodes; `motion`: skins, with vertex `deformation`;
//!    `animations`, with `pointer`
//!
//! The module parses the JSON with its own types: other readers reject accessors without data or `KHR_mesh_quantization`,
//! or do not check indices.

mod accessor;
mod animations;
mod buffers;
mod cameras;
mod container;
mod deformation;
mod draco;
mod extensions;
mod fault;
mod glossiness;
mod hierarchy;
mod images;
mod instancing;
mod lights;
mod lobes;
mod materials;
mod meshes;
mod meshopt;
mod motion;
mod normals;
mod notes;
mod objects;
mod pointer;
mod primitive;
mod scenes;
mod schema;
mod surface;
mod tangents;
#[cfg(test)]
mod tests;
mod textures;
mod thin;
mod topology;
mod uri;
mod variants;
mod vertices;

use std::collections::HashSet;
use std::path::Path;

use accessor::Accessors;
use buffers::Buffers;
use fault::{Fault, Place, Result, invalid};
use glam::{Affine3A, Vec3};
use hierarchy::Placed;
use instancing::MAX_INSTANCES;
use lanternfish_limits::memory::Budget;
use meshes::Used;
use motion::Collected;
use notes::Notes;
use objects::Objects;
use schema::Root;
use serde::Deserialize;
use textures::Textures;

use super::LoadOptions;
use super::files::{Files, Held};
use crate::{Instance, Light, Material, Mesh, Scene, SceneError, motion::place_light};

/// Memory that drawing one primitive of an instance takes, bytes. The import does not allocate it; it limits the number of placed primitives.
const BYTES_PER_PLACED: u64 = 256;

/// Reads the file at `path`; see [`crate::import::load_with`] for the supported parts.
pub(super) fn load(path: &Path, options: &LoadOptions, held: Option<&Held>) -> std::result::Result<Scene, SceneError> {
    let budget = options.budget();
    let files = Files::beside(path, options, held, &budget)?;
    let file = files.scene(path)?;
    let mut scene = read(&file, path, options, &files).map_err(|fault| fault.at(path))?;
    scene.motion.world_from_roots = options.up.world_from_file();
    Ok(scene)
}

/// Reads the content of a file; `path` names the scene.
fn read(file: &[u8], path: &Path, options: &LoadOptions, files: &Files) -> Result<Scene> {
    let parts = container::split(file)?;
    let root = parse(parts.json, files.budget)?;
    extensions::check(&root, path)?;
    let scene = scenes::select(&root, options.scene.as_deref())?;
    let variant = variants::select(&root, options.variant.as_deref())?;
    let buffers = Buffers::load(&root, parts.bin, files)?;
    let nodes = hierarchy::resolve(&root, scene, options.up.world_from_file())?;
    let used = Used::find(&root, &nodes, variant)?;

    let mut notes = Notes::default();
    let mut textures = Textures::new(images::first_of_same(&root, &buffers));
    let mut materials: Vec<Material> = Vec::with_capacity(used.materials.len());
    for file_index in &used.materials {
        materials.push(match file_index {
            Some(index) => materials::read(&root, *index, materials.len(), &mut textures, &mut notes)?,
            None => Material::default(),
        });
    }
    let accessors = Accessors::new(&root, &buffers);
    let (images, meshes) = rayon::join(
        || images::decode_all(&root, &textures.images, &buffers, files),
        || meshes::read_all(&accessors, &nodes, &used, &materials, files.budget, &mut notes),
    );
    let meshes = meshes?;
    let images = textures.keep_readable(images?, &mut materials, files.budget, &mut notes)?;
    let mut scene = Scene {
        name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        meshes,
        materials,
        variants: root.extensions.variants.variants.iter().map(|variant| variant.name.clone()).collect(),
        textures: textures.textures,
        images,
        samplers: textures.samplers,
        ..Default::default()
    };
    let mut collected = Collected::new(&accessors, &nodes, files.budget)?;
    for (node_index, at) in nodes.iter().enumerate() {
        let mut placing = Placing {
            scene: &mut scene,
            accessors: &accessors,
            used: &used,
            collected: &mut collected,
            budget: files.budget,
            notes: &mut notes,
        };
        placing.place(node_index, at).place(|| format!("nodes[{}]", at.index))?;
    }
    collected.finish(&mut scene, &mut notes)?;
    drop_copies(&mut scene, &mut notes);
    let placed: u64 = scene.instances.iter().map(|i| scene.meshes[i.mesh].primitives.len() as u64).sum();
    files.budget.check(placed.saturating_mul(BYTES_PER_PLACED), || format!("{placed} placed primitives need"))?;
    notes.log(path);
    Ok(scene)
}

/// Upper bound of the memory for parsing one object, bytes: the largest list element, in a list that doubles as it grows.
const BYTES_PER_OBJECT: u64 = 2 * size_of::<schema::Material>() as u64;
const _: () = assert!(
    size_of::<schema::Material>() >= size_of::<schema::Node>()
        && size_of::<schema::Material>() >= size_of::<schema::Image>()
        && size_of::<schema::Material>() >= size_of::<schema::Accessor>()
        && size_of::<schema::Material>() >= size_of::<schema::BufferView>()
);
/// Upper bound for a number, a string or a map entry, bytes, without its text.
const BYTES_PER_ITEM: u64 = 96;

/// Parses the JSON, after taking the memory of the parsed form from the budget: a list of `{}` takes hundreds of times its text.
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
    // Minor versions only add to the format. Later ones than 2.0 are read with a warning.
    if required.starts_with("2.") { Ok(root) } else { Err(Fault::Unsupported(format!("glTF {required}"))) }
}

/// Removes static instances that duplicate another one (same mesh, same transform). Duplicates of surfaces that are not
/// transparent change nothing in the image, but a ray would intersect each one.
fn drop_copies(scene: &mut Scene, notes: &mut Notes) {
    let blends = |mesh: &Mesh| mesh.primitives.iter().any(|p| scene.materials[p.material].is_transparent());
    let mut keeps_duplicates: Vec<bool> = scene.meshes.iter().map(blends).collect();
    scene.motion.meshes.iter().for_each(|deformed| keeps_duplicates[deformed.mesh] = true);
    let moves = scene.motion.moving_nodes();
    let mut is_moved = vec![false; scene.instances.len()];
    scene.motion.instances.iter().for_each(|bound| is_moved[bound.index] = moves[bound.node]);
    let mut seen = HashSet::new();
    let mut new_from_old = Vec::with_capacity(scene.instances.len());
    let mut kept = 0;
    scene.instances.retain(|instance| {
        let transform = instance.world_from_object.to_cols_array().map(f32::to_bits);
        let is_exempt = keeps_duplicates[instance.mesh] || is_moved[new_from_old.len()];
        let stays = is_exempt || seen.insert((instance.mesh, transform));
        new_from_old.push(stays.then_some(kept));
        kept += usize::from(stays);
        if !stays {
            notes.add("duplicate instances");
        }
        stays
    });
    let mut stays = new_from_old.iter();
    scene.semantics.retain(|_| stays.next().is_some_and(Option::is_some));
    scene.motion.instances.retain_mut(|bound| match new_from_old[bound.index] {
        Some(index) => {
            bound.index = index;
            true
        }
        None => false,
    });
}

/// Inputs and outputs of [`Placing::place`].
struct Placing<'p, 'c, 'a> {
    scene: &'p mut Scene,
    accessors: &'p Accessors<'a>,
    used: &'p Used,
    collected: &'p mut Collected<'c, 'a>,
    budget: &'p Budget,
    notes: &'p mut Notes,
}

impl Placing<'_, '_, '_> {
    /// Adds the camera of a node, and the instances and lights of a visible one. `node_index`: the node's index among
    /// the scene's nodes.
    fn place(&mut self, node_index: usize, at: &Placed) -> Result<()> {
        let (root, node) = (self.accessors.root, at.node);
        if let Some(camera) = node.camera {
            self.collected.camera(self.scene.cameras.len(), node_index);
            self.scene.cameras.push(cameras::read(root, camera, at)?);
        }
        if !at.is_visible {
            return Ok(());
        }
        if let Some(mesh) = node.mesh {
            self.instances(node_index, at, self.used.meshes[&mesh])?;
        }
        if let Some(light) = &node.extensions.light
            && let Some(light) = lights::read(root, light.light, at, self.notes)?
        {
            self.light(node_index, at, light);
        }
        if let Some(light) = &node.extensions.area_light
            && let Some(light) = lights::read_area(root, light.light, at, self.notes)?
        {
            self.light(node_index, at, light);
        }
        Ok(())
    }

    fn instances(&mut self, node_index: usize, at: &Placed, mesh: usize) -> Result<()> {
        let Self { scene, accessors, collected, budget, notes, .. } = self;
        let (mesh, is_skinned) = collected.mesh(scene, node_index, mesh, notes)?;
        let node = at.node;
        let nodes_from_objects = match &node.extensions.instancing {
            // Joints place skinned vertices; the transform of the node is ignored.
            _ if is_skinned => vec![Affine3A::IDENTITY],
            Some(instancing) => instancing::read(accessors, instancing, node.name.len(), budget)?,
            None => vec![Affine3A::IDENTITY],
        };
        if scene.instances.len() + nodes_from_objects.len() > MAX_INSTANCES {
            return Err(invalid(format!("with it there are more than {MAX_INSTANCES} instances")));
        }
        for node_from_object in nodes_from_objects {
            let world_from_node = if is_skinned { Affine3A::IDENTITY } else { at.world_from_node };
            let world_from_object = world_from_node * node_from_object;
            if !world_from_object.is_finite() {
                return Err(invalid("EXT_mesh_gpu_instancing: a transform is not finite"));
            }
            if !is_skinned {
                collected.instance(scene.instances.len(), node_index, node_from_object);
            }
            scene.instances.push(Instance { name: node.name.clone(), mesh, world_from_object });
            scene.semantics.push(at.semantic);
        }
        Ok(())
    }

    /// Adds a light, given in its node's space.
    fn light(&mut self, node_index: usize, at: &Placed, light: Light) {
        let placed = match place_light(&light, &at.world_from_node) {
            Some(placed) => placed,
            // An animation may give it an area.
            None if self.collected.is_kept() => Light { intensity: Vec3::ZERO, ..light.clone() },
            None => return self.notes.add("area lights without extent"),
        };
        self.collected.light(self.scene.lights.len(), node_index, light);
        self.scene.lights.push(placed);
    }
}
