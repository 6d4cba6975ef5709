//! One frame as a list: each value is a pass's result and the next one's permission to run.

use glam::Quat;
use lanternfish_gpu::Frame;

use crate::{
    debug_views::DebugViews,
    deep_images::{KeptDeepImages, directions::rotation_of_turn},
    error::RenderError,
    gpu_scene::{GpuScene, VisibleDraws},
    indirect::{IndirectLight, IndirectSums},
    light_culling::{LightCulling, LightLists, Reach, Seen},
    occlusion::{Occlusion, Openness},
    output::Output,
    prepass::{Prepass, Surface},
    progressive::Progressive,
    shading::{Arriving, Forward, NearestBlended},
    shadows::{Shadows, VisibilityPlan},
    sky::Sky,
    texture::Radiance,
    view::{View, ViewBuffer},
};

/// The passes of a frame, compiled for one choice of settings.
#[derive(Debug)]
pub(crate) struct Passes {
    pub prepass: Prepass,
    /// Where pixels have several samples, and a pass wants the surface at their middle.
    pub one_sample: Option<Prepass>,
    pub light_culling: LightCulling,
    pub occlusion: Option<Occlusion>,
    pub shadows: Option<Shadows>,
    pub deep_images: Option<KeptDeepImages>,
    pub indirect: Option<IndirectLight>,
    /// Where light arrives otherwise than straight from the lights.
    pub nearest_blended: Option<NearestBlended>,
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
    pub indirect: Option<IndirectSums>,
    /// At the nearest blended surfaces.
    pub indirect_of_blended: Option<IndirectSums>,
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
        let arriving = self.arriving(frame, scene, &shown, accumulates)?;
        let mut shaded = Vec::with_capacity(views.len());
        for (i, ((shown, lights), arriving)) in shown.iter().zip(lights).zip(&arriving).enumerate() {
            shaded.push(self.shade(frame, scene, shown, lights, blended.get(i), arriving, accumulates)?);
        }
        // One exposure for all views: two eyes see one world.
        if self.debug_views.is_none() {
            let pictures: Vec<_> = shaded.iter().map(Shaded::picture).collect();
            self.output.meter(frame, &pictures)?;
        }
        let finished = shaded.into_iter().zip(&shown).zip(arriving).map(|((shaded, shown), arriving)| {
            let display = self.display(frame, scene, shown, &shaded, &arriving);
            let Shaded { radiance, mean, visibility, indirect_of_blended, lights } = shaded;
            let Arriving { openness, indirect, .. } = arriving;
            FrameResult { radiance, mean, display, visibility, openness, indirect, indirect_of_blended, lights }
        });
        Ok(finished.collect())
    }

    /// What arrives from other surfaces and the surroundings in every view, as far as it is asked for.
    fn arriving(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        shown: &[Shown<'_>],
        accumulates: bool,
    ) -> Result<Vec<Arriving>, RenderError> {
        let Self { occlusion, deep_images, indirect, .. } = self;
        let rotation = shown.first().map_or(Quat::IDENTITY, |shown| rotation_of(shown.view, accumulates));
        let images = deep_images.as_mut().map(|images| images.get(frame, scene, rotation)).transpose()?;
        let mut of_view = |Shown { view, buffer, middle, .. }: &Shown<'_>| {
            let occlusion = occlusion.as_mut();
            let openness = occlusion.map(|occlusion| occlusion.record(frame, scene, buffer, middle, rotation));
            let indirect = indirect.as_mut();
            let indirect =
                indirect.map(|indirect| indirect.record(frame, scene, images, buffer, middle, view.frame_index));
            Ok(Arriving { surface: middle.clone(), openness: openness.transpose()?, indirect: indirect.transpose()? })
        };
        shown.iter().map(&mut of_view).collect()
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

    #[allow(clippy::too_many_arguments, reason = "the results of every pass before this one")]
    fn shade(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        Shown { view, buffer, draws, surface, middle }: &Shown<'_>,
        lights: LightLists,
        blended_lights: Option<&LightLists>,
        arriving: &Arriving,
        accumulates: bool,
    ) -> Result<Shaded, RenderError> {
        let mut plan = None;
        let radiance = match &mut self.shadows {
            None => self.forward.record(frame, scene, draws, buffer, surface, &lights, arriving, None)?,
            Some(shadows) => {
                let plan = plan.insert(shadows.plan(frame, scene, buffer, middle, &lights)?);
                let images = self.deep_images.as_mut().filter(|_| shadows.uses_deep_images());
                let rotation = rotation_of(view, accumulates);
                let images = images.map(|images| images.get(frame, scene, rotation)).transpose()?;
                // Where the visibility of all pixels does not fit one buffer, the frame is made in bands of rows.
                for band in plan.bands() {
                    let visibility = &shadows.record(frame, scene, buffer, middle, &lights, images, plan, band);
                    self.forward.record(frame, scene, draws, buffer, surface, &lights, arriving, Some(visibility))?;
                }
                self.forward.radiance(frame.device, view.size, surface.slot)
            }
        };

        self.sky.record(frame, scene, buffer, surface, &radiance)?;
        let mut indirect_of_blended = None;
        if let Some(lights) = blended_lights.filter(|_| !draws.blended.is_empty()) {
            let rotation = rotation_of(view, accumulates);
            let nearest = self.nearest_blended.as_mut().map(|nearest| {
                nearest.record(frame, scene, draws, buffer, &arriving.surface, view.frame_index, rotation)
            });
            let nearest = nearest.transpose()?;
            self.forward.record_transparent(
                frame,
                scene,
                draws,
                buffer,
                surface,
                lights,
                nearest.as_ref(),
                &radiance,
            )?;
            indirect_of_blended = nearest.and_then(|nearest| nearest.indirect);
        }

        let mean = accumulates.then(|| self.progressive.record(frame, buffer, &radiance, view.size, surface.slot));
        Ok(Shaded { radiance, mean, visibility: plan, indirect_of_blended, lights })
    }

    /// What a display shows of a view: its picture, exposed, or the debug view.
    fn display(
        &self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        Shown { view, buffer, surface, .. }: &Shown<'_>,
        shaded: &Shaded,
        arriving: &Arriving,
    ) -> wgpu::TextureView {
        let Some(debug_views) = &self.debug_views else {
            return self.output.record(frame, shaded.picture(), view.size);
        };
        let ray_counts = shaded.visibility.as_ref().and_then(VisibilityPlan::ray_counts);
        let (lights, openness) = (&shaded.lights, arriving.openness.as_ref());
        debug_views.record(frame, scene, buffer, surface, lights, openness, &shaded.radiance, ray_counts, view.size)
    }
}

/// Frames of one mean that look in the same directions, so that deep images are built once for them. More: fewer builds, and directions
/// that show for longer (figures: `progressive/README.md`).
pub(crate) const FRAMES_A_TURN: u32 = 4;

/// How deep images are turned: some frames of one mean after another look in other directions.
fn rotation_of(view: &View, accumulates: bool) -> Quat {
    if accumulates { rotation_of_turn(view.frame_index / FRAMES_A_TURN) } else { Quat::IDENTITY }
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

/// A view after shading.
struct Shaded {
    radiance: Radiance,
    mean: Option<wgpu::TextureView>,
    visibility: Option<VisibilityPlan>,
    /// At the nearest blended surfaces.
    indirect_of_blended: Option<IndirectSums>,
    /// The opaque surfaces' light lists.
    lights: LightLists,
}

impl Shaded {
    /// Linear radiance, nits.
    fn picture(&self) -> &wgpu::TextureView {
        self.mean.as_ref().unwrap_or(&self.radiance.target)
    }
}

impl Shown<'_> {
    fn seen(&self) -> Seen<'_> {
        Seen { view: self.view, buffer: &self.buffer, surface: &self.surface, middle: &self.middle, draws: &self.draws }
    }
}
