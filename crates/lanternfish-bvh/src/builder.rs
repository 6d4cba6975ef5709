//! The passes of a build.

use lanternfish_gpu::{BufferPart, ComputeKernel, Feature, Frame, GpuError};

use crate::{
    DeviceBvh, NODE_BYTES, Primitives, SHADERS,
    clustering::{BinaryTree, Clustering},
    parameters::{BvhStep, WORKGROUP},
    wide::WideNodes,
};

/// Primitives are triangles.
pub(crate) const TRIANGLES: Feature = Feature::new("triangles");

/// The compiled passes that build and refit trees.
#[derive(Debug)]
pub struct BvhBuilder {
    clustering: Clustering,
    wide: WideNodes,
}

impl BvhBuilder {
    /// Compiles the passes. Within an engine's work ([`lanternfish_gpu::Engine::within`]), those that it has compiled are shared.
    pub fn new(device: &wgpu::Device) -> Result<Self, GpuError> {
        Ok(Self { clustering: Clustering::new(device)?, wide: WideNodes::new(device)? })
    }

    /// Adds the passes that build a tree over the first `count` primitives. The same primitives give the same bits. Fails if a binding of
    /// the device cannot hold the buffer of the primitives.
    ///
    /// # Panics
    ///
    /// If `count` exceeds the capacity of `bvh`, or the buffer is too short: bugs of the caller.
    pub fn build(
        &self,
        frame: &mut Frame<'_>,
        primitives: Primitives<'_>,
        count: u32,
        bvh: &mut DeviceBvh,
    ) -> Result<(), GpuError> {
        assert!(count <= bvh.capacity, "{count} primitives in a BVH for {}", bvh.capacity);
        bvh.count = count;
        if count == 0 {
            frame.encoder().clear_buffer(&bvh.nodes, 0, Some(NODE_BYTES));
            frame.encoder().clear_buffer(&bvh.levels, 0, None);
            return Ok(());
        }
        let tree = BinaryTree::new(frame, count)?;
        self.clustering.record(frame, primitives, &tree, bvh)?;
        self.wide.record(frame, &tree, bvh);
        tree.release(frame);
        Ok(())
    }

    /// Adds the passes that give a tree the boxes of moved primitives, as many and in the same order as those that it was built over.
    pub fn refit(&self, frame: &mut Frame<'_>, primitives: Primitives<'_>, bvh: &DeviceBvh) -> Result<(), GpuError> {
        match bvh.count {
            0 => Ok(()),
            count => self.wide.refit(frame, primitives, bvh, count),
        }
    }
}

/// One kernel for triangles and one for boxes.
#[derive(Debug)]
pub(crate) struct ByKind([ComputeKernel; 2]);

impl ByKind {
    pub fn new(device: &wgpu::Device, module: &str, entry: &str) -> Result<Self, GpuError> {
        Ok(Self([kernel(device, module, entry, &[TRIANGLES])?, kernel(device, module, entry, &[])?]))
    }

    pub fn of(&self, primitives: Primitives<'_>) -> &ComputeKernel {
        &self.0[usize::from(matches!(primitives, Primitives::Boxes(_)))]
    }
}

pub(crate) fn kernel(
    device: &wgpu::Device,
    module: &str,
    entry: &str,
    features: &[Feature],
) -> Result<ComputeKernel, GpuError> {
    let shader = SHADERS.link(module, features)?;
    Ok(ComputeKernel::new(device, &shader, entry, &format!("bvh/{entry}")))
}

/// The parameters of an iteration, or of a level.
pub(crate) fn step(frame: &mut Frame<'_>, count: u32, index: u32, end: u32) -> BufferPart {
    frame.uniform(&BvhStep { count, index, end, _pad: 0 })
}

/// Workgroups for one invocation a primitive.
pub(crate) fn workgroups(count: u32) -> [u32; 3] {
    [count.div_ceil(WORKGROUP), 1, 1]
}
