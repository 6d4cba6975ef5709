//! The compressed wide BVH: built on the CPU with all cores, walked by `rays/bvh/walk.wesl`.

use glam::{Vec3, Vec3A};
use lanternfish_gpu::{gpu_struct, storage_buffer_of};
use lanternfish_scene::bvh::{self, Effort};
use obvhs::{aabb::Aabb, cwbvh::node::CwBvhNode};
use rayon::prelude::*;

use super::{
    refit::{box_of, cost, refit},
    tracing::{TracedTriangle, Tracing},
};
use crate::error::RenderError;

gpu_struct! {
    /// A triangle as the walk tests it; world space, m.
    pub struct BvhTriangle {
        /// First corner.
        a: Vec3,
        /// 0: solid; else the index of its mask record plus one.
        record: u32,
        /// Second corner.
        b: Vec3,
        /// 0: it does not shine; else its leaf in the tree over emissive triangles plus one.
        light_leaf: u32,
        /// Third corner.
        c: Vec3,
        /// Unused.
        _pad_c: u32,
    }
}

/// There is room for one more node for so many: trees over the same triangles have about as many.
const SPARE: usize = 8;

/// A BVH on the device.
#[derive(Debug)]
pub struct Bvh {
    /// Five vec4u a node.
    pub nodes: wgpu::Buffer,
    /// [`BvhTriangle`]s in leaf order.
    pub triangles: wgpu::Buffer,
    /// The nodes again, to be refit.
    tree: Vec<CwBvhNode>,
    /// See [`refit::cost`](super::refit::cost).
    cost_when_built: f64,
}

/// Builds the tree and puts the triangles into its leaf order. A scene without triangles gets one node without children.
pub fn build(tracing: &mut Tracing) -> Vec<CwBvhNode> {
    if tracing.triangles.is_empty() {
        return vec![CwBvhNode::default()];
    }
    let bounds = |t: &TracedTriangle| {
        let [a, b, c] = t.corners.map(Vec3A::from);
        Aabb::new(a.min(b).min(c), a.max(b).max(c))
    };
    let boxes: Vec<Aabb> = tracing.triangles.par_iter().map(bounds).collect();
    let bvh = bvh::build(&boxes, Effort::High);
    tracing.reorder(&bvh.primitive_indices);
    bvh.nodes
}

impl Bvh {
    /// Uploads a tree and its triangles, in its leaf order. `light_leaves`: of each triangle that shines, its number and its leaf.
    pub fn new(
        device: &wgpu::Device,
        tree: Vec<CwBvhNode>,
        triangles: &[TracedTriangle],
        light_leaves: &[(u32, u32)],
    ) -> Result<Self, RenderError> {
        let none = wgpu::BufferUsages::empty();
        Ok(Self {
            nodes: nodes(device, &tree)?,
            triangles: storage_buffer_of(device, "scene/bvh_triangles", &packed(triangles, light_leaves), none)?,
            cost_when_built: cost(&tree, |place| box_of(&triangles[place].corners)),
            tree,
        })
    }

    /// Puts another tree in the place of this one; the triangles are put into its leaf order by the caller. Where it fits it is in the same
    /// buffer: frames that are recorded and not yet handed over then see it, as they see the triangles. `cost`: what rays spend on it.
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

    /// What rays spent on the tree as it was built: see [`refit::cost`](super::refit::cost).
    pub fn cost_when_built(&self) -> f64 {
        self.cost_when_built
    }

    /// The tree, with the boxes that the host last gave it.
    pub fn tree(&self) -> &[CwBvhNode] {
        &self.tree
    }

    /// Puts triangles that have moved, as many and in the same order, into the same tree.
    pub fn update(&mut self, queue: &wgpu::Queue, triangles: &[TracedTriangle], light_leaves: &[(u32, u32)]) {
        refit(&mut self.tree, triangles);
        queue.write_buffer(&self.nodes, 0, bytemuck::cast_slice(&self.tree));
        self.update_light_leaves(queue, triangles, light_leaves);
    }

    /// Says again which of the triangles shine, which are those of before.
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

fn packed(triangles: &[TracedTriangle], light_leaves: &[(u32, u32)]) -> Vec<BvhTriangle> {
    let pack = |triangle: &TracedTriangle| {
        let [a, b, c] = triangle.corners;
        BvhTriangle { a, record: triangle.source.record, b, c, ..BvhTriangle::default() }
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
        assert_eq!(crate::shaders::constant("rays/bvh/walk", "STACK_SIZE"), bvh::MAX_DEPTH as f64);
        assert_eq!(crate::shaders::constant("rays/bvh/walk", "NODE_VECTORS"), size_of::<CwBvhNode>() as f64 / 16.0);
    }
}
