//! Planes of the scene's triangles, by which entries are found: `planes.wesl`.

use super::DECLARED;
use lanternfish_gpu::{ComputeKernel, Frame, gpu_struct, storage_buffer};

use crate::{
    common::workgroups,
    error::RenderError,
    gpu_scene::{BvhTriangle, GpuScene},
};

gpu_struct! {
    /// The plane that a triangle lies in: a sixth of what the triangle takes. Its normal is off by up to 6.4e-5 rad: 20 m from the triangle's
    /// first corner the plane is off by about 1 mm, and voxels are some hundredth of a scene.
    pub struct TrianglePlane {
        /// Unit, on the side from which the corners go counterclockwise; octahedral, in two snorms of 16 bits.
        normal: u32,
        /// Of the plane's points along that normal, m.
        offset: f32,
    }
}

/// The planes of a scene's triangles where they are now.
#[derive(Debug)]
pub(super) struct Planes {
    make: ComputeKernel,
    /// In the order of the BVH's leaves; and [`GpuScene::generation`] of where the triangles were when they were made.
    made: Option<(wgpu::Buffer, u64)>,
}

impl Planes {
    /// Compiles the pass.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let shader = DECLARED.link("indirect/radiance_cache/planes", &[])?;
        let make = ComputeKernel::new(device, &shader, "make_planes", "radiance_cache/make_planes");
        Ok(Self { make, made: None })
    }

    /// Forgets them.
    pub fn forget(&mut self) {
        self.made = None;
    }

    /// The planes, made again where triangles have moved.
    pub fn of(&mut self, frame: &mut Frame<'_>, scene: &GpuScene) -> Result<wgpu::Buffer, RenderError> {
        let generation = scene.generation();
        if let Some((planes, of)) = &self.made
            && *of == generation
        {
            return Ok(planes.clone());
        }
        let triangles = scene.bvh_triangles().map_or(0, |triangles| triangles.size() / size_of::<BvhTriangle>() as u64);
        let bytes = size_of::<TrianglePlane>() as u64 * triangles;
        let planes = match self.made.take() {
            Some((planes, _)) if planes.size() == bytes => planes,
            _ => {
                // They hold what they bind.
                frame.forget_bind_groups();
                storage_buffer(frame.device, "radiance_cache/planes", bytes)?
            }
        };
        let bindings = scene.bindings().buffer("made_planes", &planes);
        frame.dispatch(&self.make, &bindings, workgroups(triangles as u32));
        self.made = Some((planes.clone(), generation));
        Ok(planes)
    }
}
