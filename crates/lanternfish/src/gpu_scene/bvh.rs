//! The compressed wide BVH: built on the CPU with all cores, walked by `shadows/bvh/trace.wesl`.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use lanternfish_gpu::{gpu_struct, storage_buffer_of};
use obvhs::{
    BvhBuildParams,
    cwbvh::{builder::build_cwbvh_from_tris, node::CwBvhNode},
    triangle::Triangle,
};
use rayon::prelude::*;

use super::{
    refit::refit,
    tracing::{TracedTriangle, Tracing},
};
use crate::error::RenderError;

/// Levels that the shader's stack has room for; its `STACK_SIZE`.
const STACK_SIZE: usize = 32;

gpu_struct! {
    /// A triangle as the walk tests it; world space, m.
    pub struct BvhTriangle {
        /// First corner.
        a: Vec3,
        /// 0: solid; else the index of its mask record plus one.
        record: u32,
        /// Second corner.
        b: Vec3,
        /// Unused.
        _pad_b: u32,
        /// Third corner.
        c: Vec3,
        /// Unused.
        _pad_c: u32,
    }
}

/// A BVH on the device.
#[derive(Debug)]
pub struct Bvh {
    /// Five vec4u a node.
    pub nodes: wgpu::Buffer,
    /// [`BvhTriangle`]s in leaf order.
    pub triangles: wgpu::Buffer,
    /// The nodes again, to be refit.
    tree: Vec<CwBvhNode>,
}

/// Builds the tree and puts the triangles into its leaf order. A scene without triangles gets one node without children.
pub fn build(tracing: &mut Tracing) -> Vec<CwBvhNode> {
    if tracing.triangles.is_empty() {
        return vec![CwBvhNode::default()];
    }
    let corner = |c: glam::Vec3| Vec3A::from(c);
    let triangles: Vec<Triangle> = tracing
        .triangles
        .par_iter()
        .map(|t| Triangle { v0: corner(t.corners[0]), v1: corner(t.corners[1]), v2: corner(t.corners[2]) })
        .collect();
    // Splitting large triangles would put some into several leaves, and so out of one leaf order.
    let parameters = BvhBuildParams { pre_split: false, ..BvhBuildParams::slow_build() };
    let bvh = build_cwbvh_from_tris(&triangles, parameters, &mut Duration::default());
    tracing.reorder(&bvh.primitive_indices);
    bvh.nodes
}

impl Bvh {
    /// Uploads a tree and its triangles, in its leaf order.
    pub fn new(device: &wgpu::Device, tree: Vec<CwBvhNode>, triangles: &[TracedTriangle]) -> Result<Self, RenderError> {
        let depth = depth(&tree);
        if depth > STACK_SIZE {
            return Err(RenderError::Overflow {
                list: "BVH levels",
                needed: depth as u64,
                limit: STACK_SIZE as u64,
                remedy: "the scene has thousands of triangles in one place; remove copies",
            });
        }
        let none = wgpu::BufferUsages::empty();
        let words: &[u32] = bytemuck::cast_slice(&tree);
        Ok(Self {
            nodes: storage_buffer_of(device, "scene/bvh_nodes", words, none)?,
            triangles: storage_buffer_of(device, "scene/bvh_triangles", &packed(triangles), none)?,
            tree,
        })
    }

    /// Puts triangles that have moved, as many and in the same order, into the same tree.
    pub fn update(&mut self, queue: &wgpu::Queue, triangles: &[TracedTriangle]) {
        refit(&mut self.tree, triangles);
        queue.write_buffer(&self.nodes, 0, bytemuck::cast_slice(&self.tree));
        queue.write_buffer(&self.triangles, 0, bytemuck::cast_slice(&packed(triangles)));
    }
}

fn packed(triangles: &[TracedTriangle]) -> Vec<BvhTriangle> {
    let pack = |triangle: &TracedTriangle| {
        let [a, b, c] = triangle.corners;
        BvhTriangle { a, record: triangle.source.record, b, c, ..BvhTriangle::default() }
    };
    triangles.par_iter().map(pack).collect()
}

/// Levels of the tree.
fn depth(nodes: &[CwBvhNode]) -> usize {
    let mut depth = 0;
    let mut level = vec![0u32];
    while !level.is_empty() && depth <= STACK_SIZE {
        depth += 1;
        let children = |n: &u32| {
            let node = &nodes[*n as usize];
            node.child_base_idx..node.child_base_idx + node.imask.count_ones()
        };
        level = level.iter().flat_map(children).collect();
    }
    depth
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stack_is_as_deep_as_the_shaders() {
        assert_eq!(crate::shaders::constant("shadows/bvh/trace", "STACK_SIZE"), STACK_SIZE as f64);
        assert_eq!(crate::shaders::constant("shadows/bvh/trace", "NODE_VECTORS"), size_of::<CwBvhNode>() as f64 / 16.0);
    }
}
