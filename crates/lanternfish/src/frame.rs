//! The passes of one frame, in order: the result of each pass is an input of the next.

mod shade;

use glam::Quat;
use lanternfish_gpu::Frame;

use crate::{
    antialiasing::{self, TemporalAntialiasing},
    context::{FrameContext, ViewContext},
    debug_views::DebugViews,
    direct_light::DirectPasses,
    error::RenderError,
    gpu_scene::{Lobes, VisibleDraws},
    indirect::IndirectPasses,
    light_culling::{LightCulling, Reach},
    occlusion::OcclusionPasses,
    output::{Output, display_target, present::Present},
    prepass::{Prepass, ShownViews},
    progressive::Progressive,
    rays::{KeptStructure, Structure},
    request::{SurfaceSource, Target},
    shading::{Arriving, DemodulatedLight, ExtraSurface, Forward, Shaded, VisibilityRatios},
    shadows::Shadows,
    sky::Sky,
    view::View,
    view::rotations::frame_rotation,
};

/// The passes of a frame, compiled for one set of settings.
#[derive(Debug)]
pub(crate) struct Passes {
    pub prepass: Prepass,
    /// The previous views, if motion is computed: the prepass writes it then.
    pub shown: Option<ShownViews>,
    /// The single-sampled prepass, if pixels have several samples and a pass needs the surface at the pixel centre.
    pub one_sample: Option<Prepass>,
    pub light_culling: LightCulling,
    /// The technique of direct light; none: all listed lights.
    pub direct: Option<Box<dyn DirectPasses>>,
    pub occlusion: Option<Box<dyn OcclusionPasses>>,
    pub shadows: Option<Shadows>,
    /// The acceleration structures of inexact tracers, each beside its settings, which differ.
    pub structures: Vec<(Structure, Box<dyn KeptStructure>)>,
    pub indirect: Option<Box<dyn IndirectPasses>>,
    /// The nearest transparent surface.
    pub nearest_transparent: ExtraSurface,
    /// The one behind it.
    pub second_transparent: ExtraSurface,
    /// The clear coats of opaque surfaces.
    pub coats: ExtraSurface,
    /// The other sides of opaque surfaces that scatter light through.
    pub other_sides: ExtraSurface,
    /// Accumulates the visibility ratios of area lights, if there is a history.
    pub visibility_ratios: Option<VisibilityRatios>,
    pub forward: Forward,
    /// Writes demodulated irradiance if it is requested instead of an image.
    pub irradiance: DemodulatedLight,
    /// The environment behind the surfaces, if it is shown.
    pub sky: Option<Sky>,
    pub progressive: Progressive,
    /// Antialiasing of frames that belong to no mean, if it is temporal.
    pub antialiasing: Option<TemporalAntialiasing>,
    pub output: Output,
    pub debug_views: Option<DebugViews>,
    pub present: Present,
}

/// The images of a view after a frame.
#[derive(Debug)]
pub(crate) struct FrameResult {
    pub shaded: Shaded,
    /// The display image, unless the caller requested radiance.
    pub display: Option<wgpu::TextureView>,
}

