//! How much of the light of lights that have a size reaches each pixel, by this frame's rays and by those of the frames before.

use glam::UVec2;
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame};

use crate::{
    context::ViewContext,
    error::RenderError,
    gpu_scene::GpuScene,
    indirect::{
        layers_target,
        smoothing::{Doubt, Steady},
    },
    light_culling::{LightCulling, LightLists},
    lights::AREA_LIGHTS,
    settings::{History, Settings, Shadows},
    shaders::SHADERS,
    shadows::{SHADOW_HISTORY, SOFT, Visibility},
};

/// Shadows are all in their new places at once.
const DOUBT: Doubt = Doubt { lasts: 1, counts: 0.0 };

/// The pass that finds the shares, and what views keep of them.
#[derive(Debug)]
pub(crate) struct OpenShares {
    settings: Settings,
    /// For scenes without area lights, and with; compiled for the first of them.
    find: [Option<ComputeKernel>; 2],
    kept: Steady,
}

/// Shares of one view; linear, a channel of light each, in the first of four layers.
#[derive(Debug)]
pub(crate) struct SteadyShares {
    /// Of this frame's rays.
    found: wgpu::TextureView,
    /// Mixed with those of the frames before.
    steady: wgpu::TextureView,
}

impl SteadyShares {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("found_shares", &self.found).texture("steady_shares", &self.steady)
    }
}

/// Features of the shader that finds shares, in scenes with area lights or without.
pub(crate) fn open_share_features(settings: &Settings, has_areas: bool) -> Vec<Feature> {
    let mut features = vec![LightCulling::feature(settings.culling), SHADOW_HISTORY];
    features.extend(settings.casts_soft_shadows().then_some(SOFT));
    features.extend(has_areas.then_some(AREA_LIGHTS));
    features
}

impl OpenShares {
    /// The pass, where shadows of these settings have a history.
    pub fn new(device: &wgpu::Device, settings: &Settings) -> Result<Option<Self>, RenderError> {
        if settings.history == History::Off || settings.shadows == Shadows::None {
            return Ok(None);
        }
        let kept = Steady::new(device, DOUBT)?;
        Ok(Some(Self { settings: settings.clone(), find: [None, None], kept }))
    }

    /// Whether any light of the scene is seen in part.
    pub fn are_of(&self, scene: &GpuScene) -> bool {
        scene.has_area_lights || self.settings.casts_soft_shadows()
    }

    /// Forgets what views have kept.
    pub fn forget(&mut self) {
        self.kept.forget();
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
                let features = open_share_features(&self.settings, scene.has_area_lights);
                let shader = SHADERS.link("shading/open_shares", &features)?;
                none.insert(ComputeKernel::new(frame.device, &shader, "find_shares", "shading/open_shares"))
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
    pub fn steady(&mut self, frame: &mut Frame<'_>, view: &ViewContext<'_>, found: wgpu::TextureView) -> SteadyShares {
        let steady = self.kept.record(frame, view, &view.middle, &found);
        SteadyShares { found, steady }
    }
}
