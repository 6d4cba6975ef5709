//! The upper tree of two levels: below its root are a tree over instances, which is built again as they move apart, and
//! one over the triangles that are in world space, whose elements keep their places.

use std::{
    collections::{HashMap, HashSet},
    ops::Range,
};

use glam::Affine3A;
use lanternfish_scene::{
    Bounds,
    bvh::{self, Effort},
};
use obvhs::{aabb::Aabb, cwbvh::node::CwBvhNode};
use rayon::prelude::*;

use super::{
    Tracing,
    bvh::{Bvh, packed},
    levels::{BOX, Level, Place, place_of},
    refit::{box_of, refit_nodes},
    triangles::TracedTriangle,
};
use crate::gpu_scene::{moving::rebuild::LIMIT, shaders::BvhTriangle};

/// Where the nodes of the upper tree are, and its elements: world-space triangles, then instances.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UpperNodes {
    /// Number of all, with spare ones.
    pub count: usize,
    /// Those of the tree over instances but its root, which is node 1; and how many of them it has.
    rest: Range<usize>,
    used: usize,
    /// Elements of instances.
    instances: Range<usize>,
}

impl UpperNodes {
    /// Builds the tree over these elements, and gives their order.
    pub fn build(tracing: &Tracing, upper: &[u32]) -> (Self, Vec<CwBvhNode>, Vec<u32>) {
        let is_instance = |index: &&u32| tracing.triangles[**index as usize].source.part == BOX;
        let (instances, flat): (Vec<u32>, Vec<u32>) = upper.iter().partition(is_instance);
        let [of_instances, of_flat] = [&instances, &flat].map(|indices| {
            let bounds = |index: &u32| tracing.bounds(&tracing.triangles[*index as usize]);
            bvh::build(&indices.par_iter().map(bounds).collect::<Vec<_>>(), Effort::High)
        });
        let ordered = |order: &[u32], of: &[u32]| order.iter().map(|index| of[*index as usize]).collect::<Vec<_>>();
        let mut order = ordered(&of_flat.primitive_indices, &flat);
        order.extend(ordered(&of_instances.primitive_indices, &instances));
        if instances.is_empty() {
            let nodes = if flat.is_empty() { vec![CwBvhNode::default()] } else { of_flat.nodes };
            return (Self { count: nodes.len(), ..Self::default() }, nodes, order);
        }
        let first = 2 + of_flat.nodes.len();
        // Trees over the same boxes have about as many nodes; over boxes without size, one for each.
        let rest = first..first + 2 * of_instances.nodes.len() + 8;
        let mut nodes = vec![CwBvhNode::default(); rest.end];
        for (slot, _) in
            [&of_instances.nodes, &of_flat.nodes].into_iter().enumerate().filter(|(_, tree)| !tree.is_empty())
        {
            nodes[0].imask |= 1 << slot;
            // An inner node: its bit, and its slot.
            nodes[0].child_meta[slot] = (1 << 5) | (24 + slot as u8);
        }
        nodes[0].child_base_idx = 1;
        if !of_flat.nodes.is_empty() {
            put(&mut nodes, 2, 3..first, &of_flat.nodes, 0);
        }
        put(&mut nodes, 1, rest.clone(), &of_instances.nodes, flat.len());
        let used = of_instances.nodes.len() - 1;
        let own = Self { count: nodes.len(), rest, used, instances: flat.len()..order.len() };
        (own, nodes, order)
    }

    /// Nodes of the tree over instances but its root.
    fn used(&self) -> Range<usize> {
        self.rest.start..self.rest.start + self.used
    }
}

/// Puts a tree among others: its root, and the other nodes from the start of `rest` on.
fn put(nodes: &mut [CwBvhNode], root: usize, rest: Range<usize>, tree: &[CwBvhNode], first_leaf: usize) {
    nodes[rest.clone()].fill(CwBvhNode::default());
    for (index, mut node) in tree.iter().copied().enumerate() {
        // Children of the root begin at its node 1.
        node.child_base_idx = (node.child_base_idx + rest.start as u32).wrapping_sub(1);
        node.primitive_base_idx += first_leaf as u32;
        nodes[if index == 0 { root } else { rest.start + index - 1 }] = node;
    }
}

