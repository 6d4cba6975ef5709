//! Two levels: a tree of each mesh that is placed more than once, in its own space, below a tree over its instances.
//!
//! An instance takes two elements of the BVH's triangles (`rays/two_level/walk.wesl`, `gpu_scene/placed.wesl`):
//!
//! | element | content |
//! |---|---|
//! | a leaf of the upper tree | corners of its box, its translation, the root of its mesh, the index of the other element |
//! | the other | the inverse of its linear transform, and what hits need |

use std::collections::BTreeMap;

use glam::{Affine3A, DMat3, Vec3};
use lanternfish_scene::{
    Bounds, Instance, Material, Primitive, Scene,
    bvh::{self, Effort},
};
use obvhs::{aabb::Aabb, cwbvh::node::CwBvhNode};
use rayon::prelude::*;

use super::{
    Tracing,
    triangles::{Source, TracedTriangle},
    upper::UpperNodes,
};
use crate::gpu_scene::shaders::BvhTriangle;

/// In place of a micromap's reference: the element is an instance.
const INSTANCE: u32 = u32::MAX;
/// In place of a part: the triangle is an instance's box.
pub const BOX: u32 = u32::MAX;
/// Least volume that a transform makes of a unit cube, relative to the product of its edges: below, its inverse is too
/// coarse.
const LEAST_VOLUME: f64 = 1e-2;
/// Distance by which a box exceeds what was transformed, relative to its distance from the origin and its size: some
/// roundings.
const PAD: f32 = 8.0 * f32::EPSILON;

/// What rays do with an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Its triangles are in the upper tree, in world space.
    Flat,
    /// It leads to the tree of its mesh.
    Level,
    /// The same, and no ray can hit it until it has another transform: it has no area.
    Nowhere,
}

/// Ids of triangles that a stored hit can name (`TRIANGLE_BITS` of `indirect/radiance_cache/planes.wesl`).
pub const MOST_IDS: u64 = 1 << 28;

/// Meshes with one instance that have moved, and so have a tree of their own, or have bent, and have none.
pub type Decided = BTreeMap<usize, bool>;

/// True if a mesh can have a tree of its own, and triangles in it. What a pane lets pass depends on its normal in world
/// space, and a mesh that bends would need its tree again.
pub fn can_have_tree(scene: &Scene, mesh: usize, has_hits: bool) -> bool {
    let stays_flat =
        |primitive: &Primitive| primitive.deformation.is_some() || scene.materials[primitive.material].is_pane();
    let is_in_tree = |primitive: &Primitive| {
        let material = &scene.materials[primitive.material];
        material.casts_shadow() && !(has_hits && is_emissive(material))
    };
    let primitives = &scene.meshes[mesh].primitives;
    !primitives.iter().any(stays_flat) && primitives.iter().any(is_in_tree)
}

/// True for surfaces that are in the light tree.
pub fn is_emissive(material: &Material) -> bool {
    material.emissive.max_element() > 0.0
}

/// How each instance of a scene is placed. Meshes with several instances have a tree; those with one stay flat, unless
/// it was decided otherwise.
pub fn places(scene: &Scene, has_hits: bool, decided: &Decided) -> Vec<Place> {
    let mut counts = vec![0u32; scene.meshes.len()];
    scene.instances.iter().for_each(|instance| counts[instance.mesh] += 1);
    let is_wanted = |mesh| counts[mesh] > 1 || decided.get(&mesh) == Some(&true);
    let has_tree = |mesh| is_wanted(mesh) && can_have_tree(scene, mesh, has_hits);
    let shared: Vec<bool> = (0..counts.len()).map(has_tree).collect();
    let place = |instance: &Instance| match shared[instance.mesh] {
        true => place_of(&instance.world_from_object),
        false => Place::Flat,
    };
    scene.instances.iter().map(place).collect()
}

/// How an instance of a mesh that has a tree is placed.
pub fn place_of(world_from_object: &Affine3A) -> Place {
    let [x, y, z] = world_from_object.matrix3.to_cols_array_2d().map(|column| Vec3::from(column).as_dvec3());
    let volume = x.dot(y.cross(z)).abs();
    match volume > LEAST_VOLUME * x.length() * y.length() * z.length() {
        true if world_from_object.is_finite() => Place::Level,
        _ if [x.cross(y), y.cross(z), z.cross(x)].iter().all(|area| area.length_squared() == 0.0) => Place::Nowhere,
        _ => Place::Flat,
    }
}

/// An instance with a tree of its mesh below it.
#[derive(Clone, Debug)]
pub struct Level {
    /// Index into the scene's instances.
    pub instance: u32,
    /// Its mesh.
    pub mesh: u32,
    /// Its transform.
    pub world_from_object: Affine3A,
    /// Index of its mesh's first node, and of a node without children.
    root: u32,
    empty: u32,
    /// The box of its mesh.
    bounds: Bounds,
    /// Id of its first triangle, and of that triangle's element.
    first_id: u32,
    first_element: u32,
}

