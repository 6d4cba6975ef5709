//! Indirect light from screen probes.
//!
//! 1. Place: one probe in each tile of pixels (`place.wesl`).
//! 2. Rays from each probe, lit by the radiance cache (`..`), are summed as spherical harmonics (`sums.wesl`).
//! 3. Filter: over the probes around, along surfaces (`filter.wesl`).
//! 4. Glossy rays of smooth surfaces, and rays to emissive triangles, start from every second pixel of every second row
//!    (`..`).
//! 5. Interpolate: each pixel reads the four probes around it (`interpolate.wesl`).
//!
//! In a mean of frames, all but the first have rays from every pixel: the mean converges to their light.

mod guide;
mod placement;
mod settings;
mod spots;

use glam::UVec2;
use lanternfish_gpu::{BufferPart, ComputeKernel, Frame, SharedStruct, gpu_struct};

#[cfg(test)]
pub(crate) use self::placement::FIRST_FURTHER_IN_TESTS;
pub use self::settings::Probes;
use self::{
    guide::{GUIDED, Guide},
    placement::{Placed, Placement},
    spots::Spots,
};
use super::{CachedFrame, PROBES, RayGrid, RayPasses, SampledLight, SampledParameters, diffuse_blur, glossy_blur};
use crate::{
    context::ViewContext,
    denoise::{
        Counters, IndirectClamp, IndirectResolution,
        smoothing::{PixelIrradiance, Smoothed},
    },
    error::RenderError,
    indirect::{DemodulatedIrradiance, IndirectPasses, layers_target, radiance_cache::CacheOfFrame},
    prepass::Surface,
    rays::Tracer,
    settings::Settings,
    shaders::{Root, Shaders},
    texture::frame_layers,
};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::new("indirect/sampled/probes/place"),
        Root::new("indirect/sampled/probes/refine"),
        Root::new("indirect/sampled/probes/compact"),
        Root::new("indirect/sampled/probes/contact"),
        Root::new("indirect/sampled/probes/spots"),
        Root::of("indirect/sampled/probes/aim", &[&[&[], &[GUIDED]]]),
        Root::of("indirect/sampled/probes/filter", &[&[&[PROBES]]]),
        Root::of("indirect/sampled/probes/interpolate", &[&[&[PROBES]]]),
    ],
    &[SharedStruct::of::<ProbeParameters>()],
);

gpu_struct! {
    /// Parameters of the passes of a frame.
    pub struct ProbeParameters {
        /// Edge of a tile, pixels.
        tile: u32,
        /// 1: the pixels have light of other rays, to which that of probes is added.
        has_pixel_rays: u32,
        /// Least perceptual roughness of surfaces whose glossy light is from probes.
        least_roughness: f32,
        /// Rays of a probe.
        rays: u32,
        /// Tiles, across and down.
        tiles: UVec2,
    }
}

/// Size of `ProbeSums`, bytes.
const SUMS_BYTES: u64 = 144;
/// In an image's first frame, one of so many rays is traced before the others, to find bright spots.
const EXPLORING: u32 = 4;
/// Least perceptual roughness at which the glossy lobe reads the probes.
const LEAST_ROUGHNESS: f32 = 0.5;

/// The passes.
#[derive(Debug)]
pub(super) struct ProbeLight {
    settings: Probes,
    light: SampledLight,
    rays: RayPasses,
    placement: Placement,
    guide: Guide,
    spots: Spots,
    contact: ComputeKernel,
    filter: ComputeKernel,
    interpolate: ComputeKernel,
}

/// The probes of a frame, and what their passes read beside them.
#[derive(Clone, Copy, Debug)]
struct Found<'a> {
    probes: &'a Placed,
    /// Short-range visibility of each pixel.
    contact: &'a wgpu::TextureView,
    parameters: &'a ProbeParameters,
    uniform: &'a BufferPart,
    /// Sums of the light of the probes' rays.
    sums: &'a wgpu::Buffer,
}

