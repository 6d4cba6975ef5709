//! Forward shading of visible opaque surfaces, and of transparent surfaces over them [Elagabani2025, §4.4].

mod arriving;
mod demodulated;
mod extra_surface;
mod refraction;
mod shaded;
#[cfg(test)]
mod tests;
mod visibility_ratios;

use glam::{UVec2, Vec3};
use lanternfish_gpu::{Bindings, Feature, Frame};

use crate::{
    context::ViewContext,
    direct_light::{SAMPLED_LIGHTS, SHADOW_RAYS},
    error::RenderError,
    gpu_scene::{Draw, Faces, ImageBehind, LAYERED, PassState, SceneRaster, TEXTURES},
    indirect::INDIRECT,
    light_culling::{LightCulling, LightLists},
    occlusion,
    prepass::{DEPTH_FORMAT, FROM_BEHIND, MULTISAMPLED},
    rays::Tracer,
    settings::{History, Settings},
    shaders::{Root, Shaders},
    shadows::{self, SHADOW_HISTORY, SOFT, Visibility},
    texture::{RADIANCE_FORMAT, Radiance, frame_target},
};

use self::refraction::{Refraction, split_for_images};

pub use self::arriving::Arriving;
#[cfg(any(test, feature = "testing"))]
pub(crate) use self::{demodulated::demodulated_features, visibility_ratios::visibility_ratio_features};
pub(crate) use self::{
    demodulated::{DemodulatedLight, Sums},
    extra_surface::ExtraSurface,
    shaded::Shaded,
    visibility_ratios::{AccumulatedRatios, VisibilityRatios},
};

/// Transparent surfaces: the colour is premultiplied.
const TRANSPARENT: Feature = Feature::new("transparent");
/// The background is hidden, and alpha is opacity.
const UNCOVERED: Feature = Feature::new("uncovered");
/// Shading reads visibility bits.
const SHADOW_BITS: Feature = Feature::new("shadow_bits");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::by_settings("shading/forward"),
        Root::by_settings("shading/demodulated"),
        Root::by_settings("shading/visibility_ratios"),
        Root::of("shading/dim", &[&[&[TRANSPARENT], &[TRANSPARENT, LAYERED]], TEXTURES]),
        refraction::ROOTS[0],
        refraction::ROOTS[1],
    ],
    &[],
);

/// The passes that shade opaque and transparent surfaces.
#[derive(Debug)]
pub(crate) struct Forward {
    opaque: SceneRaster,
    transparent: SceneRaster,
    /// Light from behind opaque surfaces, added to theirs.
    from_behind: SceneRaster,
    /// Multiplies the image by the transmittance of smooth thin surfaces.
    dim: SceneRaster,
    /// Replaces the image by what is behind other transmitting surfaces.
    refraction: Refraction,
    samples: u32,
    hides_environment: bool,
}

/// Direct light of a view's surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) enum DirectFrom<'a> {
    /// The lights in these lists.
    Lists(&'a LightLists),
    /// Samples: in the layers of the light that arrives.
    Samples,
}

impl DirectFrom<'_> {
    fn bindings(&self) -> Bindings<'_> {
        match self {
            Self::Lists(lists) => lists.bindings(),
            Self::Samples => Bindings::new(),
        }
    }
}

/// The shadows of a view's surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shadowing<'a> {
    /// The visible lights of each pixel, if shadows are traced.
    pub visibility: Option<&'a Visibility<'a>>,
    /// The visibility ratios of area lights at each pixel, if there is a history.
    pub fractions: Option<&'a AccumulatedRatios>,
}

