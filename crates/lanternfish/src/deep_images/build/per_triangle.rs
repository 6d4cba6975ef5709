//! Every triangle into all images, by arithmetic.

use lanternfish_gpu::{Bindings, ComputeKernel, Frame};

use crate::{
    deep_images::{
        DeepGrid,
        store::{Turn, Turns},
        workgroups,
    },
    error::RenderError,
    settings::DeepImageSettings,
    shaders::SHADERS,
};

/// Images that a workgroup looks at; `SLICE` in `per_triangle.wesl`.
pub const SLICE: u32 = 32;

#[derive(Debug)]
pub(super) struct PerTriangle {
    put: Turns<ComputeKernel>,
}

impl PerTriangle {
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        let put = Turns::new(settings, |features, label| {
            let shader = SHADERS.link("deep_images/build/per_triangle", features)?;
            Ok(ComputeKernel::new(device, &shader, "put", label))
        })?;
        Ok(Self { put })
    }

    pub fn gather(&self, frame: &mut Frame<'_>, turn: Turn, grid: &DeepGrid, bindings: &Bindings<'_>) {
        let [x, y, _] = workgroups(grid.triangle_count.max(1));
        frame.dispatch(self.put.pass(turn), bindings, [x, y, grid.image_count.div_ceil(SLICE)]);
    }
}