impl ProbeLight {
    /// Compiles the passes. `light`: those of rays from every pixel.
    pub fn new(
        device: &wgpu::Device,
        settings: Probes,
        light: SampledLight,
        rendering: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Self, RenderError> {
        let kernel = |file: &str, features: &[_], entry: &str| {
            let shader = DECLARED.link(&format!("indirect/sampled/probes/{file}"), features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, &format!("indirect/probes/{file}")))
        };
        let exact = tracer.unwrap_or(Tracer::BVH).exact();
        Ok(Self {
            rays: RayPasses::new(device, &light.settings, rendering, exact, &[PROBES])?,
            settings,
            light,
            placement: Placement::new(device)?,
            guide: Guide::new(device)?,
            spots: Spots::new(device)?,
            contact: kernel("contact", &[], "contact")?,
            filter: kernel("filter", &[PROBES], "filter_probes")?,
            interpolate: kernel("interpolate", &[PROBES], "interpolate")?,
        })
    }

    /// Traces rays of probes. `explores`: of [`RayGrid`].
    fn trace_rays(
        &mut self,
        frame: &mut Frame<'_>,
        view_context: &ViewContext<'_>,
        surface: &Surface,
        of_frame: &mut CacheOfFrame,
        found: &Found<'_>,
        (rays, explores): (u32, u32),
    ) -> Result<Counters, RenderError> {
        let ViewContext { scene, view, .. } = view_context;
        let parameters = ProbeParameters { rays, ..*found.parameters };
        let uniform = frame.uniform(&parameters);
        let aimed =
            self.guide.aim(frame, view_context, surface, found.probes, (&parameters, &uniform), &self.spots.listed);
        let (emitter_rays, emission_roughness) = self.light.emission(scene);
        let of_rays = SampledParameters {
            of_probes: 1,
            emitter_rays,
            emission_roughness,
            first_points: UVec2::splat(view.random_index).wrapping_mul(UVec2::new(rays, 1)),
            first_end: view.random_index.wrapping_mul(rays),
            diffuse_rays: rays,
            diffuse_blur: diffuse_blur(rays, 1),
            diffuse_density: rays as f32,
            ..Default::default()
        };
        let grid = RayGrid {
            size: found.probes.grid,
            parameters: of_rays,
            sample_count: rays,
            emitter_rays: 0,
            explores,
            sums: found.sums,
            bindings: found.probes.bindings().texture("probe_rays", &aimed),
        };
        let cache = self.light.cache.as_mut();
        let cached = cache.map(|cache| CachedFrame { cache, of_frame, may_start_over: true });
        self.rays.record(frame, view_context, surface, &grid, cached)
    }

    /// The rays of probes: their filtered sums.
    fn record_probes(
        &mut self,
        frame: &mut Frame<'_>,
        view_context: &ViewContext<'_>,
        surface: &Surface,
        of_frame: &mut CacheOfFrame,
        found: &Found<'_>,
    ) -> Result<(wgpu::Buffer, Vec<Counters>), RenderError> {
        let &Found { probes, contact, parameters, uniform, sums } = found;
        let buffer = &view_context.buffer;
        let filtered = frame.scratch("indirect/probes/filtered", sums.size())?;
        let rays = self.settings.probe_rays;
        let mut counters = Vec::new();
        if of_frame.starts_image() {
            self.spots.forget(frame);
            // A texture of one layer is no array.
            let few = (rays.div_ceil(EXPLORING).max(2), rays);
            counters.push(self.trace_rays(frame, view_context, surface, of_frame, found, few)?);
        }
        self.spots.record(frame, view_context, of_frame)?;
        if of_frame.starts_image()
            && let Some(cache) = &mut self.light.cache
        {
            cache.forget(frame, view_context, of_frame)?;
        }
        counters.push(self.trace_rays(frame, view_context, surface, of_frame, found, (rays, 0))?);
        let surfaces = buffer
            .bindings()
            .with(&surface.bindings())
            .with(&probes.bindings())
            .part("probes", uniform)
            .texture("contact_texture", contact);
        let filtering = surfaces.buffer("probe_sums", sums).buffer("filtered_probes", &filtered);
        frame.dispatch(&self.filter, &filtering, groups(&self.filter, probes.grid));
        self.guide.keep(frame, view_context, surface, parameters.tiles, &filtered)?;
        Ok((filtered, counters))
    }

