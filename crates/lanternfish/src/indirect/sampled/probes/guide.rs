//! The directions of probes' rays, guided by what the probes of the frame before saw.

use std::collections::HashMap;

use glam::UVec2;
use lanternfish_gpu::{Bindings, BufferPart, ComputeKernel, Feature, Frame, storage_buffer};

use super::{DECLARED, Placed, ProbeParameters, SUMS_BYTES};
use crate::{
    context::ViewContext,
    error::RenderError,
    prepass::{KEPT_FRAMES, Surface, ViewKey},
    texture::frame_layers,
};

/// Rays are guided by the frame before.
pub(super) const GUIDED: Feature = Feature::new("guided");

/// The passes, and the light at the first probes of each view's frame before.
#[derive(Debug)]
pub(super) struct Guide {
    aim: ComputeKernel,
    aim_guided: ComputeKernel,
    views: HashMap<ViewKey, Kept>,
}

#[derive(Debug)]
struct Kept {
    light: wgpu::Buffer,
    tiles: UVec2,
    last_frame: u64,
}

impl Guide {
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let kernel = |features: &[Feature]| {
            let shader = DECLARED.link("indirect/sampled/probes/aim", features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, "aim", "indirect/probes/aim"))
        };
        Ok(Self { aim: kernel(&[])?, aim_guided: kernel(&[GUIDED])?, views: HashMap::new() })
    }

    /// Discards what earlier frames saw.
    pub fn forget(&mut self) {
        self.views.clear();
    }

    /// Chooses the directions: a texture with a layer for each ray.
    pub fn aim(
        &self,
        frame: &mut Frame<'_>,
        ViewContext { buffer, key, .. }: &ViewContext<'_>,
        surface: &Surface,
        probes: &Placed,
        (parameters, uniform): (&ProbeParameters, &BufferPart),
    ) -> wgpu::TextureView {
        let format = wgpu::TextureFormat::Rg32Uint;
        let rays = frame_layers(frame, "indirect/probes/rays", probes.grid, format, parameters.rays);
        let has_before = surface.motion.as_ref().is_some_and(|motion| motion.before.is_some());
        let kept = self.views.get(key).filter(|kept| has_before && kept.tiles == parameters.tiles);
        let bindings = buffer.bindings().with(&surface.bindings()).with(&probes.bindings());
        let bindings = bindings.part("probes", uniform).texture("aimed_rays", &rays);
        let groups = [probes.grid.x, probes.grid.y, 1];
        match kept {
            None => frame.dispatch(&self.aim, &bindings, groups),
            Some(kept) => {
                let guided: Bindings<'_> = bindings.buffer("probes_before", &kept.light);
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
        let number = frame.number();
        self.views.retain(|_, kept| kept.last_frame + KEPT_FRAMES >= number);
        if surface.motion.is_none() {
            return Ok(());
        }
        let bytes = SUMS_BYTES * u64::from(tiles.x) * u64::from(tiles.y);
        if self.views.get(key).is_none_or(|kept| kept.tiles != tiles) {
            let light = storage_buffer(frame.device, "indirect/probes/light_before", bytes)?;
            self.views.insert(*key, Kept { light, tiles, last_frame: number });
        }
        let kept = self.views.get_mut(key).expect("just made");
        kept.last_frame = number;
        frame.encoder().copy_buffer_to_buffer(filtered, 0, &kept.light, 0, bytes);
        Ok(())
    }
}
