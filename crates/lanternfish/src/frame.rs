//! One frame as a list: each value is a pass's result and the next one's permission to run.

use glam::Quat;
use lanternfish_gpu::Frame;

use crate::{
    context::{FrameContext, ViewContext},
    debug_views::DebugViews,
    error::RenderError,
    gpu_scene::VisibleDraws,
    indirect::{DemodulatedIrradiance, IndirectPasses},
    light_culling::{LightCulling, LightLists, Reach},
    occlusion::{AmbientVisibility, OcclusionPasses},
    output::{Output, display_target, present::Present},
    prepass::{Prepass, ShownViews},
    progressive::Progressive,
    rays::KeptStructure,
    request::{SurfaceSource, Target},
    shading::{
        AccumulatedRatios, Arriving, DemodulatedLight, Forward, NearestTransparent, Shadowing, Sums, VisibilityRatios,
    },
    shadows::{Shadows, Visibility, VisibilityPlan},
    sky::Sky,
    texture::Radiance,
    view::View,
    view::rotations::frame_rotation,
};

/// The passes of a frame, compiled for one choice of settings.
#[derive(Debug)]
pub(crate) struct Passes {
    pub prepass: Prepass,
    /// Where motion is requested: the prepass finds it then.
    pub shown: Option<ShownViews>,
    /// Where pixels have several samples, and a pass wants the surface at their middle.
    pub one_sample: Option<Prepass>,
    pub light_culling: LightCulling,
    pub occlusion: Option<Box<dyn OcclusionPasses>>,
    pub shadows: Option<Shadows>,
    /// What inexact tracers go through.
    pub structure: Option<Box<dyn KeptStructure>>,
    pub indirect: Option<Box<dyn IndirectPasses>>,
    /// Where light arrives otherwise than straight from the lights.
    pub nearest_transparent: Option<NearestTransparent>,
    /// Mixes the share of light that reaches each pixel with that of the frames before, where there is a history.
    pub visibility_ratios: Option<VisibilityRatios>,
    pub forward: Forward,
    /// Where sums are wanted in the place of an image.
    pub irradiance: DemodulatedLight,
    pub sky: Sky,
    pub progressive: Progressive,
    pub output: Output,
    pub debug_views: Option<DebugViews>,
    pub present: Present,
}

/// What a frame leaves behind of a view.
#[derive(Debug)]
pub(crate) struct FrameResult {
    pub shaded: Shaded,
    /// What is shown of it, unless it is radiance that the caller wants.
    pub display: Option<wgpu::TextureView>,
}

/// A view after shading.
#[derive(Debug)]
pub(crate) struct Shaded {
    pub radiance: Radiance,
    /// The other sum, where the radiance is that of direct light on white.
    pub indirect_light: Option<wgpu::TextureView>,
    /// Mean radiance of this frame and the frames before it, where frames are averaged.
    pub mean: Option<wgpu::TextureView>,
    pub visibility: Option<VisibilityPlan>,
    pub ambient_visibility: Option<AmbientVisibility>,
    pub indirect: Option<DemodulatedIrradiance>,
    /// Indirect light at the nearest blended surfaces.
    pub indirect_of_transparent: Option<DemodulatedIrradiance>,
    /// The opaque surfaces' light lists.
    pub lights: LightLists,
}

impl Shaded {
    /// A view of which nothing else was found.
    pub fn of_lights(radiance: Radiance, lights: LightLists) -> Self {
        Self {
            radiance,
            indirect_light: None,
            mean: None,
            visibility: None,
            ambient_visibility: None,
            indirect: None,
            indirect_of_transparent: None,
            lights,
        }
    }

    /// Linear radiance, nits.
    fn rendering(&self) -> &wgpu::TextureView {
        self.mean.as_ref().unwrap_or(&self.radiance.target)
    }
}

/// Which bits of visibility are in their buffer.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Traced {
    /// None.
    Nothing,
    /// Those of the last band.
    LastBand,
}

