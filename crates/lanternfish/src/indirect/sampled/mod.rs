//! Indirect light by rays from every pixel [Niessner2010, §4, §5].
//!
//! 1. For each sample index, one ray per pixel is traced (`trace.wesl`, many sample indices at once), its hit is shaded (`shade.wesl`), and a shadow
//!    ray to the chosen light is traced (`shadow.wesl`). Three passes, since their bindings exceed the limits of one. With emissive triangles,
//!    one more ray per pixel goes to one of them (`emitters.wesl`).
//! 2. The irradiance is upsampled, clamped, accumulated and filtered (`smoothing/`).

mod entries;
pub(super) mod sample_order;
mod settings;
mod targets;

use glam::{UVec2, Vec3};
use lanternfish_gpu::{ComputeKernel, Feature, Frame, SharedStruct, faulty_software, gpu_struct, uniform_buffer_of};

pub use self::settings::{HitLight, Sampled};
#[cfg(any(test, feature = "testing"))]
pub(crate) use self::targets::MOST_SAMPLES_IN_TESTS;
use self::{
    entries::{Entries, FrameEntries},
    settings::{LEAST_ENTRIES, MOST_ENTRIES, MOST_FIRST_RAYS, MOST_SAMPLES},
    targets::Targets,
};
use super::{
    DemodulatedIrradiance, IndirectPasses,
    radiance_cache::Bounces,
    smoothing::{MOST_RADIUS, PixelIrradiance, Smoothing},
};
use crate::{
    context::ViewContext,
    environment_light::ENVIRONMENT,
    error::RenderError,
    prepass::Surface,
    rays::Structure,
    rays::{self, TracePass, Tracer},
    settings::Settings,
    shaders::{Root, Shaders},
};

/// Glossy rays are traced beside diffuse ones.
const GLOSSY_RAYS: Feature = Feature::new("glossy_rays");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::computed("indirect/sampled/trace", || rays::every_tracer(true)),
        Root::of("indirect/sampled/shade", &[&[&[], &[ENVIRONMENT]]]),
        Root::computed("indirect/sampled/shadow", rays::exact_tracers),
        Root::computed("indirect/sampled/emitters", rays::exact_tracers),
        Root::of("indirect/sampled/find_entries", &[&[&[], &[GLOSSY_RAYS]]]),
        Root::new("indirect/sampled/insert_entries"),
        Root::new("indirect/sampled/prepare_dispatches"),
        Root::of("indirect/sampled/gather_entries", &[&[&[], &[GLOSSY_RAYS]]]),
    ],
    &[
        SharedStruct::of::<SampledParameters>(),
        SharedStruct::of::<SampleSlots>(),
        SharedStruct::of::<SampledHit>(),
        SharedStruct::of::<LightRay>(),
    ],
);

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
        /// Rays per pixel to emissive triangles; 0 if nothing is emissive.
        emitter_rays: u32,
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
        /// Unused.
        _pad: u32,
    }
}

gpu_struct! {
    /// Parameters of the passes of one sample index: one ray from each pixel.
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
    }
}

gpu_struct! {
    /// A ray hit.
    pub struct SampledHit {
        /// Index of the triangle, in the order of the BVH's leaves; else `NOTHING` of `rays/hit.wesl`, or `NO_RAY` of `hit.wesl`. `NO_CAPACITY` of
        /// `hit.wesl` is added if the hit is shaded because the cache is full.
        triangle: u32,
        /// Distance from the ray's start, m.
        distance: f32,
        /// Unit direction along which the distance is measured, octahedral: two snorms of 16 bits. For rays through deep images: the axis of
        /// the deep image.
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
        /// Sum of the four weights of the pixel's ray (`ray.wesl`), by which `roulette.wesl` ranks it. Both lobes count alike, since metals
        /// have only the glossy one. `shadow.wesl` recomputes the four weights.
        weight: f32,
        /// Radiance reflected back along the pixel's ray if the light is visible, nits.
        radiance: Vec3,
        /// Unused.
        _pad: u32,
    }
}

