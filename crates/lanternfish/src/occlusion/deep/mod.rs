//! Ambient occlusion and obscurance by the directions of deep images [Aalund2015, §3.3].

use glam::{Quat, UVec2};
use lanternfish_gpu::{ComputeKernel, Frame, gpu_struct, storage_buffer, uniform_buffer_of};

use super::{Openness, TILE, openness_target};
use crate::{
    deep_images::KeptDeepImages, error::RenderError, gpu_scene::GpuScene, prepass::Surface,
    settings::DeepImageSettings, shaders::SHADERS, view::ViewBuffer,
};

gpu_struct! {
    /// Directions that one pass sums up.
    pub struct DirectionRun {
        /// First of the chunk's images.
        first: u32,
        /// Images.
        count: u32,
        /// From here on nothing occludes, m; 0: everything does, however far.
        max_distance: f32,
        /// 1: nothing has been summed before.
        is_first: u32,
    }
}

/// Images that one pass looks into. A pass for each would spend its time on reading pixels; one for all keeps a slow device
/// busy for longer than a driver may allow.
const IMAGES_A_PASS: u32 = 32;

/// The passes.
#[derive(Debug)]
pub struct DeepOcclusion {
    images: KeptDeepImages,
    accumulate: ComputeKernel,
    resolve: ComputeKernel,
    max_distance: f32,
}

impl DeepOcclusion {
    /// Compiles the passes. `max_distance`: where obscurance ends, m, > 0; without it everything occludes, however far.
    pub fn new(
        device: &wgpu::Device,
        settings: DeepImageSettings,
        max_distance: Option<f32>,
    ) -> Result<Self, RenderError> {
        // Distances need no payload.
        let settings = DeepImageSettings { payload: false, ..settings };
        let shader = SHADERS.link("occlusion/deep/accumulate", &settings.fragment_features())?;
        Ok(Self {
            images: KeptDeepImages::new(device, settings)?,
            accumulate: ComputeKernel::new(device, &shader, "accumulate", "occlusion/deep/accumulate"),
            resolve: ComputeKernel::new(device, &shader, "resolve", "occlusion/deep/resolve"),
            max_distance: max_distance.unwrap_or(0.0),
        })
    }

    /// How open every pixel's surface is, by images of the scene as it is now, whose set of directions is turned by `rotation`.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        view: &ViewBuffer,
        surface: &Surface,
        rotation: Quat,
    ) -> Result<Openness, RenderError> {
        let images = self.images.get(frame, scene, rotation)?;
        let UVec2 { x, y } = surface.size;
        let sums = storage_buffer(frame.device, "occlusion/sums", 8 * u64::from(x) * u64::from(y))?;
        let target = openness_target(frame.device, surface.size);
        let groups = [x.div_ceil(TILE), y.div_ceil(TILE), 1];
        let view_bindings = view.bindings();
        let shared = view_bindings.with(&surface.bindings()).buffer("openness_sums", &sums);
        let mut is_first = 1;
        for chunk in &images.chunks {
            let of_chunk = shared.clone().with(&chunk.bindings(&images.frames));
            for first in (0..chunk.grid.image_count).step_by(IMAGES_A_PASS as usize) {
                let count = IMAGES_A_PASS.min(chunk.grid.image_count - first);
                let run = DirectionRun { first, count, max_distance: self.max_distance, is_first };
                let run = uniform_buffer_of(frame.device, "occlusion/run", &run);
                frame.dispatch(&self.accumulate, &of_chunk.clone().buffer("direction_run", &run), groups);
                is_first = 0;
            }
        }
        frame.dispatch(&self.resolve, &shared.texture("openness_target", &target), groups);
        Ok(Openness { texture: target, images: Some(images.counts) })
    }
}
