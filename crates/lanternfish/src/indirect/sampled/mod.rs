//! Indirect light by rays from every pixel [Niessner2010, §4–6].
//!
//! 1. Rounds: one ray a pixel each, traced (`trace.wesl`), then its end shaded and added to the pixel's sums (`shade.wesl`).
//!    Two passes, since what both read together is more than one may bind.
//! 2. Resolve: sums of the pixels that rays started from become the picture's.
//! 3. Filter, along x and along y.

use glam::UVec2;
use lanternfish_gpu::{ComputeKernel, Frame, gpu_struct, storage_buffer, uniform_buffer_of};

use super::{IndirectResolution, IndirectTracer, Sampled};
use crate::{
    deep_images::DeepImages, error::RenderError, gpu_scene::GpuScene, prepass::Surface, settings::DeepImageSettings,
    shaders::SHADERS, shadows::Tracer, view::ViewBuffer,
};

gpu_struct! {
    /// What the passes share.
    pub struct SampledParameters {
        /// Pixels of the picture over samples' own, along an edge: 1 or 2.
        scale: u32,
        /// Which of a pixel's rays: diffuse ones first, then glossy ones.
        round: u32,
        /// A pixel's diffuse rays.
        diffuse_rays: u32,
        /// A pixel's glossy rays.
        glossy_rays: u32,
        /// Of the filter: pixels to each side.
        radius: u32,
        /// Along which axis: 0 is x.
        axis: u32,
        /// Roughness of the surface that would see as much of the surroundings at once as a diffuse ray stands for.
        diffuse_blur: f32,
        /// The same of a glossy ray, over its surface's roughness.
        glossy_blur: f32,
    }
}

gpu_struct! {
    /// What a ray met.
    pub struct SampledHit {
        /// In the order of the BVH's leaves, or that there is none.
        triangle: u32,
        /// m.
        distance: f32,
        /// Octahedral.
        direction: u32,
    }
}

/// Bytes of a pixel's sums: `PackedSums`.
const SUMS_BYTES: u64 = 48;
/// Of the sums: diffuse and glossy, each at normal and at grazing incidence.
const LAYERS: u32 = 4;
/// Largest reach of the filter, pixels.
const MOST_RADIUS: u32 = 64;

/// The passes.
#[derive(Debug)]
pub struct SampledLight {
    settings: Sampled,
    /// That a picture is the mean of.
    frames: u32,
    trace: ComputeKernel,
    shade: ComputeKernel,
    shade_environment: ComputeKernel,
    resolve: ComputeKernel,
    filter: ComputeKernel,
    targets: Vec<Targets>,
}

/// Of one view of a frame.
#[derive(Debug)]
struct Targets {
    size: UVec2,
    hits: wgpu::Buffer,
    sums: wgpu::Buffer,
    layers: [wgpu::TextureView; 2],
}