impl Forward {
    /// Compiles nothing; the first scene compiles the pipelines.
    pub fn new(settings: &Settings, tracer: Option<Tracer>) -> Self {
        let depth = |compare| wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(false),
            depth_compare: Some(compare),
            stencil: Default::default(),
            bias: Default::default(),
        };
        let samples = settings.image.samples.count();
        let hides_environment = settings.image.background.hides_environment();
        let over = wgpu::ColorTargetState {
            format: RADIANCE_FORMAT,
            blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            write_mask: wgpu::ColorWrites::ALL,
        };
        let kept_alpha = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::Zero,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let multiplied = wgpu::ColorTargetState {
            blend: Some(wgpu::BlendState {
                color: wgpu::BlendComponent {
                    src_factor: wgpu::BlendFactor::Zero,
                    dst_factor: wgpu::BlendFactor::Src,
                    operation: wgpu::BlendOperation::Add,
                },
                // What the surface lets through shows the background where the image is uncovered.
                alpha: if hides_environment { wgpu::BlendComponent::OVER } else { kept_alpha },
            }),
            ..over.clone()
        };
        let added = wgpu::ColorTargetState {
            blend: Some(wgpu::BlendState {
                color: wgpu::BlendComponent {
                    src_factor: wgpu::BlendFactor::One,
                    dst_factor: wgpu::BlendFactor::One,
                    operation: wgpu::BlendOperation::Add,
                },
                alpha: kept_alpha,
            }),
            ..over.clone()
        };
        let equal = depth(wgpu::CompareFunction::Equal);
        let nearer = depth(wgpu::CompareFunction::GreaterEqual);
        let is_sampled = settings.direct.is_some();
        let [opaque, transparent] = features(settings, tracer, is_sampled);
        let from_behind = [&transparent[..], &[FROM_BEHIND]].concat();
        let raster = |label, features: &[Feature], is_opaque, depth: &wgpu::DepthStencilState, target| {
            let state = PassState { depth: depth.clone(), targets: vec![target], samples, faces: Faces::Shown };
            let raster = SceneRaster::new(label, DECLARED, "shading/forward", features, is_opaque, state);
            let raster = raster.with_layers();
            let raster = if is_sampled { raster } else { raster.lit_by_areas() };
            let sees_panes = tracer.is_some_and(|tracer| !is_opaque || shadows::sees_panes(settings, tracer));
            if sees_panes && !is_sampled { raster.lit_through_panes() } else { raster }
        };
        let opaque = raster("shading/forward", &opaque, true, &equal, RADIANCE_FORMAT.into());
        let transparent = raster("shading/transparent", &transparent, false, &nearer, over);
        let from_behind = raster("shading/from_behind", &from_behind, false, &equal, added);
        let through = PassState { depth: nearer.clone(), targets: vec![multiplied], samples, faces: Faces::Shown };
        let refraction = Refraction::new(&through, hides_environment);
        let dim = SceneRaster::new("shading/transparent", DECLARED, "shading/dim", &[TRANSPARENT], false, through)
            .with_layers();
        Self { opaque, transparent, from_behind, dim, refraction, samples, hides_environment }
    }

    /// The target of one view's image.
    pub fn target(&self, frame: &mut Frame<'_>, size: UVec2) -> Radiance {
        let mut target = |label, more, samples| frame_target(frame, label, size, RADIANCE_FORMAT, more, samples);
        let drawn = (self.samples > 1).then(|| target("radiance/samples", wgpu::TextureUsages::empty(), self.samples));
        Radiance { target: target("radiance", wgpu::TextureUsages::COPY_SRC, 1), drawn }
    }

    /// Shades the visible opaque surfaces of the visibility's rows, or of the complete view if there are no shadows.
    /// `fractions` cover the complete view, if shadows have a history. The call for the first row clears the target to
    /// the sky.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer, draws, surface, .. }: &ViewContext<'_>,
        direct: DirectFrom<'_>,
        arriving: &Arriving,
        &Shadowing { visibility, fractions }: &Shadowing<'_>,
        radiance: &Radiance,
    ) -> Result<(), RenderError> {
        self.opaque.prepare(frame.device, scene, &draws.solid)?;
        let arriving_bindings = arriving.bindings();
        let direct_bindings = direct.bindings();
        let mut bindings = buffer.bindings().with(&scene.bindings()).with(&direct_bindings).with(&arriving_bindings);
        let mut rows = 0..surface.size.y;
        let visibility_bindings = visibility.map(Visibility::bindings);
        if let (Some(visibility), Some(more)) = (visibility, &visibility_bindings) {
            rows = visibility.rows.clone();
            bindings = bindings.with(more);
        }
        let fractions = fractions.map(AccumulatedRatios::bindings);
        let bindings = fractions.iter().fold(bindings, |bindings, more| bindings.with(more));
        let samples = self.samples;
        let sky = if self.hides_environment { wgpu::Color::TRANSPARENT } else { sky(scene.sky) };
        let load = if rows.start == 0 { wgpu::LoadOp::Clear(sky) } else { wgpu::LoadOp::Load };
        frame.render("shading/forward", &[Some(radiance.color(load))], Some(surface.read_depth()), |groups, pass| {
            // Mesa's software driver shifts a scissor by half a pixel with multisampling, so the shader tests the rows
            // there.
            if samples == 1 {
                pass.set_scissor_rect(0, rows.start, surface.size.x, rows.end - rows.start);
            }
            self.opaque.draw(groups, pass, scene, &bindings, &draws.solid);
        });
        Ok(())
    }

    /// Adds the light from behind these opaque draws, with shadows of their own if it is not sampled. `arriving` is the
    /// light at their other sides.
    pub fn record_from_behind(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer, surface, .. }: &ViewContext<'_>,
        direct: DirectFrom<'_>,
        arriving: Option<&Arriving>,
        radiance: &Radiance,
        draws: &[&Draw],
    ) -> Result<(), RenderError> {
        self.from_behind.prepare(frame.device, scene, draws)?;
        let direct_bindings = direct.bindings();
        let bindings = buffer.bindings().with(&scene.bindings()).with(&direct_bindings);
        let arriving_bindings = arriving.map(Arriving::bindings);
        let bindings = arriving_bindings.iter().fold(bindings, |bindings, more| bindings.with(more));
        let color = radiance.color(wgpu::LoadOp::Load);
        frame.render("shading/from_behind", &[Some(color)], Some(surface.read_depth()), |groups, pass| {
            self.from_behind.draw(groups, pass, scene, &bindings, draws);
        });
        Ok(())
    }

    /// Blends the transparent surfaces over the image, each with its own direct light and shadows if it is not sampled.
    /// `arriving` is the light at the nearest of them.
    pub fn record_transparent(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        direct: DirectFrom<'_>,
        arriving: Option<&Arriving>,
        radiance: &Radiance,
    ) -> Result<(), RenderError> {
        let ViewContext { scene, buffer, draws, surface, .. } = view;
        let tinting = |draw: &&Draw| draw.behind == ImageBehind::Tints;
        let tinting: Vec<&Draw> = draws.transparent.iter().copied().filter(tinting).collect();
        self.dim.prepare(frame.device, scene, &tinting)?;
        let seen = self.refraction.record(frame, view)?;
        self.transparent.prepare(frame.device, scene, &draws.transparent)?;
        let direct_bindings = direct.bindings();
        let bindings = buffer.bindings().with(&scene.bindings()).with(&direct_bindings);
        let arriving_bindings = arriving.map(Arriving::bindings);
        let bindings = arriving_bindings.iter().fold(bindings, |bindings, more| bindings.with(more));
        let runs: Vec<&[&Draw]> =
            draws.transparent.chunk_by(|a, b| !a.behind.is_seen_through() && !b.behind.is_seen_through()).collect();
        let mut image = None;
        for (needs_image, runs) in split_for_images(&runs) {
            if needs_image {
                image = Some(self.refraction.image(frame, view.view.size, radiance)?);
            }
            let color = radiance.color(wgpu::LoadOp::Load);
            frame.render("shading/transparent", &[Some(color)], Some(surface.read_depth()), |groups, pass| {
                for run in runs {
                    match (run[0].behind, &seen, &image) {
                        (ImageBehind::Tints, ..) => self.dim.draw(groups, pass, scene, &bindings, run),
                        (ImageBehind::Refracts, Some(seen), Some(image)) => {
                            self.refraction.draw(groups, pass, view, (seen, image), run);
                        }
                        _ => {}
                    }
                    self.transparent.draw(groups, pass, scene, &bindings, run);
                }
            });
        }
        Ok(())
    }
}

