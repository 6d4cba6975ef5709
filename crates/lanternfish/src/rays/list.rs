//! The same lists of rays through every tracer.

use glam::Vec3;
use lanternfish_gpu::{ComputeKernel, Frame, gpu_struct, storage_buffer, storage_buffer_of};

use super::{Tracer, dispatch};
use crate::{
    deep_images::{DeepImages, workgroups},
    error::RenderError,
    gpu_scene::GpuScene,
    settings::{DeepDepth, DeepImageSettings, DeepStore},
    shaders::SHADERS,
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
    /// Of every tracer that the device has; through deep images for each store and depth.
    kernels: Vec<(Tracer, Option<(DeepStore, DeepDepth)>, ComputeKernel)>,
}

impl RayTracer {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let mut kernels = Vec::new();
        for tracer in Tracer::ALL.iter().copied().filter(|tracer| tracer.is_supported(device)) {
            let label = format!("rays/{tracer}");
            let mut compile = |kind, images: &DeepImageSettings| {
                let shader = SHADERS.link("rays/list", &tracer.features(images))?;
                kernels.push((tracer, kind, ComputeKernel::new(device, &shader, "trace", &label)));
                Ok::<_, RenderError>(())
            };
            if !tracer.uses_deep_images() {
                compile(None, &DeepImageSettings::default())?;
                continue;
            }
            for store in DeepStore::ALL.iter().copied() {
                for depth in DeepDepth::ALL.iter().copied().filter(|depth| store.holds(*depth)) {
                    // Distances need no payload.
                    let images = DeepImageSettings { store, depth, payload: false, ..Default::default() };
                    compile(Some((store, depth)), &images)?;
                }
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
        tracer.check(frame.device, tracer.name(), "another tracer")?;
        scene.check_parts(frame.device, tracer.parts())?;
        let images = images.filter(|_| tracer.uses_deep_images());
        let kind = images.map(|images| (images.settings.store, images.settings.depth));
        let kernel = self.kernels.iter().find(|(known, of, _)| (*known, *of) == (tracer, kind));
        let Some((_, _, kernel)) = kernel else {
            return Err(RenderError::Together { setting: tracer.name(), needed: "deep images to go through" });
        };
        let distances = storage_buffer(frame.device, "rays/distances", 4 * u64::from(count))?;
        let scene_bindings = scene.bindings();
        let bindings = scene_bindings.buffer("traced_rays", rays).buffer("traced_distances", &distances);
        dispatch(frame, kernel, &bindings, workgroups(count), images);
        Ok(distances)
    }
}