impl Passes {
    /// Forgets what passes keep from frame to frame: the last one was not handed to the device, or the device refused it.
    pub fn forget(&mut self) {
        if let Some(structure) = &mut self.structure {
            structure.forget();
        }
        if let Some(occlusion) = &mut self.occlusion {
            occlusion.forget();
        }
        if let Some(indirect) = &mut self.indirect {
            indirect.forget();
        }
        if let Some(fractions) = &mut self.visibility_ratios {
            fractions.forget();
        }
        self.light_culling.forget();
        self.forget_shown();
        self.progressive.forget();
        self.present.forget();
    }

    /// Forgets what views have shown: the next frame has none before it.
    pub fn forget_shown(&mut self) {
        if let Some(shown) = &mut self.shown {
            shown.forget();
        }
    }

    /// Records a frame of views of one scene.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        context: &FrameContext<'_>,
    ) -> Result<Vec<FrameResult>, RenderError> {
        if context.views.is_empty() {
            return Ok(Vec::new());
        }
        if let Some(shown) = &mut self.shown {
            shown.begin();
        }
        // What every view shows, then which lights reach it: views may share the work of finding them.
        let views = (0..context.views.len()).map(|slot| self.show(frame, context, slot));
        let mut views: Vec<ViewContext<'_>> = views.collect::<Result<_, _>>()?;
        let set = &context.scene.lights;
        let lights = self.light_culling.record(frame, &views, Reach::Surface, set)?;
        let transparent_lights = match views.iter().any(|view| !view.draws.transparent.is_empty()) {
            true => self.light_culling.record(frame, &views, Reach::Anywhere, set)?,
            false => Vec::new(),
        };
        // Structures are there before the first rays.
        if let Some(structure) = &mut self.structure {
            for view in &mut views {
                view.structure = Some(structure.get(frame, view.scene, view.rotation)?);
            }
        }
        let arriving = self.arriving(frame, &views)?;
        // Then each view by itself.
        let mut results = Vec::with_capacity(views.len());
        for (slot, ((view, lights), arriving)) in views.iter().zip(lights).zip(arriving).enumerate() {
            if context.is_summed(slot) {
                results.push(self.sum(frame, view, lights, arriving)?);
                continue;
            }
            let (radiance, visibility) = self.shade(frame, view, &lights, &arriving)?;
            self.sky.record(frame, view, &radiance)?;
            let indirect_of_transparent = match transparent_lights.get(slot) {
                Some(lights) => self.blend(frame, view, lights, &radiance)?,
                None => None,
            };
            let Arriving { ambient_visibility, indirect, .. } = arriving;
            let shaded = Shaded::of_lights(radiance, lights);
            results.push(Shaded { visibility, ambient_visibility, indirect, indirect_of_transparent, ..shaded });
        }
        // Only now it is certain whether the frame is whole.
        if context.is_averaged {
            frame.count_frame(views.iter().all(|view| view.view.frame_index == 0));
            for (slot, (view, shaded)) in views.iter().zip(&mut results).enumerate() {
                shaded.mean = Some(self.progressive.record(frame, view, &shaded.radiance, slot)?);
            }
        }
        // One exposure for all views: two eyes see one world.
        let is_shown = |slot| !matches!(context.target(slot), Some((_, Target::Radiance(_) | Target::Sums { .. })));
        let shown = results.iter().enumerate().filter(|(slot, _)| is_shown(*slot));
        let renderings: Vec<_> = shown.map(|(_, shaded)| shaded.rendering()).collect();
        if self.debug_views.is_none() && !renderings.is_empty() {
            self.output.meter(frame, &renderings)?;
        }
        self.present.begin();
        let mut finished = Vec::with_capacity(views.len());
        for (slot, (view, shaded)) in views.iter().zip(results).enumerate() {
            let display = self.finish(frame, view, &shaded, context.target(slot))?;
            finished.push(FrameResult { shaded, display });
        }
        Ok(finished)
    }

    /// The prepass of one view.
    fn show<'a>(
        &mut self,
        frame: &mut Frame<'_>,
        context: &FrameContext<'a>,
        slot: usize,
    ) -> Result<ViewContext<'a>, RenderError> {
        let FrameContext { scene, views, is_averaged, requests } = *context;
        let (key, mut view) = (context.key(slot), views[slot]);
        let rotation = rotation_of(&view, is_averaged);
        let is_summed = context.is_summed(slot);
        let before = self.shown.as_mut().filter(|_| !is_summed);
        let before = before.map(|shown| shown.follow(frame, scene, &view, key));
        if let Some(before) = &before {
            view.random_index = before.frames();
            view.forgetful_index = if before.has_just_changed() { view.frame_index } else { view.random_index };
        }
        let buffer = view.record(frame);
        let draws = scene.visible_draws(&view);
        if is_summed {
            let surface = match requests[slot].surface {
                SurfaceSource::Own => self.irradiance.prepass.record(frame, scene, &draws, &buffer, view.size, None)?,
                SurfaceSource::Given { depth, normal_roughness } => {
                    self.irradiance.given.record(frame, depth, normal_roughness, view.size)?
                }
            };
            // Transparent surfaces are the caller's.
            let draws = VisibleDraws { solid: draws.solid, transparent: Vec::new() };
            let middle = surface.clone();
            return Ok(ViewContext { scene, key, view, buffer, draws, surface, middle, rotation, structure: None });
        }
        let mut show =
            |prepass: &mut Prepass| prepass.record(frame, scene, &draws, &buffer, view.size, before.as_ref());
        let surface = show(&mut self.prepass)?;
        let middle = match &mut self.one_sample {
            None => surface.clone(),
            Some(prepass) => show(prepass)?,
        };
        Ok(ViewContext { scene, key, view, buffer, draws, surface, middle, rotation, structure: None })
    }

    /// What arrives from other surfaces and the environment in every view, for the surface at each pixel's middle, as far as it is
    /// asked for.
    fn arriving(&mut self, frame: &mut Frame<'_>, views: &[ViewContext<'_>]) -> Result<Vec<Arriving>, RenderError> {
        let mut of_view = |view: &ViewContext<'_>| {
            let surface = view.middle.clone();
            let occlusion = self.occlusion.as_mut();
            let ambient_visibility = occlusion.map(|occlusion| occlusion.record(frame, view, &surface)).transpose()?;
            let indirect = self.indirect.as_mut();
            let indirect = indirect.map(|indirect| indirect.record(frame, view, &surface)).transpose()?;
            Ok(Arriving { surface, ambient_visibility, indirect })
        };
        views.iter().map(&mut of_view).collect()
    }

    /// Opaque surfaces, shadowed and lit.
    fn shade(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: &LightLists,
        arriving: &Arriving,
    ) -> Result<(Radiance, Option<VisibilityPlan>), RenderError> {
        let radiance = self.forward.target(frame, view.view.size);
        let plan = self.plan(frame, view, lights)?;
        let fractions = self.accumulated_ratios(frame, view, lights, plan.as_ref())?;
        let traced = fractions.as_ref().map_or(Traced::Nothing, |_| Traced::LastBand);
        self.by_bands(frame, view, lights, plan.as_ref(), traced, |passes, frame, visibility| {
            let shadows = Shadowing { visibility, fractions: fractions.as_ref() };
            passes.forward.record(frame, view, lights, arriving, &shadows, &radiance)
        })?;
        Ok((radiance, plan))
    }

    /// The light of surfaces, shadowed and summed.
    fn sum(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: LightLists,
        arriving: Arriving,
    ) -> Result<Shaded, RenderError> {
        let irradiance = self.irradiance.target(frame, view);
        let plan = self.plan(frame, view, &lights)?;
        self.by_bands(frame, view, &lights, plan.as_ref(), Traced::Nothing, |passes, frame, visibility| {
            passes.irradiance.record(frame, view, &lights, &arriving, visibility, &irradiance)
        })?;
        let Sums { direct, indirect } = irradiance;
        let shaded = Shaded::of_lights(Radiance { target: direct, drawn: None }, lights);
        Ok(Shaded {
            indirect_light: Some(indirect),
            visibility: plan,
            ambient_visibility: arriving.ambient_visibility,
            ..shaded
        })
    }

    /// How the shadows of a view are traced, where there are any.
    fn plan(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: &LightLists,
    ) -> Result<Option<VisibilityPlan>, RenderError> {
        self.shadows.as_mut().map(|shadows| shadows.plan(frame, view, lights)).transpose()
    }

    /// The share of the light of lights that have a size that reaches each pixel, mixed with that of the frames before, where there is a history.
    fn accumulated_ratios(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: &LightLists,
        plan: Option<&VisibilityPlan>,
    ) -> Result<Option<AccumulatedRatios>, RenderError> {
        let Some(mut fractions) = self.visibility_ratios.take_if(|fractions| fractions.are_of(view.scene)) else {
            return Ok(None);
        };
        let found = fractions.target(frame, view.view.size);
        let recorded = self.by_bands(frame, view, lights, plan, Traced::Nothing, |_, frame, visibility| {
            visibility.map_or(Ok(()), |visibility| fractions.find(frame, view, lights, visibility, &found))
        });
        let steady = recorded.and_then(|()| fractions.steady(frame, view, found));
        self.visibility_ratios = Some(fractions);
        steady.map(Some)
    }

    /// Traces the shadows of a view, and goes on with them. Where the visibility of all pixels does not fit one buffer, in bands of rows.
    fn by_bands(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: &LightLists,
        plan: Option<&VisibilityPlan>,
        traced: Traced,
        mut go_on: impl FnMut(&mut Self, &mut Frame<'_>, Option<&Visibility<'_>>) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        let Some(plan) = plan else { return go_on(self, frame, None) };
        let is_traced = traced == Traced::LastBand && plan.bands().len() == 1;
        for (index, band) in plan.bands() {
            let Some(shadows) = &mut self.shadows else { unreachable!("they made the plan") };
            let visibility = match is_traced {
                true => plan.band(frame, view.middle.size.y, &band),
                false => shadows.record(frame, view, lights, plan, index, band),
            };
            go_on(self, frame, Some(&visibility))?;
        }
        Ok(())
    }

    /// Transparent surfaces, over the image so far; gives the indirect light at the nearest of them.
    fn blend(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: &LightLists,
        radiance: &Radiance,
    ) -> Result<Option<DemodulatedIrradiance>, RenderError> {
        if view.draws.transparent.is_empty() {
            return Ok(None);
        }
        let nearest = self.nearest_transparent.as_mut().map(|nearest| nearest.record(frame, view)).transpose()?;
        self.forward.record_transparent(frame, view, lights, nearest.as_ref(), radiance)?;
        Ok(nearest.and_then(|nearest| nearest.indirect))
    }

    /// Brings a view's image where it is wanted; gives what is shown of it.
    fn finish(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        shaded: &Shaded,
        target: Option<(u64, Target<'_>)>,
    ) -> Result<Option<wgpu::TextureView>, RenderError> {
        match target {
            Some((_, Target::Radiance(to))) => {
                self.present.copy(frame, shaded.rendering(), to)?;
                Ok(None)
            }
            Some((_, Target::Sums { direct, indirect })) => {
                self.present.copy(frame, &shaded.radiance.target, direct)?;
                if let Some(light) = &shaded.indirect_light {
                    self.present.copy(frame, light, indirect)?;
                }
                Ok(None)
            }
            Some((key, Target::Display(to, format))) => {
                let display = self.present.display(frame, key, view.view.size);
                self.show_image(frame, view, shaded, &display);
                self.present.show(frame, &display, to, format)?;
                Ok(Some(display))
            }
            Some((_, Target::Own)) | None => {
                let display = display_target(frame, view.view.size);
                self.show_image(frame, view, shaded, &display);
                Ok(Some(display))
            }
        }
    }

    /// What a display shows of a view: its image, exposed, or the debug view.
    fn show_image(&self, frame: &mut Frame<'_>, view: &ViewContext<'_>, shaded: &Shaded, display: &wgpu::TextureView) {
        match &self.debug_views {
            None => self.output.record(frame, shaded.rendering(), display),
            Some(debug_views) => debug_views.record(frame, view, shaded, display),
        }
    }
}

/// Frames of one mean that look in the same directions, so that deep images are built once for them. More: fewer builds, and directions
/// that show for longer (figures: `progressive/README.md`).
pub(crate) const FRAMES_PER_ROTATION: u32 = 4;

/// How deep images are turned: some frames of one mean after another look in other directions.
fn rotation_of(view: &View, is_averaged: bool) -> Quat {
    if is_averaged { frame_rotation(view.frame_index / FRAMES_PER_ROTATION) } else { Quat::IDENTITY }
}
