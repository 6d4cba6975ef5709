//! Computes the fragments of every triangle in all images.

use lanternfish::{RenderError, common::workgroups};
use lanternfish_gpu::{Bindings, ComputeKernel, Frame, gpu_constants};

use super::super::{
    settings::DeepImageSettings,
    shaders::{DECLARED, DeepGrid, SLOPES},
    store::put_features,
};

gpu_constants! {
    /// Images per workgroup.
    const SLICE: u32 = 32;
    /// Triangles that an invocation tests as one group.
    const EIGHT: u32 = 8;
}

#[derive(Debug)]
pub(super) struct PerTriangle {
    put: ComputeKernel,
}

impl PerTriangle {
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        let features = [put_features(settings), settings.slopes.then_some(SLOPES).into_iter().collect()].concat();
        let shader = DECLARED.link("deep_images/build/per_triangle", &features)?;
        Ok(Self { put: ComputeKernel::new(device, &shader, "put", "deep_images/gather") })
    }

    pub fn gather(&self, frame: &mut Frame<'_>, grid: &DeepGrid, bindings: &Bindings<'_>) {
        let [x, y, _] = workgroups(grid.triangle_count.div_ceil(EIGHT).max(1));
        frame.dispatch(&self.put, bindings, [x, y, grid.image_count.div_ceil(SLICE)]);
    }
}
