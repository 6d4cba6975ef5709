//! Indirect light by rays from every pixel [Niessner2010, §4, §5].
//!
//! 1. Rounds: one ray a pixel each, traced (`trace.wesl`); its end shaded (`shade.wesl`); and the light that was chosen for it looked
//!    for (`shadow.wesl`). Three passes, since what they read together is more than one may bind. Where triangles shine, a ray
//!    from the pixel to one of them (`emitters.wesl`).
//! 2. Resolve: sums of the pixels that rays started from become the picture's.
//! 3. What a pixel has beyond those around it is cut off, and how noisy it is found (`bound.wesl`).
//! 4. Filter, along x and along y.

mod settings;
mod targets;

use glam::{UVec2, Vec3};
use lanternfish_gpu::{ComputeKernel, Feature, Frame, SharedStruct, gpu_struct};

use self::targets::Targets;
pub use self::{
    settings::{IndirectClamp, IndirectResolution, Sampled},
    targets::RayCounters,
};
use super::{IndirectPasses, IndirectSums};
use crate::{
    context::ViewContext,
    deep_images::DeepImages,
    environment_light::ENVIRONMENT,
    error::RenderError,
    prepass::Surface,
    rays::{self, Tracer},
    settings::DeepImageSettings,
    shaders::{Root, SHADERS, Shaders},
};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders {
    roots: &[
        Root::computed("indirect/sampled/trace", || rays::every_tracer(true)),
        Root::of("indirect/sampled/shade", &[&[&[], &[ENVIRONMENT]]]),
        Root::computed("indirect/sampled/shadow", rays::exact_tracers),
        Root::computed("indirect/sampled/emitters", rays::exact_tracers),
        Root::new("indirect/sampled/bound"),
        Root::new("indirect/sampled/filter"),
    ],
    structs: &[
        SharedStruct::of::<SampledParameters>(),
        SharedStruct::of::<SampledHit>(),
        SharedStruct::of::<LightRay>(),
    ],
};

gpu_struct! {
    /// Parameters that the passes share.
    pub struct SampledParameters {
        /// Pixels of the picture over samples' own, along an edge: 1 or 2.
        scale: u32,
        /// Number of the round's ray among those of a pixel: diffuse ones first, then glossy ones.
        round: u32,
        /// How many diffuse rays a pixel has.
        diffuse_rays: u32,
        /// How many glossy rays a pixel has.
        glossy_rays: u32,
        /// Radius of the filter: pixels to each side.
        radius: u32,
        /// Axis of the filter: 0 is x, 1 is y.
        axis: u32,
        /// Roughness of the surface that would see as much of the surroundings at once as a diffuse ray stands for.
        diffuse_blur: f32,
        /// The same of a glossy ray, over its surface's roughness.
        glossy_blur: f32,
        /// Rays from a pixel to emissive triangles; 0 where nothing shines.
        emitter_rays: u32,
        /// Frames whose mean the picture is, where a pixel's sums are bounded by those around it; 0: they are not.
        clamp_frames: f32,
        /// Unused.
        _pad_a: u32,
        /// Unused.
        _pad_b: u32,
    }
}

gpu_struct! {
    /// What a ray met.
    pub struct SampledHit {
        /// Index of the triangle, in the order of the BVH's leaves; else `NOTHING` of `rays/hit.wesl`, or `NO_RAY` of `hit.wesl`.
        triangle: u32,
        /// Distance from the ray's start, m.
        distance: f32,
        /// Unit direction along which the distance is, octahedral: two snorms of 16 bits.
        direction: u32,
    }
}

gpu_struct! {
    /// A ray from what a ray met to the light that was chosen for it; world space, m.
    pub struct LightRay {
        /// Start, off the surface that the ray met.
        start: Vec3,
        /// What became of the round's ray: a constant of `light_ray.wesl`.
        met: u32,
        /// End, at the light.
        end: Vec3,
        /// Weight of the radiance in the pixel's sums, at normal incidence.
        weight: f32,
        /// Radiance sent back along the round's ray, if the light is seen; nits.
        radiance: Vec3,
        /// Weight of the radiance in the pixel's sums, at grazing incidence.
        grazing_weight: f32,
    }
}

