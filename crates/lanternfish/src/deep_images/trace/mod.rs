//! Rays through deep images, and beside them the same rays through the BVH.

use glam::Vec3;
use lanternfish_gpu::{ComputeKernel, Frame, gpu_struct, storage_buffer, storage_buffer_of};

use super::{DeepImages, WIDTH, WORKGROUP};
use crate::{error::RenderError, gpu_scene::GpuScene, shaders::SHADERS};

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
    deep_images: ComputeKernel,
    bvh: ComputeKernel,
}

impl RayTracer {
    /// Compiles the passes `deep_images/trace` and `bvh/trace`.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let kernel = |features: &[&str], label: &str| {
            let shader = SHADERS.link("deep_images/trace/rays", features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, "trace", label))
        };
        Ok(Self { deep_images: kernel(&[], "deep_images/trace")?, bvh: kernel(&["bvh"], "bvh/trace")? })
    }

    /// Puts a list of rays on the device.
    pub fn upload(&self, device: &wgpu::Device, rays: &[TracedRay]) -> Result<wgpu::Buffer, RenderError> {
        Ok(storage_buffer_of(device, "deep_images/rays", rays, wgpu::BufferUsages::empty())?)
    }

    /// Distance that each of `count` rays goes, m; −1 where it meets nothing. Through the images, or, without them, the BVH.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        images: Option<&DeepImages>,
        rays: &wgpu::Buffer,
        count: u32,
    ) -> Result<wgpu::Buffer, RenderError> {
        let distances = storage_buffer(frame.device, "deep_images/distances", 4 * u64::from(count))?;
        let groups = count.div_ceil(WORKGROUP);
        let groups = [WIDTH.min(groups), groups.div_ceil(WIDTH), 1];
        let scene_bindings = scene.bindings();
        let bindings = scene_bindings.buffer("traced_rays", rays).buffer("traced_distances", &distances);
        match images {
            None => frame.dispatch(&self.bvh, &bindings, groups),
            Some(images) => {
                for chunk in &images.chunks {
                    let chunk_bindings = chunk.bindings(&images.frames);
                    frame.dispatch(&self.deep_images, &bindings.clone().with(&chunk_bindings), groups);
                }
            }
        }
        Ok(distances)
    }
}
