//! One frame as a list: each value is a pass's result and the next one's permission to run.

use lanternfish_gpu::Frame;

use crate::{
    debug_views::DebugViews,
    error::RenderError,
    gpu_scene::GpuScene,
    light_culling::{LightCulling, LightLists, Reach, Seen},
    output::Output,
    prepass::Prepass,
    shading::{Forward, Radiance},
    shadows::{Shadows, VisibilityPlan},
    sky::Sky,
    view::View,
};

/// The passes of a frame, compiled for one choice of settings.
#[derive(Debug)]
pub(crate) struct Passes {
    pub prepass: Prepass,
    pub light_culling: LightCulling,
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
    /// The opaque surfaces' light lists.
    pub lights: LightLists,
}

impl Passes {
    /// Records the frame of one view.
    pub fn record(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, view: &View) -> Result<FrameResult, RenderError> {
        let view_buffer = &view.upload(frame.device);
        let draws = &scene.visible_draws(view);
        let surface = &self.prepass.record(frame, scene, draws, view_buffer, view.size)?;
        let seen = &[Seen { view, buffer: view_buffer, surface, draws }];
        let lights = &self.light_culling.record(frame, scene, seen, Reach::Surface)?[0];

        let mut plan = None;
        let radiance = match &mut self.shadows {
            None => self.forward.record(frame, scene, draws, view_buffer, surface, lights, None)?,
            Some(shadows) => {
                let plan = plan.insert(shadows.plan(frame, scene, view_buffer, surface, lights)?);
                // Where the visibility of all pixels does not fit one buffer, the frame is made in bands of rows.
                for band in plan.bands() {
                    let visibility = &shadows.record(frame, scene, view_buffer, surface, lights, plan, band);
                    self.forward.record(frame, scene, draws, view_buffer, surface, lights, Some(visibility))?;
                }
                self.forward.radiance(frame.device, view.size)
            }
        };

        self.sky.record(frame, scene, view_buffer, surface, &radiance)?;
        if !draws.blended.is_empty() {
            let lights = &self.light_culling.record(frame, scene, seen, Reach::Anywhere)?[0];
            self.forward.record_transparent(frame, scene, draws, view_buffer, surface, lights, &radiance)?;
        }

        let display = match &self.debug_views {
            None => self.output.record(frame, view_buffer, &radiance, view.size),
            Some(debug_views) => {
                let ray_counts = plan.as_ref().and_then(VisibilityPlan::ray_counts);
                debug_views.record(frame, view_buffer, surface, lights, &radiance, ray_counts, view.size)
            }
        };
        Ok(FrameResult { radiance, display, visibility: plan, lights: lights.clone() })
    }
}