/// Largest reach of the filter, pixels.
const MOST_RADIUS: u32 = 64;

/// The passes of indirect light by rays from every pixel.
#[derive(Debug)]
pub struct SampledLight {
    settings: Sampled,
    /// Frames that a picture is the mean of, at least.
    frames: u32,
    trace: ComputeKernel,
    shade: ComputeKernel,
    shade_environment: ComputeKernel,
    shadow: ComputeKernel,
    emitters: ComputeKernel,
    bound: ComputeKernel,
    resolve: ComputeKernel,
    filter: ComputeKernel,
}

impl SampledLight {
    /// Compiles the passes.
    pub fn new(
        device: &wgpu::Device,
        settings: Sampled,
        deep_images: DeepImageSettings,
        frames: u32,
        tracer: Option<Tracer>,
    ) -> Result<Self, RenderError> {
        check(&settings, &deep_images)?;
        settings.tracer.check(device, "`indirect-tracer ray-query`", "`indirect-tracer bvh`")?;
        let kernel = |module: &str, features: &[Feature], entry: &str, label: &str| {
            let shader = SHADERS.link(module, features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, label))
        };
        let tracing = settings.tracer.features(&deep_images);
        let exact = tracer.unwrap_or(Tracer::Bvh).exact().features(&deep_images);
        Ok(Self {
            settings,
            frames,
            trace: kernel("indirect/sampled/trace", &tracing, "trace", "indirect/trace")?,
            shade: kernel("indirect/sampled/shade", &[], "shade", "indirect/shade")?,
            shade_environment: kernel("indirect/sampled/shade", &[ENVIRONMENT], "shade", "indirect/shade")?,
            shadow: kernel("indirect/sampled/shadow", &exact, "shadow", "indirect/shadow")?,
            emitters: kernel("indirect/sampled/emitters", &exact, "emitters", "indirect/emitters")?,
            bound: kernel("indirect/sampled/bound", &[], "bound", "indirect/bound")?,
            resolve: kernel("indirect/sampled/filter", &[], "resolve", "indirect/resolve")?,
            filter: kernel("indirect/sampled/filter", &[], "filter_axis", "indirect/filter")?,
        })
    }
}

