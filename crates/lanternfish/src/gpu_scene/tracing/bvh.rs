//! The compressed wide BVH: built by `lanternfish_scene::bvh`, traversed by `rays/bvh/walk.wesl`.

use lanternfish_gpu::storage_buffer_of;
use lanternfish_scene::bvh::{self, Effort};
use obvhs::{aabb::Aabb, cwbvh::node::CwBvhNode};
use rayon::prelude::*;

use super::{
    super::shaders::BvhTriangle,
    Tracing, levels,
    refit::{box_of, cost, refit},
    triangles::TracedTriangle,
    upper::place_levels,
};
use crate::error::RenderError;

/// Spare capacity: one node for each this many. Trees over the same triangles have about the same number of nodes.
const SPARE: usize = 8;

/// A BVH on the device.
#[derive(Debug)]
pub struct Bvh {
    /// Five vec4u a node.
    pub nodes: wgpu::Buffer,
    /// [`BvhTriangle`]s in leaf order.
    pub triangles: wgpu::Buffer,
    /// Copy of the nodes on the host, for refits.
    pub(super) tree: Vec<CwBvhNode>,
    /// See [`refit::cost`](super::refit::cost).
    cost_when_built: f64,
}

/// Builds the tree and reorders the triangles to its leaf order. A scene without triangles has one node without
/// children.
pub fn build(tracing: &mut Tracing) -> Vec<CwBvhNode> {
    if !tracing.levels.is_empty() {
        return levels::build(tracing);
    }
    if tracing.triangles.is_empty() {
        return vec![CwBvhNode::default()];
    }
    let boxes: Vec<Aabb> = tracing.triangles.par_iter().map(|triangle| tracing.bounds(triangle)).collect();
    let bvh = bvh::build(&boxes, Effort::High);
    tracing.reorder(&bvh.primitive_indices);
    bvh.nodes
}

impl Bvh {
    /// Uploads a tree and its triangles, in its leaf order. `light_leaves`: index and leaf of each emissive triangle.
    pub fn new(
        device: &wgpu::Device,
        tree: Vec<CwBvhNode>,
        Tracing { triangles, levels, .. }: &Tracing,
        light_leaves: &[(u32, u32)],
    ) -> Result<Self, RenderError> {
        let none = wgpu::BufferUsages::empty();
        let mut elements = packed(triangles, light_leaves);
        place_levels(&mut elements, 0, triangles.len(), triangles, levels);
        Ok(Self {
            nodes: nodes(device, &tree)?,
            triangles: storage_buffer_of(device, "scene/bvh_triangles", &elements, none)?,
            cost_when_built: cost(&tree, |index| box_of(&triangles[index].corners)),
            tree,
        })
    }

    /// Replaces this tree by another; the caller reorders the triangles to its leaf order. A tree that fits is written
    /// to the same buffer, so that recorded frames that are not yet submitted see it, as they see the triangles.
    /// `cost`: the new tree's traversal cost.
    pub fn replace(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        tree: Vec<CwBvhNode>,
        cost: f64,
    ) -> Result<(), RenderError> {
        let bytes: &[u8] = bytemuck::cast_slice(&tree);
        match bytes.len() as u64 <= self.nodes.size() {
            true => queue.write_buffer(&self.nodes, 0, bytes),
            false => self.nodes = nodes(device, &tree)?,
        }
        (self.cost_when_built, self.tree) = (cost, tree);
        Ok(())
    }

    /// Traversal cost of the tree when it was built: see [`refit::cost`](super::refit::cost).
    pub fn cost_when_built(&self) -> f64 {
        self.cost_when_built
    }

    /// The tree, with the boxes of the host's last refit.
    pub fn tree(&self) -> &[CwBvhNode] {
        &self.tree
    }

    /// Writes the transformed triangles, as many and in the same order, and refits the tree.
    pub fn update(&mut self, queue: &wgpu::Queue, triangles: &[TracedTriangle], light_leaves: &[(u32, u32)]) {
        refit(&mut self.tree, |index| box_of(&triangles[index].corners));
        queue.write_buffer(&self.nodes, 0, bytemuck::cast_slice(&self.tree));
        self.update_light_leaves(queue, triangles, light_leaves);
    }

    /// Writes the light leaves of the emissive triangles again; the set of these triangles must be unchanged.
    pub fn update_light_leaves(&self, queue: &wgpu::Queue, triangles: &[TracedTriangle], light_leaves: &[(u32, u32)]) {
        queue.write_buffer(&self.triangles, 0, bytemuck::cast_slice(&packed(triangles, light_leaves)));
    }
}

fn nodes(device: &wgpu::Device, tree: &[CwBvhNode]) -> Result<wgpu::Buffer, RenderError> {
    let mut roomy = Vec::with_capacity(tree.len() + tree.len() / SPARE + 1);
    roomy.extend_from_slice(tree);
    roomy.resize(roomy.capacity(), CwBvhNode::default());
    let words: &[u32] = bytemuck::cast_slice(&roomy);
    Ok(storage_buffer_of(device, "scene/bvh_nodes", words, wgpu::BufferUsages::empty())?)
}

pub(super) fn packed(triangles: &[TracedTriangle], light_leaves: &[(u32, u32)]) -> Vec<BvhTriangle> {
    let pack = |triangle: &TracedTriangle| {
        let TracedTriangle { corners: [a, b, c], source } = *triangle;
        BvhTriangle { a, record: source.record, b, light_leaf: 0, c, opacity: source.opacity }
    };
    let mut packed: Vec<BvhTriangle> = triangles.par_iter().map(pack).collect();
    light_leaves.iter().for_each(|(triangle, leaf)| packed[*triangle as usize].light_leaf = leaf + 1);
    packed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shaders_stack_holds_the_deepest_tree() {
        assert_eq!(crate::shaders::constant("rays/bvh/walk", "STACK_SIZE"), bvh::MAX_DEPTH as f64 + 1.0);
        assert_eq!(crate::shaders::constant("rays/bvh/walk", "NODE_VECTORS"), size_of::<CwBvhNode>() as f64 / 16.0);
    }
}