/// The passes of indirect light by rays from every pixel.
#[derive(Debug)]
pub struct SampledLight {
    settings: Sampled,
    /// Least number of frames over which an image is averaged.
    frames: u32,
    trace: TracePass,
    sample_order: wgpu::Buffer,
    shade: ComputeKernel,
    shade_environment: ComputeKernel,
    shadow: ComputeKernel,
    emitters: ComputeKernel,
    entries: Option<Entries>,
    smoothing: Smoothing,
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
        let traced = sampled.tracer.fixed().check(device, "`indirect-tracer ray-query`", "`indirect-tracer bvh`")?;
        let kernel = |module: &str, features: &[Feature], entry: &str, label: &str| {
            let shader = DECLARED.link(module, features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, label))
        };
        let trace = kernel("indirect/sampled/trace", &traced.features(structure, true), "trace", "indirect/trace")?;
        let exact_tracer = tracer.unwrap_or(Tracer::BVH).exact();
        let exact = exact_tracer.features(structure, true);
        Ok(Self {
            settings: sampled,
            frames: settings.accumulate,
            trace: TracePass::new(traced, trace),
            sample_order: uniform_buffer_of(device, "sample_order", &sample_order::words()),
            shade: kernel("indirect/sampled/shade", &[], "shade", "indirect/shade")?,
            shade_environment: kernel("indirect/sampled/shade", &[ENVIRONMENT], "shade", "indirect/shade")?,
            shadow: kernel("indirect/sampled/shadow", &exact, "shadow", "indirect/shadow")?,
            emitters: kernel("indirect/sampled/emitters", &exact, "emitters", "indirect/emitters")?,
            entries: match sampled.hit_light {
                HitLight::Shaded => None,
                HitLight::Cached => Some(Entries::new(device, &sampled, exact_tracer, structure)?),
            },
            smoothing: Smoothing::new(device, settings.history)?,
        })
    }
}

impl IndirectPasses for SampledLight {
    fn forget(&mut self) {
        self.entries.iter_mut().for_each(Entries::forget);
        self.smoothing.forget();
    }

    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view_context: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<DemodulatedIrradiance, RenderError> {
        let ViewContext { scene, view, buffer, .. } = view_context;
        let settings = &self.settings;
        let frames = self.frames.max(view.frame_index.saturating_add(1));
        let (resolution, radius) = (settings.resolution, settings.filter_radius);
        let irradiance = PixelIrradiance::new(frame, surface.size, resolution, radius, settings.clamp, frames)?;
        let first_diffuse_rays = settings.first_rays * settings.diffuse_rays;
        let [sample_count, first_samples] =
            [settings.diffuse_rays, first_diffuse_rays].map(|rays| rays + settings.glossy_rays);
        let mut entries = match &mut self.entries {
            Some(entries) => Some(entries.begin(frame, view_context, irradiance.size, sample_count, first_samples)?),
            None => None,
        };
        let is_first = entries.as_ref().is_some_and(FrameEntries::is_first);
        let (diffuse_rays, sample_count) =
            if is_first { (first_diffuse_rays, first_samples) } else { (settings.diffuse_rays, sample_count) };
        let targets = Targets::new(frame, irradiance.size, sample_count)?;
        let [width, height, _] = self.shade.workgroup_size();
        let workgroups = [irradiance.size.x.div_ceil(width), irradiance.size.y.div_ceil(height), 1];
        // One emitter sample per two diffuse rays; BSDF samples that hit emitters are combined by MIS and cost nothing more.
        let emitter_rays = if scene.has_emissive_triangles() { diffuse_rays.div_ceil(2) } else { 0 };
        let earlier_frames =
            frames_before(view.random_index, is_first, if entries.is_some() { settings.first_rays } else { 1 });
        let usual = UVec2::new(settings.diffuse_rays, settings.diffuse_rays.div_ceil(2));
        let parameters = SampledParameters {
            emitter_rays,
            first_points: UVec2::splat(earlier_frames).wrapping_mul(usual),
            first_end: earlier_frames.wrapping_mul(settings.diffuse_rays + settings.glossy_rays),
            diffuse_rays,
            glossy_rays: settings.glossy_rays,
            diffuse_blur: diffuse_blur(diffuse_rays, frames),
            glossy_blur: glossy_blur(settings.glossy_rays, frames),
            ..Default::default()
        };
        let surfaces = buffer.bindings().with(&surface.bindings()).buffer("sample_order", &self.sample_order);
        let parameters = entries.as_ref().map_or(parameters, |entries| entries.parameters(parameters));
        let of_frame = frame.uniform(&parameters);
        let frame_bindings = scene.bindings().with(&surfaces).with(&irradiance.bindings()).part("sampled", &of_frame);
        if scene.environment.is_some() {
            check_driver(&frame.device.adapter_info())?;
        }
        let environment = scene.environment.as_ref().map(|_| scene.environment_light().bindings());
        let shade = if environment.is_some() { &self.shade_environment } else { &self.shade };

        // First of the sample indices whose hits are in the buffer.
        let mut traced_first = None;
        let mut sample_index = 0;
        while sample_index < sample_count {
            // Also if the frame starts over.
            if sample_index == 0 {
                frame.encoder().clear_buffer(&irradiance.irradiance, 0, None);
            }
            let of_entries = entries.as_ref().map_or(0..sample_count, |entries| entries.gathered_with(sample_index));
            let traced = targets.traced_with(sample_index, of_entries.clone());
            let mut of_sample = SampleSlots {
                round: sample_index,
                found_end: 0,
                traced_first: traced.start,
                traced_end: traced.end,
                first_sample: of_entries.start,
                sample_of_hit: of_entries.end,
            };
            of_sample.found_end = entries.as_ref().map_or(0, |entries| entries.found_end(&of_sample));
            let uniform = frame.uniform(&of_sample);
            let sample_bindings = frame_bindings.clone().part("sample_slots", &uniform);
            let tracing = sample_bindings.clone().buffer("sampled_hits", &targets.hits);
            if traced_first.replace(traced.start) != Some(traced.start) {
                self.trace.dispatch(frame, view_context, &tracing, sample_order::workgroups(irradiance.size));
            }
            let summing = sample_bindings
                .buffer("ray_irradiance", &irradiance.irradiance)
                .buffer("ray_counters", targets.counters.buffer());
            let mut shading =
                summing.clone().buffer("hits_to_shade", &targets.hits).buffer("chosen_lights", &targets.light_rays);
            if let Some(environment) = &environment {
                shading = shading.with(environment);
            }
            let light_bindings = summing.clone().buffer("light_rays", &targets.light_rays);
            match &mut entries {
                None => {
                    frame.dispatch(shade, &shading, workgroups);
                    frame.dispatch(&self.shadow, &light_bindings, workgroups);
                }
                Some(entries) => {
                    if entries.looks_up(&of_sample) {
                        entries.find(frame, &summing.clone().buffer("sampled_hits", &targets.hits));
                    }
                    let [shade_workgroups, shadow_workgroups] = entries.left_over();
                    frame.dispatch_indirect(shade, &shading, shade_workgroups);
                    frame.dispatch_indirect(&self.shadow, &light_bindings, shadow_workgroups);
                    entries.sample(frame, view_context, sample_index);
                }
            }
            if sample_index < emitter_rays {
                frame.dispatch(&self.emitters, &light_bindings, workgroups);
            }
            if let Some(entries) = &mut entries
                && sample_index + 1 == of_entries.end
            {
                entries.gather(frame, view_context, &summing);
            }
            sample_index += 1;
            if let Some(entries) = &mut entries
                && entries.starts_over(frame, view_context, sample_index - 1)?
            {
                frame.encoder().clear_buffer(targets.counters.buffer(), 0, None);
                sample_index = 0;
            }
        }

        let layers = self.smoothing.record(frame, view_context, surface, &irradiance)?;
        Ok(DemodulatedIrradiance {
            layers,
            counters: [targets.counters].into_iter().chain(entries.map(|entries| entries.counters())).collect(),
        })
    }
}