impl IndirectPasses for SampledLight {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, view, buffer, .. }: &ViewContext<'_>,
        surface: &Surface,
        images: Option<&DeepImages>,
    ) -> Result<IndirectSums, RenderError> {
        let scale = match self.settings.resolution {
            IndirectResolution::Full => 1,
            IndirectResolution::Half => 2,
        };
        let rounds = self.settings.diffuse_rays + self.settings.glossy_rays;
        let targets = &Targets::new(frame, surface.size, scale)?;
        let counters = RayCounters::new(frame, rounds)?;
        // Noise falls with the number of frames, and as much smaller is the area that light must be averaged over.
        let frames = self.frames.max(view.frame_index.saturating_add(1));
        let radius = (self.settings.filter_radius as f32 / (frames as f32).sqrt()) as u32;
        let settings = &self.settings;
        let groups = |kernel: &ComputeKernel, size: UVec2| {
            let [width, height, _] = kernel.workgroup_size();
            [size.x.div_ceil(width), size.y.div_ceil(height), 1]
        };
        let sample_size = surface.size.map(|side| side.div_ceil(scale));
        let samples = groups(&self.trace, sample_size);
        let pixels = groups(&self.filter, surface.size);
        // Half as many rays look for emissive triangles as are diffuse: the other way of finding them, rays that run into them, costs
        // nothing more.
        let emitter_rays = if scene.has_emissive_triangles() { settings.diffuse_rays.div_ceil(2) } else { 0 };
        let parameters = SampledParameters {
            emitter_rays,
            clamp_frames: if settings.clamp == IndirectClamp::On { frames as f32 } else { 0.0 },
            scale,
            diffuse_rays: settings.diffuse_rays,
            glossy_rays: settings.glossy_rays,
            radius,
            diffuse_blur: diffuse_blur(settings.diffuse_rays, frames),
            glossy_blur: glossy_blur(settings.glossy_rays, frames),
            ..Default::default()
        };
        let shared = buffer.bindings().with(&surface.bindings());
        let seen = scene.bindings().with(&shared);
        let environment = scene.environment.as_ref().map(|_| scene.environment_light().bindings());
        let shade = if environment.is_some() { &self.shade_environment } else { &self.shade };

        let images = images.filter(|_| settings.tracer.uses_deep_images());
        for round in 0..rounds {
            let uniform = frame.uniform(&SampledParameters { round, ..parameters });
            let tracing = seen.clone().part("sampled", &uniform).buffer("sampled_hits", &targets.hits);
            rays::dispatch(frame, &self.trace, &tracing, samples, images);
            let mut shading = seen
                .clone()
                .part("sampled", &uniform)
                .buffer("hits_to_shade", &targets.hits)
                .buffer("ray_sums", &targets.sums)
                .buffer("chosen_lights", &targets.light_rays);
            if let Some(environment) = &environment {
                shading = shading.with(environment);
            }
            frame.dispatch(shade, &shading, samples);
            let looking = seen
                .clone()
                .part("sampled", &uniform)
                .buffer("light_rays", &targets.light_rays)
                .buffer("ray_sums", &targets.sums)
                .with(&counters.bindings());
            frame.dispatch(&self.shadow, &looking, samples);
            if round < emitter_rays {
                frame.dispatch(&self.emitters, &looking, samples);
            }
        }

        let [mut read, mut written] = [&targets.layers[1], &targets.layers[0]];
        let uniform = frame.uniform(&parameters);
        let resolving = shared.clone().part("sampled", &uniform).buffer("finished_sums", &targets.sums);
        frame.dispatch(&self.resolve, &resolving.texture("filtered", written), pixels);
        let is_filtered = radius > 0;
        let bounding = (is_filtered || parameters.clamp_frames > 0.0).then_some((&self.bound, 0));
        let filtering = [0, 1].into_iter().filter(|_| is_filtered).map(|axis| (&self.filter, axis));
        for (kernel, axis) in bounding.into_iter().chain(filtering) {
            std::mem::swap(&mut read, &mut written);
            let uniform = frame.uniform(&SampledParameters { axis, ..parameters });
            let smoothing = shared.clone().part("sampled", &uniform).texture("filtered_sums", read);
            frame.dispatch(kernel, &smoothing.texture("filtered", written), pixels);
        }
        Ok(IndirectSums { layers: written.clone(), counters: Some(counters) })
    }
}

/// Roughness whose lobe about the mirror direction is as wide as the part of the hemisphere that one of so many rays, in each of so
/// many frames, stands for: 2π over their number, a cone of whose directions half are within tan α of the half vector.
fn diffuse_blur(rays: u32, frames: u32) -> f32 {
    let cosine = 1.0 - 1.0 / (rays as f32 * frames as f32).max(1.0);
    let alpha = (cosine.acos() / (2.0 * std::f32::consts::SQRT_2)).tan();
    alpha.sqrt()
}

/// Glossy rays of a picture up to which each reads the surroundings as blurred as the whole lobe: so few of them would find a lamp of a dark
/// studio here and miss it there.
const RAYS_OF_A_WHOLE_LOBE: f32 = 4.0;

/// Roughness by whose lobe the surroundings that a glossy ray sees are blurred, over its surface's own: squares of alphas are
/// shared out by the number of rays.
fn glossy_blur(rays: u32, frames: u32) -> f32 {
    (RAYS_OF_A_WHOLE_LOBE / (rays as f32 * frames as f32)).min(1.0).powf(0.25)
}

/// An error where the number of rays or the filter's radius is out of range, or deep images lack the triangles that are needed.
fn check(settings: &Sampled, deep_images: &DeepImageSettings) -> Result<(), RenderError> {
    if settings.diffuse_rays == 0 || settings.diffuse_rays > 4096 || settings.glossy_rays > 4096 {
        return Err(RenderError::Together { setting: "`indirect sampled`", needed: "1 to 4096 rays a pixel" });
    }
    if settings.filter_radius > MOST_RADIUS {
        return Err(RenderError::Together { setting: "`indirect sampled`", needed: "a filter of at most 64 pixels" });
    }
    if settings.tracer.uses_deep_images() && !deep_images.payload {
        return Err(RenderError::Together { setting: "`indirect sampled`", needed: "deep images with triangles" });
    }
    Ok(())
}
