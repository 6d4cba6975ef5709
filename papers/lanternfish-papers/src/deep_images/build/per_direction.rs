//! Draws the scene once per image.

use glam::UVec2;
use lanternfish::RenderError;
use lanternfish_gpu::{Bindings, Frame, RasterPipeline};

use super::{
    super::{settings::DeepImageSettings, shaders::DeepGrid, store::put_features},
    draw::{draw, raster},
};

#[derive(Debug)]
pub(super) struct PerDirection {
    draw: RasterPipeline,
}

impl PerDirection {
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        let module = "deep_images/build/per_direction";
        Ok(Self { draw: raster(device, module, &put_features(settings), "deep_images/gather")? })
    }

    pub fn gather(&self, frame: &mut Frame<'_>, grid: &DeepGrid, bindings: &Bindings<'_>) {
        let size = UVec2::splat(grid.resolution);
        draw(frame, &self.draw, "deep_images/gather", size, grid, grid.image_count, bindings);
    }
}