impl Passes {
    /// Records a frame of views of one scene.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        context: &FrameContext<'_>,
    ) -> Result<Vec<FrameResult>, RenderError> {
        if context.views.is_empty() {
            return Ok(Vec::new());
        }
        // The prepass of every view, then light culling: views may share its work.
        let views = (0..context.views.len()).map(|slot| self.show(frame, context, slot));
        let mut views: Vec<ViewContext<'_>> = views.collect::<Result<_, _>>()?;
        let set = &context.scene.lights;
        let is_sampled = self.direct.is_some();
        let mut lists = |frame: &mut Frame<'_>, is_needed, reach| match is_needed {
            true => Ok(self.light_culling.record(frame, &views, reach, set)?.into_iter().map(Some).collect()),
            false => Ok::<Vec<_>, RenderError>(views.iter().map(|_| None).collect()),
        };
        let has_transparent = views.iter().any(|view| !view.draws.transparent.is_empty());
        // Debug views show lists.
        let lights = lists(frame, !is_sampled || self.debug_views.is_some(), Reach::Surface)?;
        let transparent_lights = lists(frame, !is_sampled && has_transparent, Reach::Anywhere)?;
        // The acceleration structures are ready before the first rays.
        for (settings, structure) in &mut self.structures {
            for view in &mut views {
                view.structures.push((settings.clone(), structure.get(frame, view.scene, view.rotation)?));
            }
        }
        let arriving = self.arriving(frame, &views)?;
        // Then each view alone.
        let mut results = Vec::with_capacity(views.len());
        for (slot, (((view, lights), transparent_lights), arriving)) in
            views.iter().zip(lights).zip(transparent_lights).zip(arriving).enumerate()
        {
            if context.is_demodulated(slot) {
                results.push(self.sum(frame, view, lights, arriving)?);
                continue;
            }
            let (radiance, visibility) = self.shade(frame, view, lights.as_ref(), &arriving)?;
            self.add_from_behind(frame, view, lights.as_ref(), &radiance)?;
            if let Some(sky) = &mut self.sky {
                sky.record(frame, view, &radiance)?;
            }
            let indirect_of_transparent = self.blend(frame, view, transparent_lights.as_ref(), &radiance)?;
            let Arriving { ambient_visibility, indirect, direct, .. } = arriving;
            let shaded = Shaded::of_lights(radiance, lights);
            results.push(Shaded {
                visibility,
                ambient_visibility,
                indirect,
                indirect_of_transparent,
                direct,
                ..shaded
            });
        }
        // Only now is it known whether a list overflowed.
        if context.is_averaged {
            frame.count_frame(views.iter().all(|view| view.view.frame_index == 0));
            for (slot, (view, shaded)) in views.iter().zip(&mut results).enumerate() {
                shaded.mean = Some(self.progressive.record(frame, view, &shaded.radiance, slot)?);
            }
        }
        if let Some(antialiasing) = &mut self.antialiasing {
            // The frames of a mean are antialiased by it, and leave no history.
            if context.is_averaged {
                antialiasing.reset();
            }
            let smoothed = |slot: &usize| !context.is_averaged && !context.is_demodulated(*slot);
            for slot in (0..views.len()).filter(smoothed) {
                let radiance = &results[slot].radiance;
                let image = antialiasing.record(frame, &views[slot], radiance)?;
                results[slot].antialiased = Some(image);
            }
        }
        // One exposure for all views: a stereo pair needs equal brightness.
        let is_shown =
            |slot| !matches!(context.target(slot), Some((_, Target::Radiance(_) | Target::Demodulated { .. })));
        let shown = results.iter().enumerate().filter(|(slot, _)| is_shown(*slot));
        let renderings: Vec<_> = shown.map(|(_, shaded)| shaded.rendering()).collect();
        if self.debug_views.is_none() && !renderings.is_empty() {
            self.output.meter(frame, &renderings, context.scene.light_unit())?;
        }
        let mut finished = Vec::with_capacity(views.len());
        for (slot, (view, shaded)) in views.iter().zip(results).enumerate() {
            let display = self.finish(frame, view, &shaded, context.target(slot))?;
            finished.push(FrameResult { shaded, display });
        }
        frame.check_memory()?;
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
        let is_demodulated = context.is_demodulated(slot);
        let before = self.shown.as_mut().filter(|_| !is_demodulated);
        let before = before.map(|shown| shown.follow(frame, scene, &view, key)).transpose()?;
        // Without a history, a mean depends on no earlier image.
        if let Some(before) = before.as_ref().filter(|before| !is_averaged || before.keeps_history()) {
            view.random_index = before.frames();
            view.forgetful_index = if before.has_just_changed() { view.frame_index } else { view.random_index };
            if self.antialiasing.is_some() && !is_averaged {
                antialiasing::jitter(&mut view, before.frames());
            }
        }
        let buffer = view.record(frame);
        let draws = scene.visible_draws(&view);
        if is_demodulated {
            let surface = match requests[slot].surface {
                SurfaceSource::Own => self.irradiance.prepass.record(frame, scene, &draws, &buffer, view.size, None)?,
                SurfaceSource::Given { depth, normal_roughness } => {
                    self.irradiance.given.record(frame, depth, normal_roughness, view.size)?
                }
            };
            // The caller draws transparent surfaces itself.
            let draws = VisibleDraws { solid: draws.solid, transparent: Vec::new() };
            let center_surface = surface.clone();
            return Ok(ViewContext {
                scene,
                key,
                view,
                buffer,
                draws,
                surface,
                center_surface,
                rotation,
                structures: Vec::new(),
            });
        }
        let mut show =
            |prepass: &mut Prepass| prepass.record(frame, scene, &draws, &buffer, view.size, before.as_ref());
        let surface = show(&mut self.prepass)?;
        let center_surface = match &mut self.one_sample {
            None => surface.clone(),
            Some(prepass) => show(prepass)?,
        };
        Ok(ViewContext { scene, key, view, buffer, draws, surface, center_surface, rotation, structures: Vec::new() })
    }

    /// Sampled direct light, and light from other surfaces and the environment, at the surface at each pixel's centre
    /// of every view, as far as the settings request it.
    fn arriving(&mut self, frame: &mut Frame<'_>, views: &[ViewContext<'_>]) -> Result<Vec<Arriving>, RenderError> {
        let mut of_view = |view: &ViewContext<'_>| {
            let surface = view.center_surface.clone();
            let occlusion = self.occlusion.as_mut();
            let ambient_visibility = occlusion.map(|occlusion| occlusion.record(frame, view, &surface)).transpose()?;
            let indirect = self.indirect.as_mut();
            let indirect = indirect.map(|indirect| indirect.record(frame, view, &surface)).transpose()?;
            let direct = self.direct.as_mut().map(|direct| direct.record(frame, view, &surface)).transpose()?;
            let is_coated = view.draws.solid.iter().any(|draw| draw.lobes == Lobes::Coated);
            let coat = if is_coated { self.coats.record(frame, view, None)?.map(Box::new) } else { None };
            Ok(Arriving { surface, ambient_visibility, indirect, direct, coat, second: None })
        };
        views.iter().map(&mut of_view).collect()
    }

    /// Writes a view's image to its target; returns the display image.
    fn finish(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        shaded: &Shaded,
        target: Option<(u64, Target<'_>)>,
    ) -> Result<Option<wgpu::TextureView>, RenderError> {
        match target {
            Some((_, Target::Radiance(to))) => {
                self.present.copy(frame, shaded.rendering(), view.scene.light_unit(), to)?;
                Ok(None)
            }
            Some((_, Target::Demodulated { direct, indirect })) => {
                self.present.copy(frame, &shaded.radiance.target, view.scene.light_unit(), direct)?;
                if let Some(light) = &shaded.indirect_light {
                    self.present.copy(frame, light, view.scene.light_unit(), indirect)?;
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

    /// Writes the display image of a view: its exposed image, or the debug view.
    fn show_image(&self, frame: &mut Frame<'_>, view: &ViewContext<'_>, shaded: &Shaded, display: &wgpu::TextureView) {
        match &self.debug_views {
            None => self.output.record(frame, shaded.rendering(), view.scene.light_unit(), display),
            Some(debug_views) => debug_views.record(frame, view, shaded, display),
        }
    }
}

/// Number of successive frames of a mean that share the rotation of the direction set, so deep images are built once
/// for them. Higher: fewer builds, but the set's directions stay visible for longer (figures: `progressive/README.md`).
pub(crate) const FRAMES_PER_ROTATION: u32 = 4;

/// The rotation of the direction set of the deep images; in a mean it changes every few frames.
fn rotation_of(view: &View, is_averaged: bool) -> Quat {
    if is_averaged { frame_rotation(view.frame_index / FRAMES_PER_ROTATION) } else { Quat::IDENTITY }
}
