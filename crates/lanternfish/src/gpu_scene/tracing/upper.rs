//! The upper tree of two levels: below its root are a tree over instances, which is built again as they move apart, and one over the triangles
//! that are in world space, whose elements keep their places.

use std::{
    collections::{HashMap, HashSet},
    ops::Range,
};

use lanternfish_scene::bvh::{self, Effort};
use obvhs::{aabb::Aabb, cwbvh::node::CwBvhNode};
use rayon::prelude::*;

use super::{
    TracedTriangle, Tracing,
    bvh::{Bvh, packed},
    levels::{BOX, Level},
    refit::{box_of, cost, refit},
};
use crate::gpu_scene::{moving::rebuild::LIMIT, shaders::BvhTriangle};

/// Where the nodes of the upper tree are, and its elements: world-space triangles, then instances.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UpperNodes {
    /// Number of all, with spare ones.
    pub count: usize,
    /// Those of the tree over instances but its root, which is node 1.
    rest: Range<usize>,
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
        let own = Self { count: nodes.len(), rest, instances: flat.len()..order.len() };
        (own, nodes, order)
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
    /// The level of each of the scene's instances that has one, and no triangle beside it.
    pub of_instance: HashMap<usize, usize>,
    nodes: UpperNodes,
    triangles: Vec<TracedTriangle>,
    /// Index and leaf of each emissive triangle.
    light_leaves: Vec<(u32, u32)>,
    /// Triangles in all trees.
    count: usize,
    /// Traversal cost when the tree over instances was built.
    cost_when_built: f64,
}

impl Upper {
    /// None if the scene is in one level. `nodes`: of all trees.
    pub fn of(tracing: &Tracing, nodes: &[CwBvhNode], light_leaves: Vec<(u32, u32)>) -> Option<Self> {
        let flat: HashSet<u32> =
            tracing.parts.iter().filter(|part| part.mesh.is_none()).map(|part| part.instance).collect();
        let instances = tracing.levels.iter().enumerate().filter(|(_, level)| !flat.contains(&level.instance));
        let triangles = tracing.triangles[..tracing.upper_count].to_vec();
        (!tracing.levels.is_empty()).then(|| Self {
            levels: tracing.levels.clone(),
            of_instance: instances.map(|(index, level)| (level.instance as usize, index)).collect(),
            cost_when_built: cost_of(&nodes[..tracing.upper.count], &triangles),
            nodes: tracing.upper.clone(),
            triangles,
            light_leaves,
            count: tracing.triangles.len(),
        })
    }

    /// Writes the instances' boxes and transforms, and the tree over them: refitted, or built again if that has become costly and
    /// `may_rebuild`. Returns the number of bytes.
    pub fn send(&mut self, queue: &wgpu::Queue, bvh: &mut Bvh, may_rebuild: bool) -> u64 {
        for triangle in &mut self.triangles[self.nodes.instances.clone()] {
            triangle.corners = self.levels[triangle.source.triangle as usize].corners();
        }
        let nodes = &mut bvh.tree[..self.nodes.count];
        refit(nodes, &self.triangles);
        if may_rebuild && cost_of(nodes, &self.triangles) > LIMIT * self.cost_when_built {
            self.rebuild(nodes);
        }
        queue.write_buffer(&bvh.nodes, 0, bytemuck::cast_slice(nodes));
        let mut elements = packed(&self.triangles, &self.light_leaves);
        place_levels(&mut elements, self.count, &self.triangles, &self.levels);
        let (upper, transforms) = elements.split_at(self.triangles.len());
        queue.write_buffer(&bvh.triangles, 0, bytemuck::cast_slice(upper));
        let first = (self.count * size_of::<BvhTriangle>()) as u64;
        queue.write_buffer(&bvh.triangles, first, bytemuck::cast_slice(transforms));
        (size_of_val(nodes) + size_of_val(&elements[..])) as u64
    }

    /// Builds the tree over instances again, if it fits where the last one is.
    fn rebuild(&mut self, nodes: &mut [CwBvhNode]) {
        let UpperNodes { rest, instances, .. } = &self.nodes;
        let own = &mut self.triangles[instances.clone()];
        let bounds = |triangle: &TracedTriangle| Aabb::new(triangle.corners[0].into(), triangle.corners[1].into());
        let tree = bvh::build(&own.par_iter().map(bounds).collect::<Vec<_>>(), Effort::Medium);
        if tree.nodes.len() > rest.len() + 1 {
            // It is not tried again until the boxes have changed as much.
            self.cost_when_built = cost_of(nodes, &self.triangles);
            return;
        }
        let ordered = tree.primitive_indices.iter().map(|index| own[*index as usize]).collect::<Vec<_>>();
        own.copy_from_slice(&ordered);
        put(nodes, 1, rest.clone(), &tree.nodes, instances.start);
        refit(nodes, &self.triangles);
        self.cost_when_built = cost_of(nodes, &self.triangles);
    }
}

fn cost_of(nodes: &[CwBvhNode], triangles: &[TracedTriangle]) -> f64 {
    cost(nodes, |index| box_of(&triangles[index].corners))
}

/// Writes the leaves of instances, and appends their other elements, from the index `first` on.
pub(super) fn place_levels(
    elements: &mut Vec<BvhTriangle>,
    first: usize,
    triangles: &[TracedTriangle],
    levels: &[Level],
) {
    let mut leaves = vec![0; levels.len()];
    for (index, triangle) in triangles.iter().enumerate().filter(|(_, triangle)| triangle.source.part == BOX) {
        let level = triangle.source.triangle as usize;
        elements[index] = levels[level].leaf(triangle.corners, (first + level) as u32);
        leaves[level] = index as u32;
    }
    elements.extend(levels.iter().zip(leaves).map(|(level, leaf)| level.transform(leaf)));
}
