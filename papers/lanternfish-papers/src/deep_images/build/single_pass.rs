//! All images from one draw of the scene: samples, which are then distributed to all images.

use glam::UVec2;
use lanternfish::{RenderError, common::workgroups, gpu_scene::GpuScene};
use lanternfish_gpu::{Bindings, ComputeKernel, Frame, RasterPipeline, storage_buffer, uniform_buffer_of};

use super::{
    super::{
        settings::{DeepBuilder, DeepImageSettings},
        shaders::{DECLARED, DeepGrid, LITERAL},
        store::put_features,
    },
    draw::{draw, raster},
};

#[derive(Debug)]
pub(super) struct SinglePass {
    sample: RasterPipeline,
    distribute: ComputeKernel,
    /// Capacity for samples.
    capacity: u32,
    supersampling: u32,
}

/// The samples of the single pass.
#[derive(Debug)]
pub(super) struct Samples {
    samples: wgpu::Buffer,
    count: wgpu::Buffer,
    taken: u32,
}

impl Samples {
    pub fn bind<'a>(&'a self, bindings: Bindings<'a>) -> Bindings<'a> {
        bindings.buffer("surface_samples", &self.samples).buffer("sample_count", &self.count)
    }
}

impl SinglePass {
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        let literal = (settings.builder == DeepBuilder::SinglePassLiteral).then_some(LITERAL);
        let features: Vec<_> = put_features(settings).into_iter().chain(literal).collect();
        let distribute = DECLARED.link("deep_images/build/distribute", &features)?;
        Ok(Self {
            sample: raster(device, "deep_images/build/single_pass", &[], "deep_images/sample")?,
            distribute: ComputeKernel::new(device, &distribute, "distribute", "deep_images/gather"),
            // Three axes, with a few surfaces behind each other.
            capacity: 12 * (settings.resolution * settings.supersampling).pow(2),
            supersampling: settings.supersampling,
        })
    }

    /// Samples of all surfaces. If the list is too small, it is grown and the scene is drawn again.
    pub fn sample(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, grid: &DeepGrid) -> Result<Samples, RenderError> {
        let raster = grid.resolution * self.supersampling;
        let grid_buffer = uniform_buffer_of(frame.device, "deep_images/grid", grid);
        loop {
            let samples = storage_buffer(frame.device, "deep_images/samples", 32 * u64::from(self.capacity))?;
            let count = storage_buffer(frame.device, "deep_images/sample_count", 4)?;
            let scene_bindings = scene.bindings();
            let bindings = scene_bindings
                .buffer("deep_grid", &grid_buffer)
                .buffer("surface_samples", &samples)
                .buffer("sample_count", &count);
            draw(frame, &self.sample, "deep_images/sample", UVec2::new(3 * raster, raster), grid, 1, &bindings);
            let taken = frame.read_now::<u32>(&count, 1)?[0];
            if taken <= self.capacity {
                return Ok(Samples { samples, count, taken });
            }
            tracing::debug!(taken, capacity = self.capacity, "deep_images/samples grows");
            self.capacity = taken;
        }
    }

    pub fn gather(&self, frame: &mut Frame<'_>, samples: &Samples, bindings: &Bindings<'_>) {
        frame.dispatch(&self.distribute, bindings, workgroups(samples.taken.max(1)));
    }
}
