//! Visibility ratios of area lights at each pixel: of this frame's rays, and accumulated over frames.

use super::DECLARED;
use glam::UVec2;
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame};

use crate::{
    context::ViewContext,
    denoise::history::{Histories, HistoryReset, Mix},
    denoise::layers::layers_target,
    error::RenderError,
    gpu_scene::GpuScene,
    light_culling::{LightCulling, LightLists},
    lights::AREA_LIGHTS,
    settings::{History, Settings, Shadows},
    shadows::{SHADOW_HISTORY, SOFT, Visibility},
};

/// The pass that computes visibility ratios, and their histories by view.
#[derive(Debug)]
pub(crate) struct VisibilityRatios {
    settings: Settings,
    /// The kernels without area lights and with; each is compiled for the first scene that needs it.
    find: [Option<ComputeKernel>; 2],
    histories: Histories,
}

/// Visibility ratios of one view; linear, per colour channel, in the first of four layers.
#[derive(Debug)]
pub(crate) struct AccumulatedRatios {
    /// The ratios of this frame's rays.
    estimate: wgpu::TextureView,
    /// The ratios accumulated over frames.
    accumulated: wgpu::TextureView,
}

impl AccumulatedRatios {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("current_ratios", &self.estimate).texture("accumulated_ratios", &self.accumulated)
    }
}

/// Features of the shader that computes the ratios, in scenes with or without area lights.
pub(crate) fn visibility_ratio_features(settings: &Settings, has_areas: bool) -> Vec<Feature> {
    let mut features = vec![LightCulling::feature(&settings.culling), SHADOW_HISTORY];
    features.extend(settings.casts_soft_shadows().then_some(SOFT));
    features.extend(has_areas.then_some(AREA_LIGHTS));
    features
}

impl VisibilityRatios {
    /// Compiles the pass, if these settings give shadows a history.
    pub fn new(device: &wgpu::Device, settings: &Settings) -> Result<Option<Self>, RenderError> {
        if settings.history == History::Off || settings.shadows.technique == Shadows::None {
            return Ok(None);
        }
        // Most tracers show moved shadows at once; deep images may lag by some frames if they are rebuilt on request.
        let lasts = match settings.shadows.technique {
            Shadows::Traced(tracer) => tracer.update_frames(&settings.structure),
            _ => 1,
        };
        let histories =
            Histories::new(device, HistoryReset { lasts, counts: 0.0, deviations: 0.0, restarts: false }, "indirect")?;
        Ok(Some(Self { settings: settings.clone(), find: [None, None], histories }))
    }

    /// True if any light of the scene is seen in part.
    pub fn are_of(&self, scene: &GpuScene) -> bool {
        scene.has_area_lights || self.settings.casts_soft_shadows()
    }

    /// The target of a view's ratios.
    pub fn target(&self, frame: &mut Frame<'_>, size: UVec2) -> wgpu::TextureView {
        layers_target(frame, size)
    }

    /// Computes the ratios of one band of rows.
    pub fn find(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer, center_surface: surface, .. }: &ViewContext<'_>,
        lights: &LightLists,
        visibility: &Visibility<'_>,
        estimate: &wgpu::TextureView,
    ) -> Result<(), RenderError> {
        let slot = &mut self.find[usize::from(scene.has_area_lights)];
        let kernel = match slot {
            Some(kernel) => kernel,
            none => {
                let features = visibility_ratio_features(&self.settings, scene.has_area_lights);
                let shader = DECLARED.link("shading/visibility_ratios", &features)?;
                none.insert(ComputeKernel::new(frame.device, &shader, "find_ratios", "shading/visibility_ratios"))
            }
        };
        let bindings = buffer
            .bindings()
            .with(&scene.bindings())
            .with(&surface.bindings())
            .with(&lights.bindings())
            .with(&visibility.bindings())
            .texture("filtered", estimate);
        frame.dispatch(kernel, &bindings, visibility.blocks());
        Ok(())
    }

    /// Accumulates the ratios of a view, of all bands, over frames.
    pub fn accumulated(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        estimate: wgpu::TextureView,
    ) -> Result<AccumulatedRatios, RenderError> {
        let Some(motion) = &view.center_surface.motion else {
            return Ok(AccumulatedRatios { accumulated: estimate.clone(), estimate });
        };
        let surface = &view.center_surface;
        let mix = Mix { surface, motion, found: &estimate, requested_frames: 0.0, clamped_frames: 0.0 };
        let accumulated = self.histories.record(frame, view, &mix)?;
        Ok(AccumulatedRatios { estimate, accumulated })
    }
}
