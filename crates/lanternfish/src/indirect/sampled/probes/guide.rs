//! The directions of probes' rays, guided by what the probes of the frame before saw.

use glam::UVec2;
use lanternfish_gpu::{Bindings, BufferPart, ComputeKernel, Feature, Frame, storage_buffer};

use super::{DECLARED, Placed, ProbeParameters, SUMS_BYTES};
use crate::{context::ViewContext, error::RenderError, prepass::Surface, texture::frame_layers, view::PerView};

/// Rays are guided by the frame before.
pub(super) const GUIDED: Feature = Feature::new("guided");

/// The passes, and the light at the first probes of each view's frame before.
#[derive(Debug)]
pub(super) struct Guide {
    aim: ComputeKernel,
    aim_guided: ComputeKernel,
    views: PerView<ProbesBefore>,
}

/// The first probes of a view's tiles in the frame before.
#[derive(Debug)]
struct ProbesBefore {
    light: wgpu::Buffer,
    tiles: UVec2,
}

impl Guide {
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let kernel = |features: &[Feature]| {
            let shader = DECLARED.link("indirect/sampled/probes/aim", features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, "aim", "indirect/probes/aim"))
        };
        Ok(Self { aim: kernel(&[])?, aim_guided: kernel(&[GUIDED])?, views: PerView::default() })
    }

    /// Chooses the directions: a texture with a layer for each ray.
    pub fn aim(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { buffer, key, .. }: &ViewContext<'_>,
        surface: &Surface,
        probes: &Placed,
        (parameters, uniform): (&ProbeParameters, &BufferPart),
        spots: &wgpu::Buffer,
    ) -> wgpu::TextureView {
        let format = wgpu::TextureFormat::Rg32Uint;
        let rays = frame_layers(frame, "indirect/probes/rays", probes.grid, format, parameters.rays);
        let has_before = surface.motion.as_ref().is_some_and(|motion| motion.before.is_some());
        let before = self.views.get(frame, *key).filter(|before| has_before && before.tiles == parameters.tiles);
        let light_before = before.map(|before| before.light.clone());
        let bindings = buffer.bindings().with(&surface.bindings()).with(&probes.bindings());
        let bindings = bindings.part("probes", uniform).texture("aimed_rays", &rays).buffer("bright_spots", spots);
        let groups = [probes.grid.x, probes.grid.y, 1];
        match &light_before {
            None => frame.dispatch(&self.aim, &bindings, groups),
            Some(light) => {
                let guided: Bindings<'_> = bindings.buffer("probes_before", light);
                frame.dispatch(&self.aim_guided, &guided, groups);
            }
        }
        rays
    }

    /// Keeps the light at the first probe of each tile for the next frame, if that knows where its pixels were.
    pub fn keep(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { key, .. }: &ViewContext<'_>,
        surface: &Surface,
        tiles: UVec2,
        filtered: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        if surface.motion.is_none() {
            return Ok(());
        }
        let bytes = SUMS_BYTES * u64::from(tiles.x) * u64::from(tiles.y);
        let light = match self.views.take(frame, *key).filter(|before| before.tiles == tiles) {
            Some(before) => before.light,
            None => storage_buffer(frame.device, "indirect/probes/light_before", bytes)?,
        };
        frame.encoder().copy_buffer_to_buffer(filtered, 0, &light, 0, bytes);
        self.views.leave(frame, *key, ProbesBefore { light, tiles });
        Ok(())
    }
}
