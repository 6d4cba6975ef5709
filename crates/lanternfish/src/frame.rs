//! One frame as a list: each value is a pass's result and the next one's permission to run.

use glam::{UVec2, Vec3};
use lanternfish_gpu::Frame;

use crate::{
    debug_views::DebugViews,
    error::RenderError,
    gpu_scene::GpuScene,
    light_culling::{LightCulling, Reach},
    output::Output,
    prepass::Prepass,
    shading::{Forward, Radiance},
    shadows::{Shadows, VisibilityPlan},
    view::{View, ViewBuffer},
};

/// The passes of a frame, compiled for one choice of settings.
#[derive(Debug)]
pub(crate) struct Passes {
    pub prepass: Prepass,
    pub light_culling: LightCulling,
    pub shadows: Option<Shadows>,
    pub forward: Forward,
    pub output: Output,
    pub debug_views: Option<DebugViews>,
}

/// What a frame leaves behind.
#[derive(Debug)]
pub(crate) struct FrameResult {
    pub radiance: Radiance,
    pub display: wgpu::TextureView,
    pub visibility: Option<VisibilityPlan>,
    /// Entries of the opaque surfaces' light lists.
    pub listed_lights: u64,
}

impl Passes {
    /// Records the frame of one view.
    pub fn record(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, view: &View) -> Result<FrameResult, RenderError> {
        let view_buffer = view.upload(frame.device);
        let surface = self.prepass.record(frame, scene, &view_buffer, view.size)?;
        let lights = self.light_culling.record(frame, scene, &view_buffer, &surface, Reach::Surface)?;

        let mut visibility_plan = None;
        let mut radiance = None;
        if let Some(shadows) = &mut self.shadows {
            let plan = shadows.plan(frame, scene, &view_buffer, &surface, &lights)?;
            for band in plan.bands() {
                let visibility = shadows.record(frame, scene, &view_buffer, &surface, &lights, &plan, band);
                let (bits, first) = (Some(&visibility), radiance.is_none());
                radiance = Some(self.forward.record(frame, scene, &view_buffer, &surface, &lights, bits, first)?);
            }
            visibility_plan = Some(plan);
        }
        let radiance = match radiance {
            Some(radiance) => radiance,
            None => self.forward.record(frame, scene, &view_buffer, &surface, &lights, None, true)?,
        };

        if scene.has_blended() {
            self.record_transparent(frame, scene, view, &view_buffer, &surface, &radiance)?;
        }

        let display = match &self.debug_views {
            None => self.output.record(frame, &view_buffer, &radiance, view.size),
            Some(debug_views) => {
                let ray_counts = visibility_plan.as_ref().and_then(VisibilityPlan::ray_counts);
                let size: UVec2 = view.size;
                debug_views.record(frame, &view_buffer, &surface, &lights, &radiance, ray_counts, size)
            }
        };
        Ok(FrameResult { radiance, display, visibility: visibility_plan, listed_lights: lights.listed })
    }

    fn record_transparent(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        view: &View,
        view_buffer: &ViewBuffer,
        surface: &crate::prepass::Surface,
        radiance: &Radiance,
    ) -> Result<(), RenderError> {
        let lights = self.light_culling.record(frame, scene, view_buffer, surface, Reach::Anywhere)?;
        let distance = |p_world: Vec3| -view.view_from_world.transform_point3(p_world).z;
        self.forward.record_transparent(frame, scene, view_buffer, surface, &lights, radiance, distance)
    }
}