/// Number of usual frames whose diffuse rays precede this frame's in a pixel's sequence: a first frame counts as `first_rays` of them. (If the number of
/// diffuse rays is odd, rays to emissive triangles skip points: there are half as many per frame, rounded up.)
fn frames_before(random_index: u32, is_first: bool, first_rays: u32) -> u32 {
    random_index.wrapping_add(if is_first { 0 } else { first_rays - 1 })
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

/// Roughness whose lobe about the mirror direction is as wide as the solid angle of the hemisphere that one of `rays` × `frames` rays represents: 2π
/// over their number, as a cone. Half of the lobe's directions are within tan α of the half vector.
fn diffuse_blur(rays: u32, frames: u32) -> f32 {
    let cosine = 1.0 - 1.0 / (rays as f32 * frames as f32).max(1.0);
    let alpha = (cosine.acos() / (2.0 * std::f32::consts::SQRT_2)).tan();
    alpha.sqrt()
}

/// Number of glossy rays in an image up to which each reads the environment prefiltered by the complete lobe: so few rays would hit a lamp of a dark
/// studio in one pixel and miss it in the next.
const RAYS_OF_A_WHOLE_LOBE: f32 = 4.0;

/// Roughness of the lobe that prefilters the environment for a glossy ray, over its surface's own: the squared alpha is divided by the number of rays.
fn glossy_blur(rays: u32, frames: u32) -> f32 {
    (RAYS_OF_A_WHOLE_LOBE / (rays as f32 * frames as f32)).min(1.0).powf(0.25)
}

/// Returns an error if the number of rays or the filter's radius is out of range, or if deep images lack the triangles that are needed.
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

/// Returns an error for drivers that crash on rays into an environment image: Mesa 22.3.6, while it compiles `shade`.
fn check_driver(adapter: &wgpu::AdapterInfo) -> Result<(), RenderError> {
    if !faulty_software(adapter) {
        return Ok(());
    }
    let (driver, fault) = (adapter.driver_info.clone(), "crashes on it");
    let setting = "`indirect sampled` in an environment image";
    Err(RenderError::Driver { setting, driver, fault, instead: "`indirect none`" })
}
