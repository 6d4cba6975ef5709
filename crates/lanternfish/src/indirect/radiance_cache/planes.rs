//! Planes of the scene's triangles, for the lookup of entries: `planes.wesl`.

use super::DECLARED;
use lanternfish_gpu::{AcrossFrames, ComputeKernel, Frame, gpu_struct, storage_buffer};

use crate::{
    common::workgroups,
    error::RenderError,
    gpu_scene::{BvhTriangle, GpuScene},
};

gpu_struct! {
    /// The plane of a triangle, in a sixth of the memory of the triangle. The error of its normal is up to 6.4e-5 rad:
    /// 20 m from the triangle's first corner the error is about 1 mm, while voxels are about a hundredth of the scene.
    pub struct TrianglePlane {
        /// Unit normal, on the side from which the corners are counterclockwise; octahedral, two snorms of 16 bits.
        normal: u32,
        /// Distance of the plane from the origin along the normal, m.
        offset: f32,
    }
}

/// Planes whose place an instance takes (`planes.wesl`).
const INSTANCE_PLANES: u64 = 8;

/// The planes of a scene's triangles at their current positions.
#[derive(Debug)]
pub(super) struct Planes {
    make: ComputeKernel,
    /// The planes, in the order of the BVH's leaves, and the [`GpuScene::generation`] for which they were made.
    made: AcrossFrames<Option<(wgpu::Buffer, u64)>>,
}

impl Planes {
    /// Compiles the pass.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let shader = DECLARED.link("indirect/radiance_cache/planes", &[])?;
        let make = ComputeKernel::new(device, &shader, "make_planes", "radiance_cache/make_planes");
        Ok(Self { make, made: AcrossFrames::default() })
    }

    /// The planes, recomputed if triangles have moved.
    pub fn of(&mut self, frame: &mut Frame<'_>, scene: &GpuScene) -> Result<wgpu::Buffer, RenderError> {
        let generation = scene.generation();
        let made = self.made.get(frame);
        if let Some((planes, of)) = made
            && *of == generation
        {
            return Ok(planes.clone());
        }
        let triangles = scene.bvh_triangles().map_or(0, |triangles| triangles.size() / size_of::<BvhTriangle>() as u64);
        // An instance's element is one of the triangles.
        let count = triangles + (INSTANCE_PLANES - 1) * scene.instances_in_levels();
        let bytes = size_of::<TrianglePlane>() as u64 * count;
        let planes = match made.take() {
            Some((planes, _)) if planes.size() == bytes => planes,
            _ => {
                // Bind groups keep the old buffer alive.
                frame.forget_bind_groups();
                storage_buffer(frame.device, "radiance_cache/planes", bytes)?
            }
        };
        let bindings = scene.bindings().buffer("made_planes", &planes);
        frame.dispatch(&self.make, &bindings, workgroups(count as u32));
        *made = Some((planes.clone(), generation));
        Ok(planes)
    }
}

#[cfg(test)]
#[test]
fn an_instance_takes_as_many_places_as_the_shader_says() {
    assert_eq!(crate::shaders::constant("indirect/radiance_cache/planes", "INSTANCE_PLANES"), INSTANCE_PLANES as f64);
}
