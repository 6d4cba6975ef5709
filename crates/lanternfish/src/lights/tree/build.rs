//! Builds the tree over lights with a position on the device (`build.wesl`).

use glam::{UVec2, Vec2, Vec3};
use lanternfish_gpu::{ComputeKernel, Frame, GpuError, Pool, Profiler, gpu_struct, primitives::RadixSort};

use super::{LightNode, LightTrees};
use crate::{
    common::{WIDTH, workgroups},
    lights::{DECLARED, LightSet},
};

/// Levels that one pass splits or joins, as in the shader; its `PAIRS` is two to this power, halved.
const LEVELS: u32 = 8;
/// Least number of lights whose tree has a level more than its leaves need.
const LEAST_ROOMY: u32 = 4;

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
        /// Level of the leaves; the root's is 0.
        depth: u32,
        /// The lower level of the pass: that of the nodes that it joins, or of the last that it splits.
        level: u32,
        /// First node of that level in `joined` and `ranges`.
        first_read: u32,
        /// First node of the pass' upper level there.
        first_written: u32,
        /// Unused.
        _pad: u32,
        /// Unused.
        _pad_2: UVec2,
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

/// The passes, and the memory that they use again: 17 bytes a light.
#[derive(Debug)]
pub(super) struct TreeBuilder {
    keys: ComputeKernel,
    split: ComputeKernel,
    leaves: ComputeKernel,
    levels: ComputeKernel,
    sort: RadixSort,
    profiler: Profiler,
    pool: Pool,
}

impl TreeBuilder {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, GpuError> {
        let shader = DECLARED.link("lights/tree/build", &[])?;
        let kernel = |entry: &str| ComputeKernel::new(device, &shader, entry, &format!("lights/tree/{entry}"));
        Ok(Self {
            keys: kernel("keys"),
            split: kernel("split"),
            leaves: kernel("leaves"),
            levels: kernel("levels"),
            sort: RadixSort::new(device, "lights/tree/sort")?,
            profiler: Profiler::new(device, queue),
            pool: Pool::new(device),
        })
    }

    /// Builds the tree over those of these lights that have a position and shine, and submits the passes. Equal lights give equal nodes:
    /// the sort is stable, and its input is in the order of the lights.
    pub fn build(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        lights: &LightSet,
        nodes: &wgpu::Buffer,
        layout: &LightTrees,
    ) -> Result<(), GpuError> {
        if layout.light_count == 0 {
            return Ok(());
        }
        let light_count = lights.capacity;
        let mut frame = Frame::pooled(device, queue, &mut self.profiler, &mut self.pool);
        let tree = BuiltTree {
            low: lights.bounds.min,
            light_count,
            size: lights.bounds.size(),
            placed_count: layout.light_count,
            first_node: layout.first_light,
            depth: layout.light_depth,
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

        let passes = passes(tree.depth);
        let upper_count = passes.iter().map(|pass| u64::from(pass.groups)).sum::<u64>();
        let joined = frame.scratch("lights/tree/joined", size_of::<Emitters>() as u64 * upper_count)?;
        let ranges = frame.scratch("lights/tree/ranges", size_of::<UVec2>() as u64 * upper_count)?;
        let joining = sorting.buffer("built_nodes", nodes).buffer("joined", &joined).buffer("ranges", &ranges);
        let mut dispatch = |kernel: &ComputeKernel, pass: &Pass| {
            let Pass { level, first_read, first_written, groups } = *pass;
            let parameters = frame.uniform(&BuiltTree { level, first_read, first_written, ..tree });
            let bindings = joining.clone().part("built_tree", &parameters);
            frame.dispatch(kernel, &bindings, [WIDTH.min(groups), groups.div_ceil(WIDTH), 1]);
        };
        let [lowest, upper @ ..] = &*passes else { unreachable!("a tree has a level") };
        upper.iter().rev().for_each(|pass| dispatch(&self.split, pass));
        dispatch(&self.leaves, lowest);
        upper.iter().for_each(|pass| dispatch(&self.levels, pass));
        frame.submit();
        // The times are nobody's; unread ones would pile up.
        while !self.profiler.finished().is_empty() {}
        Ok(())
    }
}

/// Levels below the root of a tree over this many lights, of at most this many nodes if that is possible. There are two to four times as
/// many leaves as lights, so that lights need not be split into equal halves.
pub(super) fn depth_over(count: u32, most_nodes: u64) -> u32 {
    let least = count.max(1).next_power_of_two().ilog2();
    let is_roomy = count >= LEAST_ROOMY && (4 << least) - 1 <= most_nodes;
    least + u32::from(is_roomy)
}

/// Size of a tree's nodes, bytes.
pub(super) fn bytes_of(nodes: usize) -> u64 {
    (nodes * size_of::<LightNode>()) as u64
}

/// A pass that splits or joins some levels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pass {
    level: u32,
    first_read: u32,
    first_written: u32,
    groups: u32,
}

/// The passes of a tree of this depth, the lowest levels first: each joins what the one before it has written.
fn passes(depth: u32) -> Vec<Pass> {
    let mut passes = Vec::new();
    let mut pass = Pass { level: depth, first_read: 0, first_written: 0, groups: 0 };
    loop {
        let upper = pass.level.saturating_sub(LEVELS);
        pass.groups = 1 << upper;
        passes.push(pass);
        if upper == 0 {
            return passes;
        }
        let Pass { first_written, groups, .. } = pass;
        pass = Pass { level: upper, first_read: first_written, first_written: first_written + groups, groups };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_passes_make_every_level() {
        let constant = |name: &str| crate::shaders::constant("lights/tree/build", name);
        assert_eq!([LEVELS, 1 << (LEVELS - 1)].map(f64::from), ["LEVELS", "PAIRS"].map(constant));
        let levels = |depth: u32| passes(depth).iter().map(|p| (p.level, p.groups)).collect::<Vec<_>>();
        assert_eq!(levels(0), [(0, 1)]);
        assert_eq!(levels(8), [(8, 1)]);
        assert_eq!(levels(9), [(9, 2), (1, 1)]);
        assert_eq!(levels(21), [(21, 1 << 13), (13, 1 << 5), (5, 1)]);
        for pair in passes(21).windows(2) {
            assert_eq!(
                (pair[1].first_read, pair[1].first_written),
                (pair[0].first_written, pair[0].first_written + pair[0].groups)
            );
        }
        let many = u64::MAX;
        assert_eq!([0, 1, 2, 3, 4, 5, 8, 9].map(|count| depth_over(count, many)), [0, 0, 1, 2, 3, 4, 4, 5]);
        assert_eq!([30, 31].map(|most| depth_over(8, most)), [3, 4]);
    }
}
