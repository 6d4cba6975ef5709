//! One frame as a list: each value is a pass's result and the next one's permission to run.

use lanternfish_gpu::Frame;

use crate::{
    debug_views::DebugViews,
    error::RenderError,
    gpu_scene::{GpuScene, VisibleDraws},
    light_culling::{LightCulling, LightLists, Reach, Seen},
    occlusion::{Occlusion, Openness},
    output::Output,
    prepass::{Prepass, Surface},
    shading::{Forward, Radiance},
    shadows::{Shadows, VisibilityPlan},
    sky::Sky,
    view::{View, ViewBuffer},
};

/// The passes of a frame, compiled for one choice of settings.
#[derive(Debug)]
pub(crate) struct Passes {
    pub prepass: Prepass,
    pub light_culling: LightCulling,
    pub occlusion: Option<Occlusion>,
    pub shadows: Option<Shadows>,
    pub forward: Forward,
    pub sky: Sky,
    pub output: Output,
    pub debug_views: Option<DebugViews>,
}

/// What a frame leaves behind.
#[derive(Debug)]
pub(crate) struct FrameResult {
    pub radiance: Radiance,
    pub display: wgpu::TextureView,
    pub visibility: Option<VisibilityPlan>,
    pub openness: Option<Openness>,
    /// The opaque surfaces' light lists.
    pub lights: LightLists,
}

impl Passes {
    /// Records a frame of views of one scene.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        views: &[View],
    ) -> Result<Vec<FrameResult>, RenderError> {
        // What every view shows, then which lights reach it: views may share the work of finding them.
        let shown = views.iter().enumerate().map(|(slot, view)| self.show(frame, scene, view, slot));
        let shown = shown.collect::<Result<Vec<Shown<'_>>, _>>()?;
        let seen: Vec<Seen<'_>> = shown.iter().map(Shown::seen).collect();
        let lights = self.light_culling.record(frame, scene, &seen, Reach::Surface)?;
        let blended = match shown.iter().any(|shown| !shown.draws.blended.is_empty()) {
            true => self.light_culling.record(frame, scene, &seen, Reach::Anywhere)?,
            false => Vec::new(),
        };
        let results = shown.iter().zip(lights).enumerate();
        results.map(|(i, (shown, lights))| self.shade(frame, scene, shown, lights, blended.get(i))).collect()
    }

    fn show<'s>(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &'s GpuScene,
        view: &'s View,
        slot: usize,
    ) -> Result<Shown<'s>, RenderError> {
        let buffer = view.upload(frame.device);
        let draws = scene.visible_draws(view);
        let surface = self.prepass.record(frame, scene, &draws, &buffer, view.size, slot)?;
        Ok(Shown { view, buffer, draws, surface })
    }

    fn shade(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        Shown { view, buffer, draws, surface }: &Shown<'_>,
        lights: LightLists,
        blended_lights: Option<&LightLists>,
    ) -> Result<FrameResult, RenderError> {
        let openness = match &mut self.occlusion {
            None => None,
            Some(occlusion) => Some(occlusion.record(frame, scene, buffer, surface)?),
        };
        let openness = openness.as_ref();
        let mut plan = None;
        let radiance = match self.shadows.as_mut().filter(|_| surface.samples == 1) {
            None => self.forward.record(frame, scene, draws, buffer, surface, &lights, openness, None)?,
            Some(shadows) => {
                let plan = plan.insert(shadows.plan(frame, scene, buffer, surface, &lights)?);
                // Where the visibility of all pixels does not fit one buffer, the frame is made in bands of rows.
                for band in plan.bands() {
                    let visibility = &shadows.record(frame, scene, buffer, surface, &lights, plan, band);
                    let visibility = Some(visibility);
                    self.forward.record(frame, scene, draws, buffer, surface, &lights, openness, visibility)?;
                }
                self.forward.radiance(frame.device, view.size, surface.slot)
            }
        };

        self.sky.record(frame, scene, buffer, surface, &radiance)?;
        if let Some(lights) = blended_lights.filter(|_| !draws.blended.is_empty()) {
            self.forward.record_transparent(frame, scene, draws, buffer, surface, lights, &radiance)?;
        }

        let display = match &self.debug_views {
            None => self.output.record(frame, buffer, &radiance, view.size),
            Some(debug_views) => {
                let ray_counts = plan.as_ref().and_then(VisibilityPlan::ray_counts);
                debug_views.record(frame, scene, buffer, surface, &lights, openness, &radiance, ray_counts, view.size)
            }
        };
        Ok(FrameResult { radiance, display, visibility: plan, openness: openness.cloned(), lights })
    }
}

/// A view after the prepass.
struct Shown<'s> {
    view: &'s View,
    buffer: ViewBuffer,
    draws: VisibleDraws<'s>,
    surface: Surface,
}

impl Shown<'_> {
    fn seen(&self) -> Seen<'_> {
        Seen { view: self.view, buffer: &self.buffer, surface: &self.surface, draws: &self.draws }
    }
}
