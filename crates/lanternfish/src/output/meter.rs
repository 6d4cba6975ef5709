//! Automatic exposure; `meter.wesl` describes the steps.

use super::DECLARED;
use lanternfish_gpu::{Bindings, BufferPart, ComputeKernel, Frame, gpu_constants};

use crate::error::RenderError;

/// The passes.
#[derive(Debug)]
pub struct Meter {
    count: ComputeKernel,
    expose: ComputeKernel,
}

/// `BIN_COUNT` of `meter.wesl`.
pub(super) const BIN_COUNT: u64 = 512;

gpu_constants! {
    /// Width and height, in pixels, of the block that a workgroup counts.
    pub(super) const BLOCK_EDGE: u32 = 64;
}

impl Meter {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let shader = DECLARED.link("output/meter", &[])?;
        let kernel = |entry: &str| ComputeKernel::new(device, &shader, entry, &format!("output/{entry}"));
        Ok(Self { count: kernel("count"), expose: kernel("expose") })
    }

    /// Writes the automatic exposure of some images (linear radiance; alpha is the coverage of surfaces), one value for all, into a
    /// buffer: EV, 32-bit float. Nothing is read back.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        renderings: &[&wgpu::TextureView],
        parameters: &BufferPart,
        exposure: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        let weights = frame.zeroed("output/luminance_weights", 4 * BIN_COUNT)?;
        let bindings = Bindings::new().buffer("luminance_weights", &weights).buffer("exposure", exposure);
        let bindings = bindings.part("output_parameters", parameters);
        for rendering in renderings {
            let size = rendering.texture().size();
            let bindings = bindings.clone().with(&Bindings::new().texture("radiance_texture", rendering));
            let blocks = [size.width.div_ceil(BLOCK_EDGE), size.height.div_ceil(BLOCK_EDGE), 1];
            frame.dispatch(&self.count, &bindings, blocks);
        }
        frame.dispatch(&self.expose, &bindings, [1, 1, 1]);
        Ok(())
    }
}