impl Level {
    pub fn new(scene: &Scene, index: u32) -> Self {
        let instance = &scene.instances[index as usize];
        let (mesh, world_from_object) = (instance.mesh as u32, instance.world_from_object);
        Self {
            instance: index,
            mesh,
            world_from_object,
            root: 0,
            empty: 0,
            bounds: Bounds::EMPTY,
            first_id: 0,
            first_element: 0,
        }
    }

    /// Corners of a triangle with the instance's box.
    pub fn corners(&self) -> [Vec3; 3] {
        let own = self.bounds.transformed(&self.world_from_object);
        let pad = PAD * (own.min.abs().max(own.max.abs()).max_element() + own.size().max_element());
        [own.min - pad, own.max + pad, own.max + pad]
    }

    fn is_nowhere(&self) -> bool {
        place_of(&self.world_from_object) == Place::Nowhere
    }

    /// The leaf's element. `element`: index of the other one.
    pub fn leaf(&self, [min, max, _]: [Vec3; 3], element: u32) -> BvhTriangle {
        let root = if self.is_nowhere() { self.empty } else { self.root };
        let translation = self.world_from_object.translation.into();
        BvhTriangle { a: min, record: element, b: max, light_leaf: root, c: translation, opacity: INSTANCE }
    }

    /// The element with the rows of the inverse linear transform, what is added to an element for its id, the first id,
    /// and the leaf.
    pub fn transform(&self, leaf: u32) -> BvhTriangle {
        let matrix = DMat3::from_cols_array(&self.world_from_object.matrix3.to_cols_array().map(f64::from));
        let inverse = if self.is_nowhere() { DMat3::IDENTITY } else { matrix.inverse() };
        let [a, b, c] = [0, 1, 2].map(|row| inverse.row(row).as_vec3());
        let record = self.first_id.wrapping_sub(self.first_element);
        BvhTriangle { a, record, b, light_leaf: self.first_id, c, opacity: leaf }
    }
}

/// A tree of a mesh.
struct Below {
    nodes: Vec<CwBvhNode>,
    /// Indices of its triangles, in leaf order.
    leaves: Vec<u32>,
    bounds: Bounds,
}

impl Below {
    fn new(tracing: &Tracing, indices: &[u32]) -> Self {
        let boxes: Vec<Aabb> =
            indices.iter().map(|index| tracing.bounds(&tracing.triangles[*index as usize])).collect();
        let built = bvh::build(&boxes, Effort::High);
        let mut bounds = Bounds::EMPTY;
        boxes.iter().flat_map(|of_one| [of_one.min, of_one.max]).for_each(|corner| bounds.add_point(corner.into()));
        let leaves = built.primitive_indices.iter().map(|index| indices[*index as usize]).collect();
        Self { nodes: built.nodes, leaves, bounds }
    }
}

/// Builds all trees, the upper one first, and reorders the triangles to their leaf order. Adds a triangle for each
/// instance's box.
pub fn build(tracing: &mut Tracing) -> Vec<CwBvhNode> {
    let mut of_mesh: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    let mut upper = Vec::new();
    for (index, triangle) in (0..).zip(&tracing.triangles) {
        match tracing.parts[triangle.source.part as usize].mesh {
            None => upper.push(index),
            Some(mesh) => of_mesh.entry(mesh).or_default().push(index),
        }
    }
    let trees: BTreeMap<u32, Below> =
        of_mesh.into_par_iter().map(|(mesh, indices)| (mesh, Below::new(tracing, &indices))).collect();
    // A mesh without traced triangles has no tree.
    tracing.levels.retain(|level| trees.contains_key(&level.mesh));
    for (index, level) in (0..).zip(&mut tracing.levels) {
        level.bounds = trees[&level.mesh].bounds;
        let source = Source { part: BOX, triangle: index, ..Source::default() };
        upper.push(tracing.triangles.len() as u32);
        tracing.triangles.push(TracedTriangle { corners: level.corners(), source });
    }
    let (placed, mut nodes, mut order) = UpperNodes::build(tracing, &upper);
    let upper_count = order.len();
    let mut roots = BTreeMap::new();
    let mut first_id = upper_count as u64;
    for (mesh, below) in trees {
        let (first_node, first_leaf) = (nodes.len() as u32, order.len() as u32);
        roots.insert(mesh, (first_node, first_leaf, below.leaves.len() as u64));
        nodes.extend(below.nodes.into_iter().map(|mut node| {
            node.child_base_idx += first_node;
            node.primitive_base_idx += first_leaf;
            node
        }));
        order.extend(below.leaves);
    }
    let empty = nodes.len() as u32;
    nodes.push(CwBvhNode::default());
    for level in &mut tracing.levels {
        level.empty = empty;
        let (root, first_element, count) = roots[&level.mesh];
        (level.root, level.first_element, level.first_id) = (root, first_element, first_id as u32);
        first_id += count;
    }
    tracing.reorder(&order);
    (tracing.upper, tracing.upper_count, tracing.id_count) = (placed, upper_count, first_id);
    nodes
}
