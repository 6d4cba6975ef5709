//! Indirect light by rays from every pixel [Niessner2010, §4, §5].
//!
//! 1. For each sample index, one ray per pixel is traced (`trace.wesl`, many sample indices at once), its hit is shaded
//!    (`shade.wesl`), and a shadow ray to the chosen light is traced (`shadow.wesl`). Three passes, since their
//!    bindings exceed the limits of one. With emissive triangles, one more ray per pixel goes to one of them
//!    (`emitters.wesl`).
//! 2. The irradiance is upsampled, clamped, accumulated and filtered (`denoise/`).

mod entries;
mod passes;
pub mod probes;
pub(super) mod sample_order;
pub(super) mod settings;
mod targets;

use glam::{UVec2, Vec3};
use lanternfish_gpu::{Feature, Frame, SharedStruct, gpu_struct};

pub use self::settings::{HitLight, Sampled};
use self::settings::{LEAST_ENTRIES, MOST_ENTRIES, MOST_FIRST_RAYS, MOST_SAMPLES};
#[cfg(any(test, feature = "testing"))]
pub(crate) use self::targets::MOST_SAMPLES_IN_TESTS;
use self::{
    entries::CachedFrame,
    passes::{RayGrid, RayPasses},
};
use super::{
    DemodulatedIrradiance, IndirectPasses, layers_target,
    radiance_cache::{Bounces, CacheSettings, RadianceCache},
};
use crate::{
    context::ViewContext,
    denoise::{
        IndirectClamp,
        smoothing::{MOST_RADIUS, PixelIrradiance, Smoothed, Smoothing},
    },
    environment_light::ENVIRONMENT,
    error::RenderError,
    gpu_scene::GpuScene,
    prepass::Surface,
    rays::{IN_LEVELS, Structure, Tracer, every_tracer, exact_in_scenes},
    settings::Settings,
    shaders::{Root, Shaders},
};

/// Glossy rays are traced beside diffuse ones.
const GLOSSY_RAYS: Feature = Feature::new("glossy_rays");

/// Rays start from screen probes (`probes/`) instead of pixels.
pub(super) const PROBES: Feature = Feature::new("probes");

/// Rays start from pixels or from screen probes, as the parameters say.
const ANY_SOURCE: Feature = Feature::new("any_source");

/// Number of lights up to which a shaded hit weighs all of them, so that its choice adds little noise: `MOST_WEIGHED`
/// of `hit_radiance.wesl`.
const MOST_WEIGHED: u32 = 16;

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::computed("indirect/sampled/trace", || of_each_source(every_tracer(true))),
        Root::of("indirect/sampled/shade", &[&[&[ANY_SOURCE]], &[&[], &[ENVIRONMENT]], &[&[], &[IN_LEVELS]]]),
        Root::computed("indirect/sampled/shadow", || with_feature(ANY_SOURCE, exact_in_scenes())),
        Root::computed("indirect/sampled/emitters", exact_in_scenes),
        Root::of("indirect/sampled/find_entries", &[&[&[], &[GLOSSY_RAYS], &[PROBES]], &[&[], &[IN_LEVELS]]]),
        Root::of("indirect/sampled/insert_entries", &[&[&[], &[PROBES]], &[&[], &[IN_LEVELS]]]),
        Root::of("indirect/sampled/gather_entries", &[&[&[], &[GLOSSY_RAYS], &[PROBES]]]),
    ],
    &[
        SharedStruct::of::<SampledParameters>(),
        SharedStruct::of::<SampleSlots>(),
        SharedStruct::of::<SampledHit>(),
        SharedStruct::of::<LightRay>(),
    ],
);

/// Each set of features, for pixels and for probes.
fn of_each_source(variants: Vec<Vec<Feature>>) -> Vec<Vec<Feature>> {
    [variants.clone(), with_feature(PROBES, variants)].concat()
}

fn with_feature(feature: Feature, variants: Vec<Vec<Feature>>) -> Vec<Vec<Feature>> {
    variants.into_iter().map(|variant| [&[feature], variant.as_slice()].concat()).collect()
}

