//! Traces lists of rays with any tracer.

use super::DECLARED;
use glam::Vec3;
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame, gpu_struct, storage_buffer, storage_buffer_of};

use super::{TracedStructure, Tracer};
use crate::{common::workgroups_of, error::RenderError, gpu_scene::GpuScene};

gpu_struct! {
    /// A ray.
    pub struct TracedRay {
        /// Origin, world space, m.
        origin: Vec3,
        /// Index of the image with the nearest direction, times two, plus one where the image is traversed backwards.
        image_and_side: u32,
        /// Unit direction.
        direction: Vec3,
        /// The ray ignores surfaces nearer than this, m: they belong to its origin.
        offset: f32,
    }
}

impl TracedRay {
    /// A ray along `direction` (unit) that ignores surfaces nearer than `offset`, m. `image`: index of the image with
    /// the nearest direction, for tracers through images of directions; `is_reversed`: the image is traversed
    /// backwards.
    pub fn new(origin: Vec3, direction: Vec3, offset: f32, image: u32, is_reversed: bool) -> Self {
        Self { origin, image_and_side: 2 * image + u32::from(is_reversed), direction, offset }
    }
}

/// Traces lists of rays.
#[derive(Debug)]
pub struct RayTracer {
    /// By feature: every tracer that the device supports, and deep images of every kind.
    kernels: Vec<(Vec<Feature>, ComputeKernel)>,
}

impl RayTracer {
    /// Compiles the passes of all tracers.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        Self::of(device, &Tracer::all())
    }

    /// Compiles the passes of these tracers, as far as the device supports them.
    pub fn of(device: &wgpu::Device, tracers: &[Tracer]) -> Result<Self, RenderError> {
        let mut kernels = Vec::new();
        for tracer in tracers.iter().filter(|tracer| tracer.is_supported(device)) {
            // Distances need no triangles.
            for features in tracer.every_features(false) {
                let shader = DECLARED.link("rays/list", &features)?;
                kernels.push((features, ComputeKernel::new(device, &shader, "trace", &format!("rays/{tracer}"))));
            }
        }
        Ok(Self { kernels })
    }

    /// Uploads a list of rays.
    pub fn upload(&self, device: &wgpu::Device, rays: &[TracedRay]) -> Result<wgpu::Buffer, RenderError> {
        Ok(storage_buffer_of(device, "rays/list", rays, wgpu::BufferUsages::empty())?)
    }

    /// Records a pass that writes the distance of each of `count` rays, m; −1 on a miss. `structure`: the one that the
    /// tracer traverses, if it has any. An error if the device lacks a feature of the tracer, or the scene was not
    /// uploaded for it.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        tracer: Tracer,
        structure: Option<&dyn TracedStructure>,
        rays: &wgpu::Buffer,
        count: u32,
    ) -> Result<wgpu::Buffer, RenderError> {
        tracer.check(frame.device, "tracing a list of rays through the adapter's own structure", "another tracer")?;
        scene.check_parts(frame.device, tracer.parts())?;
        let structure = structure.filter(|_| !tracer.is_exact());
        if !tracer.is_exact() && structure.is_none() {
            return Err(RenderError::Together {
                setting: "a list of rays through a structure",
                needed: "the structure",
            });
        }
        let mut features = structure.map(TracedStructure::distance_features).unwrap_or_default();
        features.push(tracer.feature());
        let kernel = self.kernels.iter().find(|(linked, _)| *linked == features);
        let unknown = RenderError::Together { setting: "a list of rays", needed: "a structure of the tracer's own" };
        let (_, kernel) = kernel.ok_or(unknown)?;
        let distances = storage_buffer(frame.device, "rays/distances", 4 * u64::from(count))?;
        let scene_bindings = scene.bindings();
        let bindings = scene_bindings.buffer("traced_rays", rays).buffer("traced_distances", &distances);
        let groups = workgroups_of(count, kernel.workgroup_size()[0]);
        let mut dispatch = |bindings: &Bindings<'_>| frame.dispatch(kernel, bindings, groups);
        match structure {
            Some(structure) => structure.for_each_part(&bindings, &mut dispatch),
            None => dispatch(&bindings),
        }
        Ok(distances)
    }
}
