//! Two levels: a tree of each mesh that is placed more than once, in its own space, below a tree over its instances.
//!
//! An instance takes two elements of the BVH's triangles (`rays/two_level/walk.wesl`): a leaf of the upper tree, which has the corners of its
//! box, the root of its mesh and the index of the other element, which transforms rays.

use std::collections::BTreeMap;

use glam::{Affine3A, DMat3, Vec3};
use lanternfish_scene::{
    Bounds, Instance, Scene,
    bvh::{self, Effort},
};
use obvhs::{aabb::Aabb, cwbvh::node::CwBvhNode};
use rayon::prelude::*;

use super::{Source, TracedTriangle, Tracing};
use crate::gpu_scene::shaders::BvhTriangle;

/// In place of a micromap's reference: the element is an instance.
const INSTANCE: u32 = u32::MAX;
/// In place of a part: the triangle is an instance's box.
pub const BOX: u32 = u32::MAX;
/// Least volume that a transform makes of a unit cube, relative to the product of its edges: below, its inverse is too coarse.
const LEAST_VOLUME: f64 = 1e-4;
/// Distance by which a box exceeds what was transformed, relative to its distance from the origin and its size: some roundings.
const PAD: f32 = 8.0 * f32::EPSILON;

/// What rays do with an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Its triangles are in the upper tree, in world space.
    Flat,
    /// It leads to the tree of its mesh.
    Level,
    /// None can hit it: it has no area.
    Nowhere,
}

/// How each instance of a scene is placed.
pub fn places(scene: &Scene) -> Vec<Place> {
    let mut counts = vec![0u32; scene.meshes.len()];
    scene.instances.iter().for_each(|instance| counts[instance.mesh] += 1);
    // What a pane lets pass depends on its normal in world space.
    let has_pane = |mesh: usize| scene.meshes[mesh].primitives.iter().any(|p| scene.materials[p.material].is_pane());
    let shared: Vec<bool> = (0..counts.len()).map(|mesh| counts[mesh] > 1 && !has_pane(mesh)).collect();
    let place = |instance: &Instance| {
        if !shared[instance.mesh] {
            return Place::Flat;
        }
        let columns = instance.world_from_object.matrix3.to_cols_array_2d().map(|c| Vec3::from(c).as_dvec3());
        let [x, y, z] = columns;
        let volume = x.dot(y.cross(z)).abs();
        match volume > LEAST_VOLUME * x.length() * y.length() * z.length() {
            true if volume.is_finite() => Place::Level,
            _ if [x.cross(y), y.cross(z), z.cross(x)].iter().all(|area| area.length_squared() == 0.0) => Place::Nowhere,
            _ => Place::Flat,
        }
    };
    scene.instances.iter().map(place).collect()
}

/// An instance with a tree of its mesh below it.
#[derive(Clone, Debug)]
pub struct Level {
    pub mesh: u32,
    world_from_object: Affine3A,
    /// Index of its mesh's first node.
    root: u32,
}

impl Level {
    pub fn new(scene: &Scene, instance: u32) -> Self {
        let instance = &scene.instances[instance as usize];
        Self { mesh: instance.mesh as u32, world_from_object: instance.world_from_object, root: 0 }
    }

    /// The box's element. `element`: index of the other one.
    pub fn leaf(&self, [min, _, max]: [Vec3; 3], element: u32) -> BvhTriangle {
        BvhTriangle { a: min, record: element, b: max, light_leaf: self.root, c: max, opacity: INSTANCE }
    }

    /// The element that transforms rays.
    pub fn transform(&self) -> BvhTriangle {
        let inverse = DMat3::from_cols_array(&self.world_from_object.matrix3.to_cols_array().map(f64::from)).inverse();
        let [record, light_leaf, opacity] = self.world_from_object.translation.to_array().map(f32::to_bits);
        let [a, b, c] = [0, 1, 2].map(|row| inverse.row(row).as_vec3());
        BvhTriangle { a, record, b, light_leaf, c, opacity }
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

/// Builds all trees, the upper one first, and reorders the triangles to their leaf order. Adds a triangle for each instance's box.
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
    for (index, level) in (0..).zip(&tracing.levels) {
        let own = trees[&level.mesh].bounds.transformed(&level.world_from_object);
        let pad = PAD * (own.min.abs().max(own.max.abs()).max_element() + own.size().max_element());
        let (min, max) = (own.min - pad, own.max + pad);
        let source = Source { part: BOX, triangle: index, ..Source::default() };
        upper.push(tracing.triangles.len() as u32);
        tracing.triangles.push(TracedTriangle { corners: [min, max, max], source });
    }
    let boxes: Vec<Aabb> = upper.par_iter().map(|index| tracing.bounds(&tracing.triangles[*index as usize])).collect();
    let mut nodes = vec![CwBvhNode::default()];
    let mut order = Vec::new();
    if !upper.is_empty() {
        let built = bvh::build(&boxes, Effort::High);
        nodes = built.nodes;
        order.extend(built.primitive_indices.iter().map(|index| upper[*index as usize]));
    }
    let mut roots = BTreeMap::new();
    for (mesh, below) in trees {
        let (first_node, first_leaf) = (nodes.len() as u32, order.len() as u32);
        roots.insert(mesh, first_node);
        nodes.extend(below.nodes.into_iter().map(|mut node| {
            node.child_base_idx += first_node;
            node.primitive_base_idx += first_leaf;
            node
        }));
        order.extend(below.leaves);
    }
    tracing.levels.iter_mut().for_each(|level| level.root = roots[&level.mesh]);
    tracing.reorder(&order);
    nodes
}
