//! Temporal accumulation of ambient visibility and environment irradiance.

use super::DECLARED;
use lanternfish_gpu::{ComputeKernel, Frame, Growth};

use super::{AmbientVisibility, OcclusionPasses, TILE, ambient_visibility_target};
use crate::{
    context::ViewContext,
    denoise::history::{Histories, HistoryReset, Mix},
    denoise::layers::layers_target,
    environment_light::irradiance_target,
    error::RenderError,
    prepass::Surface,
    settings::Settings,
};

/// The passes of a technique, and those that accumulate their estimates over frames.
#[derive(Debug)]
pub(super) struct AccumulatedOcclusion {
    passes: Box<dyn OcclusionPasses>,
    gather: ComputeKernel,
    spread: ComputeKernel,
    histories: Histories,
}

impl AccumulatedOcclusion {
    /// Compiles the accumulation passes around those of a technique.
    pub fn new(
        device: &wgpu::Device,
        settings: &Settings,
        passes: Box<dyn OcclusionPasses>,
    ) -> Result<Self, RenderError> {
        let shader = DECLARED.link("occlusion/history", &[])?;
        let kernel = |entry: &str| ComputeKernel::new(device, &shader, entry, &format!("occlusion/{entry}"));
        // Occluders move at once, except in structures that take several frames to update.
        let lasts = settings.occlusion.update_frames(settings);
        let histories =
            Histories::new(device, HistoryReset { lasts, counts: 0.0, deviations: 0.0, restarts: false }, "indirect")?;
        Ok(Self { passes, gather: kernel("gather"), spread: kernel("spread"), histories })
    }
}

impl OcclusionPasses for AccumulatedOcclusion {
    fn check_growth(&self, growth: Growth) -> Result<(), RenderError> {
        self.passes.check_growth(growth)
    }

    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<AmbientVisibility, RenderError> {
        let ambient_visibility = self.passes.record(frame, view, surface)?;
        // Without motion, as for surfaces and irradiance that the caller provides, there is no history.
        let Some(motion) = &surface.motion else { return Ok(ambient_visibility) };
        let estimate = layers_target(frame, surface.size);
        let groups = [surface.size.x.div_ceil(TILE), surface.size.y.div_ceil(TILE), 1];
        let bindings = view.buffer.bindings();
        let bindings = bindings.texture("occlusion_texture", &ambient_visibility.texture);
        let gathering =
            bindings.clone().texture("found_environment_irradiance", &ambient_visibility.environment_irradiance);
        frame.dispatch(&self.gather, &gathering.texture("filtered", &estimate), groups);
        let mix = Mix { surface, motion, found: &estimate, requested_frames: 0.0, clamped_frames: 0.0 };
        let mixed = self.histories.record(frame, view, &mix)?;
        let target = ambient_visibility_target(frame, surface.size);
        let environment_irradiance = irradiance_target(frame, surface.size);
        let spreading = bindings
            .texture("filtered_irradiance", &estimate)
            .texture("mixed_irradiance", &mixed)
            .texture("ambient_visibility_target", &target)
            .texture("environment_irradiance_target", &environment_irradiance);
        frame.dispatch(&self.spread, &spreading, groups);
        Ok(AmbientVisibility { texture: target, environment_irradiance, counters: ambient_visibility.counters })
    }
}
