//! The scene drawn for each image.

use glam::UVec2;
use lanternfish_gpu::{Bindings, Frame, RasterPipeline};

use super::{draw, raster};
use crate::{
    deep_images::{
        DeepGrid,
        store::{Turn, Turns},
    },
    error::RenderError,
    settings::DeepImageSettings,
};

#[derive(Debug)]
pub(super) struct PerDirection {
    draw: Turns<RasterPipeline>,
}

impl PerDirection {
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        let module = "deep_images/build/per_direction";
        Ok(Self { draw: Turns::new(settings, |features, label| raster(device, module, features, label))? })
    }

    pub fn gather(&self, frame: &mut Frame<'_>, turn: Turn, grid: &DeepGrid, bindings: &Bindings<'_>) {
        let label = match turn {
            Turn::Count => "deep_images/count",
            Turn::Put => "deep_images/fill",
        };
        let size = UVec2::splat(grid.resolution);
        draw(frame, self.draw.pass(turn), label, size, grid, grid.image_count, bindings);
    }
}
