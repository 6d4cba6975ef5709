//! Demodulated irradiance: the light at visible surfaces without their colours, for programs that do their own shading.

use std::collections::{HashMap, hash_map::Entry};

use super::DECLARED;
use lanternfish_gpu::{Feature, Frame, RasterPipeline, RasterState};

use super::{Arriving, DirectFrom, features};
use crate::{
    context::ViewContext,
    error::RenderError,
    gpu_scene::PANES,
    lights::AREA_LIGHTS,
    prepass::{GivenSurfaces, Prepass},
    rays::Tracer,
    settings::{History, Samples, Settings},
    shadows::{self, Visibility},
    texture::{RADIANCE_FORMAT, frame_target},
};

/// The pass, and the prepasses of its surfaces. Compiled for the first request.
#[derive(Debug)]
pub(crate) struct DemodulatedLight {
    /// For views of the scene's surfaces.
    pub prepass: Prepass,
    /// For views with the caller's G-buffer.
    pub given: GivenSurfaces,
    features: Vec<Feature>,
    /// True if a technique samples direct light.
    is_sampled: bool,
    /// True if scenes with panes use the `panes` variant.
    sees_panes: bool,
    /// The pipelines, by their features.
    pipelines: HashMap<Vec<Feature>, RasterPipeline>,
}

/// The radiance that a white Lambertian surface would reflect to the viewer, linear, nits; alpha: 1 where there is a surface.
#[derive(Clone, Debug)]
pub(crate) struct Sums {
    /// From the listed lights.
    pub direct: wgpu::TextureView,
    /// From other surfaces and the environment.
    pub indirect: wgpu::TextureView,
}

/// Features of the shader, without that of a scene with area lights. It uses one sample per pixel and no history.
pub(crate) fn demodulated_features(settings: &Settings, tracer: Option<Tracer>, is_sampled: bool) -> Vec<Feature> {
    let settings = settings.clone().with_samples(Samples::One).with_history(History::Off);
    let [opaque, _] = features(&settings, tracer, is_sampled);
    opaque
}

impl DemodulatedLight {
    /// Compiles nothing yet.
    pub fn new(settings: &Settings, tracer: Option<Tracer>) -> Self {
        Self {
            prepass: Prepass::new(true, 1),
            given: GivenSurfaces::default(),
            features: demodulated_features(settings, tracer, settings.direct.is_some()),
            is_sampled: settings.direct.is_some(),
            sees_panes: tracer.is_some_and(|tracer| shadows::sees_panes(settings, tracer)),
            pipelines: HashMap::new(),
        }
    }

    /// The targets of a view.
    pub fn target(&self, frame: &mut Frame<'_>, view: &ViewContext<'_>) -> Sums {
        let none = wgpu::TextureUsages::empty();
        let mut target = |label| frame_target(frame, label, view.surface.size, RADIANCE_FORMAT, none, 1);
        Sums { direct: target("irradiance/direct"), indirect: target("irradiance/indirect") }
    }

    /// Writes the irradiance of the visibility's rows, or of the complete view if there are no shadows. The call for the first row clears
    /// the targets.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer, surface, .. }: &ViewContext<'_>,
        direct: DirectFrom<'_>,
        arriving: &Arriving,
        visibility: Option<&Visibility<'_>>,
        irradiance: &Sums,
    ) -> Result<(), RenderError> {
        let mut features = self.features.clone();
        features.extend((scene.has_area_lights && !self.is_sampled).then_some(AREA_LIGHTS));
        features.extend((scene.has_panes() && self.sees_panes && !self.is_sampled).then_some(PANES));
        let pipeline = match self.pipelines.entry(features) {
            Entry::Occupied(pipeline) => pipeline.into_mut(),
            Entry::Vacant(none) => {
                let pipeline = pipeline(frame.device, none.key())?;
                none.insert(pipeline)
            }
        };
        let (scene_bindings, light_bindings, arriving_bindings) =
            (scene.bindings(), direct.bindings(), arriving.bindings());
        let mut bindings = buffer.bindings().with(&scene_bindings).with(&light_bindings).with(&arriving_bindings);
        let mut rows = 0..surface.size.y;
        let visibility_bindings = visibility.map(Visibility::bindings);
        if let (Some(visibility), Some(more)) = (visibility, &visibility_bindings) {
            rows = visibility.rows.clone();
            bindings = bindings.with(more);
        }
        let load = if rows.start == 0 { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
        let color = |view| {
            let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
            Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
        };
        frame.render(LABEL, &[color(&irradiance.direct), color(&irradiance.indirect)], None, |groups, pass| {
            pass.set_scissor_rect(0, rows.start, surface.size.x, rows.end - rows.start);
            pipeline.set(pass);
            pipeline.bind(groups, pass, &bindings, 4);
            pass.draw(0..3, 0..1);
        });
        Ok(())
    }
}

const LABEL: &str = "shading/demodulated";

fn pipeline(device: &wgpu::Device, features: &[Feature]) -> Result<RasterPipeline, RenderError> {
    let shader = DECLARED.link("shading/demodulated", features)?;
    let target = Some(RADIANCE_FORMAT.into());
    let state = RasterState { targets: &[target.clone(), target], ..Default::default() };
    Ok(RasterPipeline::new(device, &shader, "vertex", "fragment", LABEL, &state))
}
