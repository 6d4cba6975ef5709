//! A tree over the lights, rebuilt every frame on the device; `light_tree.wesl` describes its layout.

use super::DECLARED;
use glam::{UVec4, Vec3};
use lanternfish_gpu::{Bindings, BufferPart, ComputeKernel, Frame, gpu_constants, gpu_struct, primitives::RadixSort};
use lanternfish_scene::Bounds;

use crate::{error::RenderError, light_culling::clustered::Assignment, lights::LightSet};

gpu_constants! {
    /// Children of a node.
    const FANOUT: u32 = 8;
    /// Greatest number of levels: FANOUT to this power exceeds the lights of any buffer.
    const MOST_LEVELS: usize = 9;
}

/// Bits of a Morton code.
const KEY_BITS: u32 = 30;

gpu_struct! {
    /// Layout of the tree's levels.
    pub struct LightTree {
        /// x: first node of each level; y: number of its nodes.
        levels: [UVec4; MOST_LEVELS],
        /// Least corner of the box around the centres of lights that have one, world space, m.
        low: Vec3,
        /// Number of levels of the tree.
        level_count: u32,
        /// Size of that box, m.
        size: Vec3,
        /// Capacity of the tree, lights; those beyond the set's number are in no box.
        capacity: u32,
    }
}

gpu_struct! {
    /// The level that a join pass makes from the one below.
    pub struct LevelToJoin {
        /// Index of the level; nodes of level 0 hold lights.
        level: u32,
    }
}

impl LightTree {
    /// The levels of a tree over at most this many lights, whose centres lie in this box.
    fn new(capacity: u32, bounds: &Bounds) -> Self {
        let mut tree = Self { low: bounds.min, size: bounds.size(), capacity, ..Self::default() };
        let (mut nodes, mut first) = (capacity.div_ceil(FANOUT).max(1), 0);
        loop {
            tree.levels[tree.level_count as usize] = UVec4::new(first, nodes, 0, 0);
            tree.level_count += 1;
            first += nodes;
            if nodes <= FANOUT {
                return tree;
            }
            nodes = nodes.div_ceil(FANOUT);
        }
    }

    fn node_count(&self) -> u32 {
        let top = self.levels[self.level_count as usize - 1];
        top.x + top.y
    }
}

/// Lights in the layout that one grid's assignment reads.
#[derive(Debug)]
pub struct PlacedLights {
    tree: BufferPart,
    order: wgpu::Buffer,
    placed: wgpu::Buffer,
    nodes: Option<wgpu::Buffer>,
    /// Size of the lights and the tree, bytes.
    pub bytes: u64,
}

impl PlacedLights {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        let bindings = Bindings::new()
            .part("light_tree", &self.tree)
            .buffer("light_order", &self.order)
            .buffer("placed_lights", &self.placed);
        match &self.nodes {
            Some(nodes) => bindings.buffer("tree_nodes", nodes),
            None => bindings,
        }
    }
}

/// The passes.
#[derive(Debug)]
pub struct TreeBuilder {
    assignment: Assignment,
    keys: ComputeKernel,
    scatter: ComputeKernel,
    leaves: ComputeKernel,
    join: ComputeKernel,
    sort: RadixSort,
}

impl TreeBuilder {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, assignment: Assignment) -> Result<Self, RenderError> {
        let shader = DECLARED.link("light_culling/clustered/build_tree", &[])?;
        let kernel =
            |entry: &str| ComputeKernel::new(device, &shader, entry, &format!("light_culling/clustered/{entry}"));
        Ok(Self {
            assignment,
            keys: kernel("keys"),
            scatter: kernel("scatter"),
            leaves: kernel("leaves"),
            join: kernel("join"),
            sort: RadixSort::new(device, "light_culling/clustered/sort")?,
        })
    }

    /// Records the passes that transform the lights of a set into the space of `grid` (bound as `cluster_grid`) and, for the hierarchy,
    /// sort them and build the tree.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        set: &LightSet,
        grid: &BufferPart,
    ) -> Result<PlacedLights, RenderError> {
        let count = set.capacity;
        let tree = LightTree::new(count, &set.bounds);
        let has_tree = self.assignment == Assignment::Hierarchy;
        let node_bytes = 32 * u64::from(tree.node_count());
        let mut lights = PlacedLights {
            tree: frame.uniform(&tree),
            // With a tree, the keys pass writes the order.
            order: match has_tree {
                true => frame.scratch("light_culling/order", 4 * u64::from(count))?,
                false => frame.storage_of("light_culling/order", &(0..count).collect::<Vec<u32>>())?,
            },
            placed: frame.scratch("light_culling/placed", 16 * u64::from(count))?,
            nodes: None,
            bytes: 20 * u64::from(count) + if has_tree { node_bytes } else { 0 },
        };
        let groups = |kernel: &ComputeKernel, items: u32| [items.div_ceil(kernel.workgroup_size()[0]).max(1), 1, 1];
        if has_tree {
            let keys = frame.scratch("light_culling/keys", 4 * u64::from(count))?;
            lights.nodes = Some(frame.scratch("light_culling/nodes", node_bytes)?);
            let bindings = set.bindings().with(&lights.bindings()).buffer("light_keys", &keys);
            frame.dispatch(&self.keys, &bindings, groups(&self.keys, count));
            self.sort.record(frame, &keys, &lights.order, count, KEY_BITS)?;
        }
        let set_bindings = set.bindings();
        let shared = set_bindings.with(&lights.bindings()).part("cluster_grid", grid);
        frame.dispatch(&self.scatter, &shared, groups(&self.scatter, count));
        if lights.nodes.is_some() {
            frame.dispatch(&self.leaves, &shared, groups(&self.leaves, tree.levels[0].y));
            for level in 1..tree.level_count {
                let level_to_join = frame.uniform(&LevelToJoin { level });
                let bindings = shared.clone().part("level_to_join", &level_to_join);
                frame.dispatch(&self.join, &bindings, groups(&self.join, tree.levels[level as usize].y));
            }
        }
        Ok(lights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_hold_all_nodes_of_the_one_below() {
        for count in [0, 1, 7, 8, 9, 64, 65, 4096, 100_000, 8_388_608] {
            let tree = LightTree::new(count, &Bounds::EMPTY);
            let levels = &tree.levels[..tree.level_count as usize];
            assert!(levels[0].y * FANOUT >= count && levels.last().unwrap().y <= FANOUT, "{count}: {levels:?}");
            for pair in levels.windows(2) {
                assert_eq!(pair[1].x, pair[0].x + pair[0].y);
                assert_eq!(pair[1].y, pair[0].y.div_ceil(FANOUT));
            }
        }
    }
}