impl SampledLight {
    /// Compiles the passes.
    pub fn new(
        device: &wgpu::Device,
        settings: Sampled,
        deep_images: DeepImageSettings,
        frames: u32,
        tracer: Tracer,
    ) -> Result<Self, RenderError> {
        check(&settings, &deep_images)?;
        let kernel = |module: &str, features: &[&str], entry: &str, label: &str| {
            let shader = SHADERS.link(module, features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, label))
        };
        let mut tracing = deep_images.fragment_features();
        match settings.tracer {
            IndirectTracer::WithinTexel => {}
            IndirectTracer::AcrossTexels => tracing.push("across"),
            IndirectTracer::Bvh => tracing = vec!["bvh"],
        }
        let shading: Vec<&str> = tracer.exact().feature().into_iter().collect();
        let under_sky: Vec<&str> = shading.iter().copied().chain(["environment"]).collect();
        Ok(Self {
            settings,
            frames,
            trace: kernel("indirect/sampled/trace", &tracing, "trace", "indirect/trace")?,
            shade: kernel("indirect/sampled/shade", &shading, "shade", "indirect/shade")?,
            shade_environment: kernel("indirect/sampled/shade", &under_sky, "shade", "indirect/shade")?,
            resolve: kernel("indirect/sampled/filter", &[], "resolve", "indirect/resolve")?,
            filter: kernel("indirect/sampled/filter", &[], "filter_axis", "indirect/filter")?,
            targets: Vec::new(),
        })
    }

    /// Finds the light of one view: its four layers.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        images: Option<&DeepImages>,
        view: &ViewBuffer,
        surface: &Surface,
        frame_index: u32,
    ) -> Result<wgpu::TextureView, RenderError> {
        let device = frame.device;
        let scale = match self.settings.resolution {
            IndirectResolution::Full => 1,
            IndirectResolution::Half => 2,
        };
        self.make_targets(device, surface.size, scale, surface.slot)?;
        // Noise falls with the number of frames, and as much smaller is the area that light must be averaged over.
        let frames = self.frames.max(frame_index.saturating_add(1));
        let radius = (self.settings.filter_radius as f32 / (frames as f32).sqrt()) as u32;
        let Self { settings, targets, .. } = self;
        let targets = &targets[surface.slot];
        let groups = |kernel: &ComputeKernel, size: UVec2| {
            let [width, height, _] = kernel.workgroup_size();
            [size.x.div_ceil(width), size.y.div_ceil(height), 1]
        };
        let sample_size = surface.size.map(|side| side.div_ceil(scale));
        let samples = groups(&self.trace, sample_size);
        let pixels = groups(&self.filter, surface.size);
        let parameters = SampledParameters {
            scale,
            diffuse_rays: settings.diffuse_rays,
            glossy_rays: settings.glossy_rays,
            radius,
            diffuse_blur: diffuse_blur(settings.diffuse_rays, frames),
            glossy_blur: ((settings.glossy_rays.max(1) as f32) * frames as f32).powf(-0.25),
            ..Default::default()
        };
        let shared = view.bindings().with(&surface.bindings());
        let seen = scene.bindings().with(&shared);
        let environment = scene.environment.as_ref().map(|_| scene.environment_light().bindings());
        let shade = if environment.is_some() { &self.shade_environment } else { &self.shade };

        let images = images.filter(|_| settings.tracer != IndirectTracer::Bvh);
        for round in 0..settings.diffuse_rays + settings.glossy_rays {
            let uniform = uniform_buffer_of(device, "indirect/parameters", &SampledParameters { round, ..parameters });
            let tracing = seen.clone().buffer("sampled", &uniform).buffer("sampled_hits", &targets.hits);
            match images {
                None => frame.dispatch(&self.trace, &tracing, samples),
                Some(images) => {
                    for chunk in &images.chunks {
                        let chunk_bindings = chunk.bindings(&images.frames).with(&images.direction_bindings());
                        frame.dispatch(&self.trace, &tracing.clone().with(&chunk_bindings), samples);
                    }
                }
            }
            let mut shading = seen
                .clone()
                .buffer("sampled", &uniform)
                .buffer("hits_to_shade", &targets.hits)
                .buffer("ray_sums", &targets.sums);
            if let Some(environment) = &environment {
                shading = shading.with(environment);
            }
            frame.dispatch(shade, &shading, samples);
        }

        let [mut read, mut written] = [&targets.layers[1], &targets.layers[0]];
        let uniform = uniform_buffer_of(device, "indirect/parameters", &parameters);
        let resolving = shared.clone().buffer("sampled", &uniform).buffer("finished_sums", &targets.sums);
        frame.dispatch(&self.resolve, &resolving.texture("filtered", written), pixels);
        for axis in 0..if radius > 0 { 2 } else { 0 } {
            std::mem::swap(&mut read, &mut written);
            let uniform = uniform_buffer_of(device, "indirect/parameters", &SampledParameters { axis, ..parameters });
            let filtering = shared.clone().buffer("sampled", &uniform).texture("filtered_sums", read);
            frame.dispatch(&self.filter, &filtering.texture("filtered", written), pixels);
        }
        Ok(written.clone())
    }

    fn make_targets(&mut self, device: &wgpu::Device, size: UVec2, scale: u32, slot: usize) -> Result<(), RenderError> {
        if self.targets.get(slot).is_some_and(|targets| targets.size == size) {
            return Ok(());
        }
        let samples = size.map(|side| side.div_ceil(scale));
        let count = u64::from(samples.x) * u64::from(samples.y);
        let layers = || {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("indirect/layers"),
                size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: LAYERS },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba16Float,
                usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            let dimension = Some(wgpu::TextureViewDimension::D2Array);
            texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() })
        };
        let hit_bytes = size_of::<SampledHit>() as u64;
        self.targets.truncate(slot);
        self.targets.push(Targets {
            size,
            hits: storage_buffer(device, "indirect/hits", hit_bytes * count)?,
            sums: storage_buffer(device, "indirect/sums", SUMS_BYTES * count)?,
            layers: [layers(), layers()],
        });
        Ok(())
    }
}

/// Roughness whose lobe about the mirror direction is as wide as the part of the hemisphere that one of so many rays, in each of so
/// many frames, stands for: 2π over their number, a cone of whose directions half are within tan α of the half vector.
fn diffuse_blur(rays: u32, frames: u32) -> f32 {
    let cosine = 1.0 - 1.0 / (rays as f32 * frames as f32).max(1.0);
    let alpha = (cosine.acos() / (2.0 * std::f32::consts::SQRT_2)).tan();
    alpha.sqrt()
}

/// An error where the numbers make no sense.
fn check(settings: &Sampled, deep_images: &DeepImageSettings) -> Result<(), RenderError> {
    if settings.diffuse_rays == 0 || settings.diffuse_rays > 4096 || settings.glossy_rays > 4096 {
        return Err(RenderError::Together { setting: "--indirect sampled", needed: "1 to 4096 rays a pixel" });
    }
    if settings.filter_radius > MOST_RADIUS {
        return Err(RenderError::Together { setting: "--indirect sampled", needed: "a filter of at most 64 pixels" });
    }
    if settings.tracer != IndirectTracer::Bvh && !deep_images.payload {
        return Err(RenderError::Together { setting: "--indirect sampled", needed: "deep images with triangles" });
    }
    Ok(())
}
