//! One frame as a list: each value is a pass's result and the next one's permission to run.

use glam::Quat;
use lanternfish_gpu::Frame;

use crate::{
    debug_views::DebugViews,
    deep_images::directions::rotation_of_frame,
    error::RenderError,
    gpu_scene::{GpuScene, VisibleDraws},
    light_culling::{LightCulling, LightLists, Reach, Seen},
    occlusion::{Occlusion, Openness},
    output::Output,
    prepass::{Prepass, Surface},
    progressive::Progressive,
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
    pub progressive: Progressive,
    pub output: Output,
    pub debug_views: Option<DebugViews>,
}

/// What a frame leaves behind.
#[derive(Debug)]
pub(crate) struct FrameResult {
    pub radiance: Radiance,
    /// Of this and the frames before it, where it was asked for.
    pub mean: Option<wgpu::TextureView>,
    pub display: wgpu::TextureView,
    pub visibility: Option<VisibilityPlan>,
    pub openness: Option<Openness>,
    /// The opaque surfaces' light lists.
    pub lights: LightLists,
}

impl Passes {
    /// Records a frame of views of one scene; with `accumulates`, what is shown is the mean of it and the frames before.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        views: &[View],
        accumulates: bool,
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
        results
            .map(|(i, (shown, lights))| self.shade(frame, scene, shown, lights, blended.get(i), accumulates))
            .collect()
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
        accumulates: bool,
    ) -> Result<FrameResult, RenderError> {
        // Frames of one mean look in other directions each.
        let rotation = if accumulates { rotation_of_frame(view.frame_index) } else { Quat::IDENTITY };
        let openness = match &mut self.occlusion {
            None => None,
            Some(occlusion) => Some(occlusion.record(frame, scene, buffer, surface, rotation)?),
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

        let mean = accumulates.then(|| self.progressive.record(frame, buffer, &radiance, view.size, surface.slot));
        let display = match &self.debug_views {
            None => self.output.record(frame, buffer, mean.as_ref().unwrap_or(&radiance.target), view.size),
            Some(debug_views) => {
                let ray_counts = plan.as_ref().and_then(VisibilityPlan::ray_counts);
                debug_views.record(frame, scene, buffer, surface, &lights, openness, &radiance, ray_counts, view.size)
            }
        };
        let openness = openness.cloned();
        Ok(FrameResult { radiance, mean, display, visibility: plan, openness, lights })
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
