//! Builds the tree over lights with a position on the device (`build.wesl`).

use std::sync::Arc;

use glam::{Vec2, Vec3};
use lanternfish_gpu::{
    ComputeKernel, Frame, GpuError, LinkedShader, Pool, Profiler, gpu_struct, primitives::RadixSort,
};

use super::LightNode;
use crate::{
    common::{WIDTH, workgroups},
    lights::{DECLARED, LightSet},
};

/// Levels that one pass makes above the one that it reads; the shader's `PAIRS` is two to this power, halved.
const LEVELS: u32 = 8;

gpu_struct! {
    /// Parameters of the passes that build the tree.
    pub struct BuiltTree {
        /// Least corner of the box around the centres of lights that have one, world space, m.
        low: Vec3,
        /// Number of all lights.
        light_count: u32,
        /// Size of that box, m.
        size: Vec3,
        /// Number of lights in the tree.
        placed_count: u32,
        /// Root of the tree in the buffer of nodes.
        first_node: u32,
        /// Level of the nodes that the pass reads; the root's is 0.
        level: u32,
        /// First of them in `joined`.
        first_read: u32,
        /// Where the pass puts the nodes that the next one reads.
        first_written: u32,
    }
}

gpu_struct! {
    /// One light, or several together, before they are rounded; world space, m.
    pub struct Emitters {
        /// Least corner of their box.
        low: Vec3,
        /// Sum of their greatest intensities, brightest channel, cd; 0: none.
        power: f32,
        /// Greatest corner of their box.
        high: Vec3,
        /// Distance from the box beyond which no light arrives, m.
        range: f32,
        /// Axis of the cone of their normals, unit length; zero: all directions.
        axis: Vec3,
        /// Sine of the greatest angle between the axis and a normal; 1: all directions.
        sin_spread: f32,
        /// Cosine of the greatest angle between a normal and emitted light.
        cos_reach: f32,
        /// Unused.
        _pad: f32,
        /// Unused.
        _pad_2: Vec2,
    }
}

/// The passes, and the memory that they use again: 16 bytes a light.
#[derive(Debug)]
pub(super) struct TreeBuilder {
    keys: ComputeKernel,
    leaves: ComputeKernel,
    levels: ComputeKernel,
    sort: RadixSort,
    profiler: Profiler,
    pool: Pool,
}

impl TreeBuilder {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, GpuError> {
        Self::of(device, queue, &DECLARED.link("lights/tree/build", &[])?)
    }

    /// The same, of this shader.
    pub fn of(device: &wgpu::Device, queue: &wgpu::Queue, shader: &Arc<LinkedShader>) -> Result<Self, GpuError> {
        let kernel = |entry: &str| ComputeKernel::new(device, shader, entry, &format!("lights/tree/{entry}"));
        Ok(Self {
            keys: kernel("keys"),
            leaves: kernel("leaves"),
            levels: kernel("levels"),
            sort: RadixSort::new(device, "lights/tree/sort")?,
            profiler: Profiler::new(device, queue),
            pool: Pool::new(device),
        })
    }

    /// Builds the tree over those of these lights that have a position and shine, `placed_count` by number, and submits the passes. Its
    /// root is the node `first_node`. Equal lights give equal nodes: the sort is stable, and its input is in the order of the lights.
    pub fn build(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        lights: &LightSet,
        placed_count: u32,
        nodes: &wgpu::Buffer,
        first_node: u32,
    ) -> Result<(), GpuError> {
        if placed_count == 0 {
            return Ok(());
        }
        let light_count = lights.capacity;
        let mut frame = Frame::pooled(device, queue, &mut self.profiler, &mut self.pool);
        let mut tree = BuiltTree {
            low: lights.bounds.min,
            light_count,
            size: lights.bounds.size(),
            placed_count,
            first_node,
            level: depth_over(placed_count),
            ..BuiltTree::default()
        };
        let order = frame.scratch("lights/tree/order", 4 * u64::from(light_count))?;
        let keys = frame.scratch("lights/tree/keys", 4 * u64::from(light_count))?;
        let parameters = frame.uniform(&tree);
        let of_lights = lights.bindings();
        let sorting =
            of_lights.clone().part("built_tree", &parameters).buffer("light_order", &order).buffer("light_keys", &keys);
        frame.dispatch(&self.keys, &sorting, workgroups(light_count));
        self.sort.record(&mut frame, &keys, &order, light_count, u32::BITS)?;

        let passes = passes(tree.level);
        let joined_count = passes.iter().map(|(_, groups)| u64::from(*groups)).sum::<u64>();
        let joined = frame.scratch("lights/tree/joined", size_of::<Emitters>() as u64 * joined_count)?;
        for (i, (level, groups)) in passes.into_iter().enumerate() {
            tree.level = level;
            let parameters = frame.uniform(&tree);
            let joining = of_lights
                .clone()
                .part("built_tree", &parameters)
                .buffer("light_order", &order)
                .buffer("built_nodes", nodes)
                .buffer("joined", &joined);
            let kernel = if i == 0 { &self.leaves } else { &self.levels };
            frame.dispatch(kernel, &joining, [WIDTH.min(groups), groups.div_ceil(WIDTH), 1]);
            tree.first_read = tree.first_written;
            tree.first_written += groups;
        }
        frame.submit();
        // The times are nobody's; unread ones would pile up.
        while !self.profiler.finished().is_empty() {}
        Ok(())
    }
}

/// Levels below the root of a tree over this many emitters.
pub(super) fn depth_over(count: u32) -> u32 {
    count.max(1).next_power_of_two().ilog2()
}

/// Nodes of a tree over this many emitters.
pub(super) fn nodes_over(count: u32) -> u32 {
    if count == 0 { 0 } else { 2 * count.next_power_of_two() - 1 }
}

/// Size of a tree's nodes, bytes.
pub(super) fn bytes_of(nodes: usize) -> u64 {
    (nodes * size_of::<LightNode>()) as u64
}

/// The level that each pass reads, and its workgroups.
fn passes(depth: u32) -> Vec<(u32, u32)> {
    let mut passes = Vec::new();
    let mut level = depth;
    loop {
        let next = level.saturating_sub(LEVELS);
        passes.push((level, 1 << next));
        if next == 0 {
            return passes;
        }
        level = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_passes_make_every_level() {
        assert_eq!(f64::from(1u32 << (LEVELS - 1)), crate::shaders::constant("lights/tree/build", "PAIRS"));
        assert_eq!(passes(0), [(0, 1)]);
        assert_eq!(passes(8), [(8, 1)]);
        assert_eq!(passes(9), [(9, 2), (1, 1)]);
        assert_eq!(passes(20), [(20, 1 << 12), (12, 1 << 4), (4, 1)]);
        assert_eq!([0, 1, 2, 3, 1000].map(nodes_over), [0, 1, 3, 7, 2047]);
    }
}