    /// Glossy rays of smooth surfaces, and rays to emissive triangles: the layers of their light.
    fn record_pixels(
        &mut self,
        frame: &mut Frame<'_>,
        view_context: &ViewContext<'_>,
        surface: &Surface,
        of_frame: &mut CacheOfFrame,
        counters: &mut Vec<Counters>,
    ) -> Result<Option<wgpu::TextureView>, RenderError> {
        let ViewContext { scene, view, .. } = view_context;
        let glossy_rays = u32::from(self.light.settings.glossy_rays > 0);
        let (emitter_rays, emission_roughness) = self.light.emission(scene);
        if glossy_rays + emitter_rays == 0 {
            return Ok(None);
        }
        let settings = &self.light.settings;
        let smoothed = Smoothed::new(settings.filter_radius, settings.clamp == IndirectClamp::On, 1);
        let irradiance = PixelIrradiance::new(frame, surface.size, IndirectResolution::Half, smoothed)?;
        let parameters = SampledParameters {
            emitter_rays,
            glossy_rays,
            first_points: UVec2::splat(view.random_index),
            first_end: view.random_index,
            glossy_blur: glossy_blur(glossy_rays, 1),
            diffuse_density: self.settings.probe_rays as f32,
            most_roughness: if glossy_rays > 0 { LEAST_ROUGHNESS } else { 0.0 },
            lobes_apart: 1,
            emission_roughness,
            shades_mirrored: self.light.shades_mirrored(scene).into(),
            ..Default::default()
        };
        let grid = RayGrid {
            size: irradiance.size,
            parameters,
            sample_count: 1,
            emitter_rays,
            explores: 0,
            sums: &irradiance.irradiance,
            bindings: irradiance.bindings(),
        };
        let cache = self.light.cache.as_mut();
        let cached = cache.map(|cache| CachedFrame { cache, of_frame, may_start_over: false });
        counters.push(self.light.rays.record(frame, view_context, surface, &grid, cached)?);
        Ok(Some(self.light.smoothing.record_small(frame, view_context, surface, &irradiance)))
    }
}

impl IndirectPasses for ProbeLight {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view_context: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<DemodulatedIrradiance, RenderError> {
        let ViewContext { view, buffer, .. } = view_context;
        let Some(cache) = self.light.cache.as_mut().filter(|_| view.frame_index == 0) else {
            return self.light.record(frame, view_context, surface);
        };
        let mut of_frame = cache.begin(frame, view_context)?;
        let parameters = ProbeParameters {
            tile: self.settings.probe_size,
            rays: self.settings.probe_rays,
            tiles: surface.size.map(|side| side.div_ceil(self.settings.probe_size)),
            has_pixel_rays: 0,
            least_roughness: if self.light.settings.glossy_rays > 0 { LEAST_ROUGHNESS } else { f32::MAX },
        };
        let uniform = frame.uniform(&parameters);
        let surfaces = buffer.bindings().with(&surface.bindings());
        let probes = self.placement.record(frame, &surfaces, &parameters, &uniform)?;
        let contact = frame_layers(frame, "indirect/probes/contact", surface.size, wgpu::TextureFormat::R32Float, 1);
        let finding = surfaces.clone().part("probes", &uniform).texture("contact_target", &contact);
        frame.dispatch(&self.contact, &finding, groups(&self.contact, surface.size));
        let bytes = SUMS_BYTES * u64::from(probes.grid.x) * u64::from(probes.grid.y);
        let sums = frame.scratch("indirect/probes/sums", bytes)?;
        let found =
            Found { probes: &probes, contact: &contact, parameters: &parameters, uniform: &uniform, sums: &sums };
        let (filtered, mut counters) = self.record_probes(frame, view_context, surface, &mut of_frame, &found)?;
        let of_pixels = self.record_pixels(frame, view_context, surface, &mut of_frame, &mut counters)?;
        let layers = layers_target(frame, surface.size);
        let uniform = frame.uniform(&ProbeParameters { has_pixel_rays: of_pixels.is_some().into(), ..parameters });
        let unread = layers_target(frame, UVec2::ONE);
        let interpolating = surfaces
            .with(&probes.bindings())
            .part("probes", &uniform)
            .buffer("filtered_probes", &filtered)
            .texture("contact_texture", &contact)
            .texture("filtered_irradiance", of_pixels.as_ref().unwrap_or(&unread))
            .texture("filtered", &layers);
        frame.dispatch(&self.interpolate, &interpolating, groups(&self.interpolate, surface.size));
        let layers = self.light.smoothing.accumulated(frame, view_context, surface, layers)?;
        counters.push(of_frame.counters);
        Ok(DemodulatedIrradiance { layers, counters })
    }
}

/// Workgroups of a pass over a grid.
fn groups(kernel: &ComputeKernel, size: UVec2) -> [u32; 3] {
    let [width, height, _] = kernel.workgroup_size();
    [size.x.div_ceil(width), size.y.div_ceil(height), 1]
}
