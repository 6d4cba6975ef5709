//! How much of the light of lights that have a size reaches each pixel, by this frame's rays and by those of the frames before.

use super::DECLARED;
use glam::UVec2;
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame};

use crate::{
    context::ViewContext,
    error::RenderError,
    gpu_scene::GpuScene,
    indirect::{
        history::{Histories, HistoryReset, Mix},
        layers_target,
    },
    light_culling::{LightCulling, LightLists},
    lights::AREA_LIGHTS,
    settings::{History, Settings, Shadows},
    shadows::{SHADOW_HISTORY, SOFT, Visibility},
};

/// The pass that finds the shares, and what views keep of them.
#[derive(Debug)]
pub(crate) struct VisibilityRatios {
    settings: Settings,
    /// For scenes without area lights, and with; compiled for the first of them.
    find: [Option<ComputeKernel>; 2],
    histories: Histories,
}

/// Shares of one view; linear, a channel of light each, in the first of four layers.
#[derive(Debug)]
pub(crate) struct AccumulatedRatios {
    /// Of this frame's rays.
    found: wgpu::TextureView,
    /// Mixed with those of the frames before.
    steady: wgpu::TextureView,
}

impl AccumulatedRatios {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("current_ratios", &self.found).texture("accumulated_ratios", &self.steady)
    }
}

/// Features of the shader that finds shares, in scenes with area lights or without.
pub(crate) fn visibility_ratio_features(settings: &Settings, has_areas: bool) -> Vec<Feature> {
    let mut features = vec![LightCulling::feature(&settings.culling), SHADOW_HISTORY];
    features.extend(settings.casts_soft_shadows().then_some(SOFT));
    features.extend(has_areas.then_some(AREA_LIGHTS));
    features
}

impl VisibilityRatios {
    /// The pass, where shadows of these settings have a history.
    pub fn new(device: &wgpu::Device, settings: &Settings) -> Result<Option<Self>, RenderError> {
        if settings.history == History::Off || settings.shadows == Shadows::None {
            return Ok(None);
        }
        // Shadows are all in their new places at once, but where images of before are requested some frames.
        let lasts = match settings.shadows {
            Shadows::Traced(tracer) => tracer.update_frames(&settings.structure),
            _ => 1,
        };
        let histories = Histories::new(device, HistoryReset { lasts, counts: 0.0 })?;
        Ok(Some(Self { settings: settings.clone(), find: [None, None], histories }))
    }

    /// True if any light of the scene is seen in part.
    pub fn are_of(&self, scene: &GpuScene) -> bool {
        scene.has_area_lights || self.settings.casts_soft_shadows()
    }

    /// Forgets what views have kept.
    pub fn forget(&mut self) {
        self.histories.forget();
    }

    /// Where a view's shares go.
    pub fn target(&self, frame: &mut Frame<'_>, size: UVec2) -> wgpu::TextureView {
        layers_target(frame, size)
    }

    /// Finds the shares of one band of rows.
    pub fn find(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer, middle: surface, .. }: &ViewContext<'_>,
        lights: &LightLists,
        visibility: &Visibility<'_>,
        found: &wgpu::TextureView,
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
            .texture("filtered", found);
        frame.dispatch(kernel, &bindings, visibility.blocks());
        Ok(())
    }

    /// Mixes the shares of a view, of all bands, with those of its frames before.
    pub fn steady(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        found: wgpu::TextureView,
    ) -> Result<AccumulatedRatios, RenderError> {
        let Some(motion) = &view.middle.motion else {
            return Ok(AccumulatedRatios { steady: found.clone(), found });
        };
        let steady = self.target(frame, view.middle.size);
        let surface = &view.middle;
        let mix = Mix { surface, motion, found: &found, mixed: &steady, requested_frames: 0.0, clamped_frames: 0.0 };
        self.histories.record(frame, view, &mix)?;
        Ok(AccumulatedRatios { found, steady })
    }
}