gpu_struct! {
    /// Parameters of the passes of a frame.
    pub struct SampledParameters {
        /// Diffuse rays per pixel.
        diffuse_rays: u32,
        /// Glossy rays per pixel.
        glossy_rays: u32,
        /// Roughness whose lobe covers the solid angle that a diffuse ray represents; it prefilters the environment.
        diffuse_blur: f32,
        /// The same for a glossy ray, over its surface's roughness.
        glossy_blur: f32,
        /// Index in the pixel's sequence of its first diffuse ray (x), and of its first ray to emissive triangles (y).
        first_points: UVec2,
        /// Index in the pixel's other sequence, which jitters hit points, of its first ray.
        first_end: u32,
        /// Rays per pixel to emissive triangles; 0 if nothing is emissive, or if direct light samples them.
        emitter_rays: u32,
        /// 1: the sources are screen probes; read by passes with `ANY_SOURCE`.
        of_probes: u32,
        /// 1: the radiance cache lights hits.
        has_entries: u32,
        /// Rays vote for one of so many existing entries, less 1; a power of two less 1: `is_voted_for` of the cache.
        voting_mask: u32,
        /// 1: each sample index votes for a different subset of entries.
        voting_step: u32,
        /// 1: the environment is black.
        sky_is_dark: u32,
        /// 1: the radiance of entries with samples is added at lookup.
        adds_found: u32,
        /// Diffuse rays, of whatever grid, with which rays to emissive triangles are combined.
        diffuse_density: f32,
        /// Glossy rays start from surfaces of less roughness.
        most_roughness: f32,
        /// 1: diffuse rays, which are another grid's, do not count for the glossy lobe of these surfaces.
        lobes_apart: u32,
        /// 1: hits of glossy rays are shaded. The radiance cache adds the light that they reflect from other surfaces.
        shades_mirrored: u32,
        /// Roughness below which surfaces have glossy rays, in the division of emission between direct light, which
        /// samples it, and rays of indirect light; below 0: it is not divided.
        emission_roughness: f32,
        /// Unused.
        _pad: u32,
    }
}

gpu_struct! {
    /// Parameters of the passes of one sample index, or of some from it on: one ray from each pixel.
    pub struct SampleSlots {
        /// Sample index of the ray among those of a pixel: diffuse ones first, then glossy ones.
        round: u32,
        /// End (exclusive) of the sample indices whose hits are looked up together, from `round` on.
        found_end: u32,
        /// First of the sample indices that are traced together.
        traced_first: u32,
        /// End (exclusive) of these.
        traced_end: u32,
        /// First of the sample indices whose hits are gathered from the cache together.
        first_sample: u32,
        /// End (exclusive) of these.
        sample_of_hit: u32,
        /// End (exclusive) of the sample indices whose hits are shaded together, from `round` on.
        shaded_end: u32,
    }
}

gpu_struct! {
    /// A ray hit.
    pub struct SampledHit {
        /// Index of the triangle, in the order of the BVH's leaves; else `NOTHING` of `rays/hit.wesl`, or `NO_RAY` of
        /// `hit.wesl`. `NO_CAPACITY` of `hit.wesl` is added if the hit is shaded because the cache is full.
        triangle: u32,
        /// Distance from the ray's start, m.
        distance: f32,
        /// Unit direction along which the distance is measured, octahedral: two snorms of 16 bits. For rays through
        /// deep images: the axis of the deep image.
        direction: u32,
    }
}

gpu_struct! {
    /// A shadow ray from a hit to the light that was chosen for it; world space, m.
    pub struct LightRay {
        /// Start, offset from the hit surface; world space, m.
        start: Vec3,
        /// Outcome of the pixel's ray: a constant of `light_ray.wesl`.
        met: u32,
        /// End, at the light; world space, m.
        end: Vec3,
        /// Sum of the four weights of the pixel's ray (`ray.wesl`), by which `roulette.wesl` ranks it. Both lobes count
        /// alike, since metals have only the glossy one. `shadow.wesl` recomputes the four weights.
        weight: f32,
        /// Radiance reflected back along the pixel's ray if the light is visible, nits.
        radiance: Vec3,
        /// Unused.
        _pad: u32,
    }
}

/// The passes of indirect light by rays from every pixel.
#[derive(Debug)]
pub(super) struct SampledLight {
    pub settings: Sampled,
    /// [`Settings::shares_emission`].
    pub shares_emission: Option<f32>,
    /// Least number of frames over which an image is averaged.
    pub frames: u32,
    pub rays: RayPasses,
    pub cache: Option<RadianceCache>,
    pub smoothing: Smoothing,
}

