//! Wide nodes, level by level, and their refit.

use lanternfish_gpu::{Bindings, ComputeKernel, Frame, GpuError};

use crate::{
    BOX_BYTES, DeviceBvh, Primitives,
    builder::{ByKind, kernel, step},
    clustering::BinaryTree,
    most_nodes,
    parameters::MAX_LEVELS,
};

/// Passes of `wide/`.
#[derive(Debug)]
pub(crate) struct WideNodes {
    collapse: ComputeKernel,
    plan: ComputeKernel,
    emit: ComputeKernel,
    refit: ByKind,
}

impl WideNodes {
    pub fn new(device: &wgpu::Device) -> Result<Self, GpuError> {
        let of = |module, entry| kernel(device, module, entry, &[]);
        Ok(Self {
            collapse: of("wide/collapse", "collapse")?,
            plan: of("wide/plan", "plan_level")?,
            emit: of("wide/emit", "emit")?,
            refit: ByKind::new(device, "wide/refit", "refit")?,
        })
    }

    /// Adds the passes that turn a binary tree into wide nodes.
    pub fn record(&self, frame: &mut Frame<'_>, tree: &BinaryTree, bvh: &DeviceBvh) {
        for level in 0..levels_for(tree.count) {
            let own = step(frame, tree.count, level, 0);
            let bindings = tree.bindings().part("bvh_step", &own).with(&of_bvh(bvh));
            frame.dispatch_indirect(&self.collapse, &bindings, &bvh.levels, 32 * u64::from(level));
            frame.dispatch(&self.plan, &bindings, [1; 3]);
            frame.dispatch_indirect(&self.emit, &bindings, &bvh.levels, 32 * u64::from(level));
        }
    }

    /// Adds the passes that refit, the deepest level first.
    pub fn refit(
        &self,
        frame: &mut Frame<'_>,
        primitives: Primitives<'_>,
        bvh: &DeviceBvh,
        count: u32,
    ) -> Result<(), GpuError> {
        let primitive_buffer = primitives.buffer(frame.device, count)?;
        let node_boxes = frame.scratch("bvh/node_boxes", BOX_BYTES * most_nodes(count))?;
        for level in (0..levels_for(count)).rev() {
            let own = step(frame, count, level, 0);
            let bindings = of_bvh(bvh)
                .part("bvh_step", &own)
                .buffer("primitives", primitive_buffer)
                .buffer("node_boxes", &node_boxes);
            frame.dispatch_indirect(self.refit.of(primitives), &bindings, &bvh.levels, 32 * u64::from(level));
        }
        frame.release(&node_boxes);
        Ok(())
    }
}

fn of_bvh(bvh: &DeviceBvh) -> Bindings<'_> {
    Bindings::new().buffer("levels", &bvh.levels).buffer("bvh_nodes", &bvh.nodes).buffer("bvh_indices", &bvh.indices)
}

/// Most levels for this many primitives: a node above others has eight children, and the lowest at least four primitives.
pub(crate) fn levels_for(count: u32) -> u32 {
    (1 + count.saturating_sub(4).div_ceil(7)).min(MAX_LEVELS)
}
