//! The same lists of rays through every tracer.

use super::DECLARED;
use glam::Vec3;
use lanternfish_gpu::{ComputeKernel, Feature, Frame, gpu_struct, storage_buffer, storage_buffer_of};

use super::{Tracer, trace_pass::for_each_chunk};
use crate::{
    common::workgroups, deep_images::DeepImages, deep_images::settings::DeepImageSettings, error::RenderError,
    gpu_scene::GpuScene,
};

gpu_struct! {
    /// A ray.
    pub struct TracedRay {
        /// Where it starts, world space, m.
        origin: Vec3,
        /// Image of the nearest direction, times two, plus one where it is read backwards.
        image_and_side: u32,
        /// Unit.
        direction: Vec3,
        /// Surfaces nearer than this are the ray's own, m.
        offset: f32,
    }
}

impl TracedRay {
    /// A ray along `direction` (unit), which the images' nearest direction stands for.
    pub fn new(images: &DeepImages, origin: Vec3, direction: Vec3, offset: f32) -> Self {
        let (image, reversed) = images.directions.nearest(direction);
        Self { origin, image_and_side: 2 * image + u32::from(reversed), direction, offset }
    }
}

/// Traces lists of rays.
#[derive(Debug)]
pub struct RayTracer {
    /// By their features: of every tracer that the device has, through deep images of every kind.
    kernels: Vec<(Vec<Feature>, ComputeKernel)>,
}

impl RayTracer {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let mut kernels = Vec::new();
        for tracer in Tracer::ALL.iter().copied().filter(|tracer| tracer.is_supported(device)) {
            // Distances need no triangles.
            for features in tracer.every_features(false) {
                let shader = DECLARED.link("rays/list", &features)?;
                kernels.push((features, ComputeKernel::new(device, &shader, "trace", &format!("rays/{tracer}"))));
            }
        }
        Ok(Self { kernels })
    }

    /// Puts a list of rays on the device.
    pub fn upload(&self, device: &wgpu::Device, rays: &[TracedRay]) -> Result<wgpu::Buffer, RenderError> {
        Ok(storage_buffer_of(device, "rays/list", rays, wgpu::BufferUsages::empty())?)
    }

    /// Distance that each of `count` rays goes through a tracer, m; −1 where it meets nothing. `images`: what a tracer of deep images
    /// goes through. An error where the device lacks what the tracer needs, or the scene was not uploaded for it.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        tracer: Tracer,
        images: Option<&DeepImages>,
        rays: &wgpu::Buffer,
        count: u32,
    ) -> Result<wgpu::Buffer, RenderError> {
        tracer.check(frame.device, "tracing a list of rays through the adapter's own structure", "another tracer")?;
        scene.check_parts(frame.device, tracer.parts())?;
        let images = images.filter(|_| tracer.uses_deep_images());
        if tracer.uses_deep_images() && images.is_none() {
            return Err(RenderError::Together { setting: "a list of rays through deep images", needed: "the images" });
        }
        let kind = images.map_or_else(DeepImageSettings::default, |images| images.settings);
        let features = tracer.features(&DeepImageSettings { payload: false, ..kind });
        let kernel = self.kernels.iter().find(|(known, _)| *known == features);
        let (_, kernel) = kernel.expect("every kind that the device supports is compiled");
        let distances = storage_buffer(frame.device, "rays/distances", 4 * u64::from(count))?;
        let scene_bindings = scene.bindings();
        let bindings = scene_bindings.buffer("traced_rays", rays).buffer("traced_distances", &distances);
        for_each_chunk(images, &bindings, |bindings| frame.dispatch(kernel, bindings, workgroups(count)));
        Ok(distances)
    }
}