/// The upper tree's elements on the host.
#[derive(Debug)]
pub struct Upper {
    pub levels: Vec<Level>,
    /// The level of each of the scene's instances that has one.
    of_instance: HashMap<usize, usize>,
    /// Instances that have triangles in world space, with or without a level.
    flat: HashSet<usize>,
    /// Meshes that have a tree.
    meshes: HashSet<usize>,
    nodes: UpperNodes,
    /// Boxes of the nodes.
    boxes: Vec<Bounds>,
    triangles: Vec<TracedTriangle>,
    /// Triangles in all trees.
    count: usize,
    /// Traversal cost when the tree over instances was built.
    cost_when_built: f64,
}

impl Upper {
    /// None if the scene is in one level. Refits the upper tree; `nodes`: of all trees.
    pub fn of(tracing: &Tracing, nodes: &mut [CwBvhNode]) -> Option<Self> {
        if tracing.levels.is_empty() {
            return None;
        }
        let flat = tracing.parts.iter().filter(|part| part.mesh.is_none()).map(|part| part.instance as usize);
        let instances = (0..).zip(&tracing.levels).map(|(index, level)| (level.instance as usize, index));
        let mut upper = Self {
            levels: tracing.levels.clone(),
            of_instance: instances.collect(),
            flat: flat.collect(),
            meshes: tracing.levels.iter().map(|level| level.mesh as usize).collect(),
            nodes: tracing.upper.clone(),
            boxes: vec![Bounds::EMPTY; tracing.upper.count],
            triangles: tracing.triangles[..tracing.upper_count].to_vec(),
            count: tracing.triangles.len(),
            cost_when_built: 0.0,
        };
        // Boxes of the build, around what is solid of masked triangles.
        let built = |index: usize| {
            let Aabb { min, max } = tracing.bounds(&tracing.triangles[index]);
            Bounds { min: min.into(), max: max.into() }
        };
        refit_nodes(nodes, (2..upper.nodes.rest.start).rev(), built, &mut upper.boxes);
        upper.cost_when_built = upper.refit(nodes);
        Some(upper)
    }

    /// True if an instance has no triangles in world space.
    pub fn is_free(&self, instance: usize) -> bool {
        !self.flat.contains(&instance)
    }

    /// True if an instance can have this transform without another upload.
    pub fn takes(&self, instance: usize, transform: &Affine3A) -> bool {
        !self.of_instance.contains_key(&instance) || place_of(transform) != Place::Flat
    }

    /// Sets the transform of an instance, if it has a level.
    pub fn set_transform(&mut self, instance: usize, transform: &Affine3A) {
        if let Some(level) = self.of_instance.get(&instance) {
            self.levels[*level].world_from_object = *transform;
        }
    }

    /// Number of triangles in world space, which are the first.
    pub fn flat_count(&self) -> usize {
        self.nodes.instances.start
    }

    /// True if any instance of the mesh has a level.
    pub fn has_tree_of(&self, mesh: usize) -> bool {
        self.meshes.contains(&mesh)
    }

    /// Refits the tree over instances, and the root above it. Returns its cost.
    fn refit(&mut self, nodes: &mut [CwBvhNode]) -> f64 {
        let of_instances = self.nodes.used().rev().chain([1, 0]);
        refit_nodes(nodes, of_instances, |index| box_of(&self.triangles[index].corners), &mut self.boxes)
    }