/// Features of the shaders of the opaque and the transparent pass, without those of individual draws. `is_sampled`: a
/// technique samples direct light; else it comes from the listed lights.
pub(crate) fn features(settings: &Settings, tracer: Option<Tracer>, is_sampled: bool) -> [Vec<Feature>; 2] {
    let samples = settings.image.samples.count();
    let (mut opaque, mut transparent) = (Vec::new(), vec![TRANSPARENT]);
    // Rays of indirect light may reach the environment themselves.
    let ambient_visibility = occlusion::feature(&settings.occlusion).filter(|_| !settings.indirect.sees_environment());
    let indirect = settings.finds_indirect().then_some(INDIRECT);
    opaque.extend(settings.image.background.hides_environment().then_some(UNCOVERED));
    for features in [&mut opaque, &mut transparent] {
        features.extend(indirect.into_iter().chain(ambient_visibility));
        features.extend((samples > 1).then_some(MULTISAMPLED));
    }
    if is_sampled {
        opaque.push(SAMPLED_LIGHTS);
        transparent.push(SAMPLED_LIGHTS);
        return [opaque, transparent];
    }
    let culling = LightCulling::feature(&settings.culling);
    opaque.push(culling);
    transparent.push(culling);
    if let Some(tracer) = tracer {
        opaque.push(SHADOW_BITS);
        transparent.push(SHADOW_RAYS);
        transparent.extend(tracer.exact().features(&settings.structure, true));
        opaque.extend((settings.history == History::On).then_some(SHADOW_HISTORY));
        if settings.casts_soft_shadows() {
            opaque.push(SOFT);
            transparent.push(SOFT);
        }
    }
    [opaque, transparent]
}

/// Clear colour of the sky. It is clamped to the largest finite value of the target, like every drawn value, so that a
/// mean of frames stays finite.
fn sky(radiance: Vec3) -> wgpu::Color {
    let [r, g, b] = radiance.min(Vec3::splat(half::f16::MAX.to_f32())).to_array().map(f64::from);
    wgpu::Color { r, g, b, a: 0.0 }
}
