//! One frame as a list: each value is a pass's result and the next one's permission to run.

use lanternfish_gpu::Frame;

use crate::{
    debug_views::DebugViews,
    deep_images::{KeptDeepImages, directions::rotation_of_frame},
    error::RenderError,
    gpu_scene::{GpuScene, VisibleDraws},
    indirect::{IndirectLight, IndirectSums},
    light_culling::{LightCulling, LightLists, Reach, Seen},
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
    /// Where pixels have several samples, and a pass wants the surface at their middle.
    pub one_sample: Option<Prepass>,
    pub light_culling: LightCulling,
    pub shadows: Option<Shadows>,
    pub deep_images: Option<KeptDeepImages>,
    pub indirect: Option<IndirectLight>,
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
        let indirect = self.indirect_light(frame, scene, &shown)?;
        let results = shown.iter().zip(lights).enumerate();
        let shade = |(i, (shown, lights)): (usize, (&Shown<'_>, LightLists))| {
            self.shade(frame, scene, shown, lights, blended.get(i), indirect.get(i), accumulates)
        };
        results.map(shade).collect()
    }

    /// What arrives from other surfaces, of every view; none where nothing asks for it.
    fn indirect_light(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        shown: &[Shown<'_>],
    ) -> Result<Vec<IndirectSums>, RenderError> {
        let Some(indirect) = &mut self.indirect else { return Ok(Vec::new()) };
        // Turned in every frame of a picture, so that no direction is left out for good.
        let rotation = rotation_of_frame(shown.first().map_or(0, |shown| shown.view.frame_index));
        let images = self.deep_images.as_mut().map(|images| images.get(frame, scene, rotation)).transpose()?;
        let of_view = |Shown { view, buffer, middle, .. }: &Shown<'_>| {
            indirect.record(frame, scene, images, buffer, middle, view.frame_index)
        };
        shown.iter().map(of_view).collect()
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
        let middle = match &mut self.one_sample {
            None => surface.clone(),
            Some(prepass) => prepass.record(frame, scene, &draws, &buffer, view.size, slot)?,
        };
        Ok(Shown { view, buffer, draws, surface, middle })
    }

    fn shade(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        Shown { view, buffer, draws, surface, .. }: &Shown<'_>,
        lights: LightLists,
        blended_lights: Option<&LightLists>,
        indirect: Option<&IndirectSums>,
        accumulates: bool,
    ) -> Result<FrameResult, RenderError> {
        let mut plan = None;
        let radiance = match self.shadows.as_mut().filter(|_| surface.samples == 1) {
            None => self.forward.record(frame, scene, draws, buffer, surface, &lights, None, indirect)?,
            Some(shadows) => {
                let plan = plan.insert(shadows.plan(frame, scene, buffer, surface, &lights)?);
                // Where the visibility of all pixels does not fit one buffer, the frame is made in bands of rows.
                for band in plan.bands() {
                    let visibility = &shadows.record(frame, scene, buffer, surface, &lights, plan, band);
                    self.forward.record(frame, scene, draws, buffer, surface, &lights, Some(visibility), indirect)?;
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
                debug_views.record(frame, scene, buffer, surface, &lights, &radiance, ray_counts, view.size)
            }
        };
        Ok(FrameResult { radiance, mean, display, visibility: plan, lights })
    }
}

/// A view after the prepass.
struct Shown<'s> {
    view: &'s View,
    buffer: ViewBuffer,
    draws: VisibleDraws<'s>,
    surface: Surface,
    /// With one sample a pixel.
    middle: Surface,
}

impl Shown<'_> {
    fn seen(&self) -> Seen<'_> {
        Seen { view: self.view, buffer: &self.buffer, surface: &self.surface, draws: &self.draws }
    }
}