    /// Writes the instances' boxes and transforms, and the tree over them: refitted, or built again if that has become
    /// costly and `may_rebuild`. Returns the number of bytes.
    pub fn send(&mut self, queue: &wgpu::Queue, bvh: &mut Bvh, may_rebuild: bool) -> u64 {
        let instances = self.nodes.instances.clone();
        for triangle in &mut self.triangles[instances.clone()] {
            triangle.corners = self.levels[triangle.source.triangle as usize].corners();
        }
        let nodes = &mut bvh.tree[..self.nodes.count];
        let cost = self.refit(nodes);
        if may_rebuild && cost > LIMIT * self.cost_when_built {
            self.cost_when_built = if self.rebuild(nodes) { self.refit(nodes) } else { cost };
        }
        let mut bytes = 0;
        for range in [0..2, self.nodes.used()] {
            let offset = (range.start * size_of::<CwBvhNode>()) as u64;
            bytes += size_of_val(&nodes[range.clone()]);
            queue.write_buffer(&bvh.nodes, offset, bytemuck::cast_slice(&nodes[range]));
        }
        let mut elements = packed(&self.triangles[instances.clone()], &[]);
        place_levels(&mut elements, instances.start, self.count, &self.triangles[instances.clone()], &self.levels);
        let (leaves, transforms) = elements.split_at(instances.len());
        for (first, elements) in [(instances.start, leaves), (self.count, transforms)] {
            let offset = (first * size_of::<BvhTriangle>()) as u64;
            queue.write_buffer(&bvh.triangles, offset, bytemuck::cast_slice(elements));
        }
        (bytes + size_of_val(&elements[..])) as u64
    }

    /// Writes triangles in world space: all of them, in their order. The tree over them is refitted. `light_leaves`:
    /// index and leaf of each emissive one. Follow it by [`Self::send`].
    pub fn pose(&mut self, queue: &wgpu::Queue, bvh: &mut Bvh, flat: &[TracedTriangle], light_leaves: &[(u32, u32)]) {
        self.triangles[..flat.len()].copy_from_slice(flat);
        let nodes = &mut bvh.tree[..self.nodes.count];
        let of_flat = 2..self.nodes.rest.start;
        refit_nodes(nodes, of_flat.clone().rev(), |index| box_of(&self.triangles[index].corners), &mut self.boxes);
        let offset = (of_flat.start * size_of::<CwBvhNode>()) as u64;
        queue.write_buffer(&bvh.nodes, offset, bytemuck::cast_slice(&nodes[of_flat]));
        bvh.update_light_leaves(queue, flat, light_leaves);
    }

    /// Builds the tree over instances again, and returns false if it does not fit where the last one is.
    fn rebuild(&mut self, nodes: &mut [CwBvhNode]) -> bool {
        let UpperNodes { rest, instances, .. } = &self.nodes;
        let own = &mut self.triangles[instances.clone()];
        let bounds = |triangle: &TracedTriangle| Aabb::new(triangle.corners[0].into(), triangle.corners[1].into());
        let tree = bvh::build(&own.par_iter().map(bounds).collect::<Vec<_>>(), Effort::Medium);
        if tree.nodes.len() > rest.len() + 1 {
            return false;
        }
        let ordered = tree.primitive_indices.iter().map(|index| own[*index as usize]).collect::<Vec<_>>();
        own.copy_from_slice(&ordered);
        put(nodes, 1, rest.clone(), &tree.nodes, instances.start);
        self.nodes.used = tree.nodes.len() - 1;
        true
    }
}

/// Writes the leaves of instances, and appends their other elements, from the index `count` on. `elements` are these
/// triangles; the first has the index `first`.
pub(super) fn place_levels(
    elements: &mut Vec<BvhTriangle>,
    first: usize,
    count: usize,
    triangles: &[TracedTriangle],
    levels: &[Level],
) {
    let mut leaves = vec![0; levels.len()];
    for (index, triangle) in triangles.iter().enumerate().filter(|(_, triangle)| triangle.source.part == BOX) {
        let level = triangle.source.triangle as usize;
        elements[index] = levels[level].leaf(triangle.corners, (count + level) as u32);
        leaves[level] = (first + index) as u32;
    }
    elements.extend(levels.iter().zip(leaves).map(|(level, leaf)| level.transform(leaf)));
}