impl SampledLight {
    /// Compiles the passes.
    pub fn new(
        device: &wgpu::Device,
        sampled: Sampled,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Self, RenderError> {
        let structure = &settings.structure;
        check(&sampled, structure)?;
        let of_cache = CacheSettings {
            bounces: sampled.bounces,
            most_entries: sampled.cache_entries,
            first_samples: sampled.cache_samples,
            tracer: sampled.tracer.fixed(),
            blur: diffuse_blur(1, RadianceCache::MOST_SAMPLES),
        };
        let exact = tracer.unwrap_or(Tracer::BVH).exact();
        Ok(Self {
            settings: sampled,
            shares_emission: settings.shares_emission(),
            frames: settings.image.accumulate,
            rays: RayPasses::new(device, &sampled, settings, exact, &[])?,
            cache: match sampled.hit_light {
                HitLight::Shaded => None,
                HitLight::Cached => Some(RadianceCache::new(device, of_cache, exact, structure)?),
            },
            smoothing: Smoothing::new(device, settings.history)?,
        })
    }

    /// 1 if pixels sample emissive triangles of a scene, and [`SampledParameters::emission_roughness`].
    pub fn emission(&self, scene: &GpuScene) -> (u32, f32) {
        match self.shares_emission.filter(|_| scene.has_emissive_triangles()) {
            Some(emission_roughness) => (0, emission_roughness),
            None => (scene.has_emissive_triangles().into(), -1.0),
        }
    }

    /// True if hits of glossy rays are shaded, and the cache adds further bounces, if there are any. With many lights,
    /// their choice would be noise.
    fn shades_mirrored(&self, scene: &GpuScene) -> bool {
        scene.lights().capacity() <= MOST_WEIGHED && self.settings.bounces != Bounces::ONE
    }
}

impl IndirectPasses for SampledLight {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view_context: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<DemodulatedIrradiance, RenderError> {
        let ViewContext { scene, view, .. } = view_context;
        let settings = &self.settings;
        let frames = self.frames.max(view.frame_index.saturating_add(1));
        let (resolution, radius) = (settings.resolution, settings.filter_radius);
        let smoothed = Smoothed::new(radius, settings.clamp == IndirectClamp::On, frames);
        let mut of_frame = match &mut self.cache {
            Some(cache) => Some(cache.begin(frame, view_context)?),
            None => None,
        };
        let is_first = of_frame.as_ref().is_some_and(|of_frame| of_frame.first_samples().is_some());
        let diffuse_rays = if is_first { settings.first_rays * settings.diffuse_rays } else { settings.diffuse_rays };
        // One emitter sample per two diffuse rays; BSDF samples that hit emitters are combined by MIS and cost nothing
        // more.
        let (samples, emission_roughness) = self.emission(scene);
        let emitter_rays = samples * diffuse_rays.div_ceil(2);
        let earlier_frames =
            frames_before(view.random_index, is_first, if of_frame.is_some() { settings.first_rays } else { 1 });
        let usual = UVec2::new(settings.diffuse_rays, settings.diffuse_rays.div_ceil(2));
        let parameters = SampledParameters {
            emitter_rays,
            first_points: UVec2::splat(earlier_frames).wrapping_mul(usual),
            first_end: earlier_frames.wrapping_mul(settings.diffuse_rays + settings.glossy_rays),
            diffuse_rays,
            glossy_rays: settings.glossy_rays,
            diffuse_blur: diffuse_blur(diffuse_rays, frames),
            glossy_blur: glossy_blur(settings.glossy_rays, frames),
            diffuse_density: diffuse_rays as f32,
            most_roughness: f32::MAX,
            shades_mirrored: self.shades_mirrored(scene).into(),
            emission_roughness,
            ..Default::default()
        };
        let layers = layers_target(frame, surface.size);
        let mut counters = Vec::new();
        for rows in PixelIrradiance::bands(surface.size, resolution) {
            let irradiance = PixelIrradiance::of_rows(frame, surface.size, resolution, smoothed, rows)?;
            let grid = RayGrid {
                size: irradiance.size,
                parameters,
                sample_count: diffuse_rays + settings.glossy_rays,
                emitter_rays,
                explores: 0,
                sums: &irradiance.irradiance,
                bindings: irradiance.bindings(),
            };
            let cached = self.cache.as_mut().zip(of_frame.as_mut()).map(|(cache, of_frame)| CachedFrame {
                cache,
                of_frame,
                may_start_over: true,
            });
            counters.push(self.rays.record(frame, view_context, surface, &grid, cached)?);
            self.smoothing.resolve(frame, view_context, surface, &irradiance, &layers);
        }
        let layers = self.smoothing.record_layers(frame, view_context, surface, &smoothed, layers)?;
        counters.extend(of_frame.map(|of_frame| of_frame.counters));
        Ok(DemodulatedIrradiance { layers, counters })
    }
}

/// Number of usual frames whose diffuse rays precede this frame's in a pixel's sequence: a first frame counts as
/// `first_rays` of them. (If the number of diffuse rays is odd, rays to emissive triangles skip points: there are half
/// as many per frame, rounded up.)
fn frames_before(random_index: u32, is_first: bool, first_rays: u32) -> u32 {
    random_index.wrapping_add(if is_first { 0 } else { first_rays - 1 })
}

#[cfg(test)]
#[test]
fn few_lights_are_those_of_the_shader() {
    assert_eq!(crate::shaders::constant("indirect/hit_radiance", "MOST_WEIGHED") as u32, MOST_WEIGHED);
}

#[cfg(test)]
#[test]
fn frames_continue_the_sequence_of_the_first_one() {
    for first_rays in [1, 2, 8] {
        let mut next = 0;
        for frame in 0..5 {
            let is_first = frame == 0;
            assert_eq!(frames_before(frame, is_first, first_rays), next, "{first_rays}, frame {frame}");
            next += if is_first { first_rays } else { 1 };
        }
    }
}

/// Part of a ray's solid angle for which the environment is prefiltered. The tails of the lobe reach far beyond it:
/// with the whole angle a surface under soft boxes lost 8 % of their light (16 rays), with a quarter 4 %, and no image
/// was noisier.
const PREFILTERED: f32 = 0.25;

/// Roughness whose lobe about the mirror direction is as wide as a part of the solid angle of the hemisphere that one
/// of `rays` × `frames` rays represents: 2π over their number, as a cone. Half of the lobe's directions are within tan
/// α of the half vector.
pub(super) fn diffuse_blur(rays: u32, frames: u32) -> f32 {
    let cosine = 1.0 - PREFILTERED / (rays as f32 * frames as f32).max(1.0);
    let alpha = (cosine.acos() / (2.0 * std::f32::consts::SQRT_2)).tan();
    alpha.sqrt()
}

/// Number of glossy rays in an image up to which each reads the environment prefiltered by the complete lobe: so few
/// rays would hit a lamp of a dark studio in one pixel and miss it in the next.
const RAYS_OF_A_WHOLE_LOBE: f32 = 4.0;

/// Roughness of the lobe that prefilters the environment for a glossy ray, over its surface's own: the squared alpha is
/// divided by the number of rays.
pub(super) fn glossy_blur(rays: u32, frames: u32) -> f32 {
    (RAYS_OF_A_WHOLE_LOBE / (rays as f32 * frames as f32)).min(1.0).powf(0.25)
}

/// Returns an error if the number of rays or the filter's radius is out of range, or if deep images lack the triangles
/// that are needed.
fn check(settings: &Sampled, structure: &Structure) -> Result<(), RenderError> {
    if settings.diffuse_rays == 0 || settings.diffuse_rays > 4096 || settings.glossy_rays > 4096 {
        return Err(RenderError::Together { setting: "`indirect sampled`", needed: "1 to 4096 rays per pixel" });
    }
    if settings.filter_radius > MOST_RADIUS {
        return Err(RenderError::Together { setting: "`indirect sampled`", needed: "a filter of at most 64 pixels" });
    }
    if !(LEAST_ENTRIES..=MOST_ENTRIES).contains(&settings.cache_entries)
        || !(1..=MOST_SAMPLES).contains(&settings.cache_samples)
        || !(1..=MOST_FIRST_RAYS).contains(&settings.first_rays)
    {
        let needed = "`cache-entries` from 64 to 524,288, `cache-samples` from 1 to 128, and `first-rays` from 1 to 8";
        return Err(RenderError::Together { setting: "`hit-light cached`", needed });
    }
    if matches!(settings.bounces, Bounces::UpTo(bounces) if !(1..=Bounces::MOST).contains(&bounces)) {
        return Err(RenderError::Together { setting: "`bounces`", needed: "1 to 8, or all" });
    }
    if matches!(settings.bounces, Bounces::UpTo(2..)) && settings.hit_light != HitLight::Cached {
        return Err(RenderError::Together { setting: "`bounces` of 2 to 8", needed: "`hit-light cached`" });
    }
    if !settings.tracer.fixed().finds_triangles(structure) {
        return Err(RenderError::Together { setting: "`indirect sampled`", needed: "deep images with triangles" });
    }
    Ok(())
}
