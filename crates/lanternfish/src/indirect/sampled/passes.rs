//! The passes that trace rays from the sources of a grid, light their hits, and add the light to the sources' sums.

use glam::UVec2;
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame, faulty_software, uniform_buffer_of};

use super::{
    ANY_SOURCE, DECLARED, GLOSSY_RAYS, HitLight, SampleSlots, Sampled, SampledParameters,
    entries::{CachedFrame, EntryPasses, SHADE, SHADOW},
    sample_order,
    targets::Targets,
};
use crate::{
    context::ViewContext,
    denoise::{Counters, smoothing::SmoothingParameters},
    environment_light::ENVIRONMENT,
    error::RenderError,
    prepass::Surface,
    rays::{SceneKernel, TracePass, Tracer},
    settings::Settings,
    texture::frame_layers,
};

/// The rays of a grid of sources: pixels, or screen probes.
#[derive(Debug)]
pub(in crate::indirect) struct RayGrid<'a> {
    /// Sources of rays, across and down.
    pub size: UVec2,
    pub parameters: SampledParameters,
    /// Rays of a source.
    pub sample_count: u32,
    /// Rays of a source to emissive triangles.
    pub emitter_rays: u32,
    /// Number of sample indices before which these rays explore: they find entries, and no light is gathered. 0: they do
    /// not.
    pub explores: u32,
    /// Buffer to which the rays' light is added.
    pub sums: &'a wgpu::Buffer,
    /// Bindings of the sources.
    pub bindings: Bindings<'a>,
}

/// The passes.
#[derive(Debug)]
pub(in crate::indirect) struct RayPasses {
    trace: TracePass,
    sample_order: wgpu::Buffer,
    shade: ComputeKernel,
    shade_environment: ComputeKernel,
    shadow: SceneKernel,
    /// Hits that are looked up together are shaded together. Then only hits for which the cache is full have shadow
    /// rays: their light is added after that of emissive triangles and the environment, not in turn.
    shades_many: bool,
    emitters: Option<SceneKernel>,
    entries: Option<EntryPasses>,
}

impl RayPasses {
    /// Compiles the passes. `exact`: tracer of shadow rays; `of_source`: features of the sources.
    pub fn new(
        device: &wgpu::Device,
        sampled: &Sampled,
        settings: &Settings,
        exact: Tracer,
        of_source: &[Feature],
    ) -> Result<Self, RenderError> {
        let structure = &settings.structure;
        let is_of_pixels = of_source.is_empty();
        let folder = if is_of_pixels { "indirect" } else { "indirect/probes" };
        let traced = sampled.tracer.fixed().check(device, "`indirect-tracer ray-query`", "`indirect-tracer bvh`")?;
        let kernel = |module: &str, folder: &str, features: &[&[Feature]]| {
            let shader = DECLARED.link(&format!("indirect/sampled/{module}"), &features.concat())?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, module, &format!("{folder}/{module}")))
        };
        let of_scene = |entry: &'static str, of_source: &[Feature]| {
            let features = [of_source, &exact.features(structure, true)].concat();
            let module = format!("indirect/sampled/{entry}");
            SceneKernel::new(device, DECLARED, &module, &features, entry, &format!("indirect/{entry}"))
        };
        let of_ids = traced.features_of_ids();
        let of_rays: &[Feature] = if is_of_pixels && sampled.glossy_rays > 0 { &[GLOSSY_RAYS] } else { of_source };
        Ok(Self {
            trace: TracePass::new(
                traced,
                structure,
                kernel("trace", folder, &[of_source, &traced.features(structure, true)])?,
            ),
            sample_order: uniform_buffer_of(device, "sample_order", &sample_order::words()),
            shade: kernel("shade", "indirect", &[&[ANY_SOURCE], of_ids])?,
            shade_environment: kernel("shade", "indirect", &[&[ANY_SOURCE, ENVIRONMENT], of_ids])?,
            shadow: of_scene("shadow", &[ANY_SOURCE])?,
            shades_many: !is_of_pixels,
            emitters: match is_of_pixels && settings.shares_emission().is_none() {
                true => Some(of_scene("emitters", &[])?),
                false => None,
            },
            entries: match sampled.hit_light {
                HitLight::Shaded => None,
                HitLight::Cached => Some(EntryPasses::new(device, of_rays, traced, folder)?),
            },
        })
    }

    /// Traces the rays and adds their light to the sums, which this clears first. Returns the counts of rays.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view_context: &ViewContext<'_>,
        surface: &Surface,
        grid: &RayGrid<'_>,
        cached: Option<CachedFrame<'_>>,
    ) -> Result<Counters, RenderError> {
        let ViewContext { scene, buffer, .. } = view_context;
        let mut entries = match (&self.entries, cached) {
            (Some(passes), Some(cached)) => Some(passes.begin(frame, view_context, cached, grid)?),
            _ => None,
        };
        let targets = Targets::new(frame, grid.size, grid.sample_count, self.shades_many)?;
        let [width, height, _] = self.shade.workgroup_size();
        let workgroups = [grid.size.x.div_ceil(width), grid.size.y.div_ceil(height), 1];
        let surfaces = buffer.bindings().with(&surface.bindings()).buffer("sample_order", &self.sample_order);
        let parameters = entries.as_ref().map_or(grid.parameters, |entries| entries.parameters(grid.parameters));
        let of_frame = frame.uniform(&parameters);
        // What belongs to the other kind of sources is bound, and not read.
        let unread = frame.uniform(&SmoothingParameters::default());
        let texels = [1, 2]
            .map(|layers| frame_layers(frame, "indirect/unread", UVec2::ONE, wgpu::TextureFormat::R32Uint, layers));
        let sources = Bindings::new().part("smoothing", &unread).texture("probe_pixels", &texels[0]);
        let sources = sources.texture("probe_rays", &texels[1]).with(&grid.bindings);
        let frame_bindings = scene.bindings().with(&surfaces).with(&sources).part("sampled", &of_frame);
        if scene.environment.is_some() {
            check_driver(&frame.device.adapter_info())?;
        }
        let environment = scene.environment.as_ref().map(|_| scene.environment_light().bindings());
        for kernel in std::iter::once(&self.shadow).chain(&self.emitters) {
            kernel.prepare(frame.device, scene)?;
        }
        let (shadow, emitters) = (self.shadow.of(scene), self.emitters.as_ref().map(|emitters| emitters.of(scene)));
        let shade = if environment.is_some() { &self.shade_environment } else { &self.shade };

        // First of the sample indices whose hits are in the buffer.
        let mut traced_first = None;
        // End of those whose hits are shaded.
        let mut shaded_end = 0;
        let mut sample_index = 0;
        while sample_index < grid.sample_count {
            // Also if the frame starts over.
            if sample_index == 0 {
                frame.encoder().clear_buffer(grid.sums, 0, None);
            }
            let of_entries =
                entries.as_ref().map_or(0..grid.sample_count, |entries| entries.gathered_with(sample_index));
            let traced = targets.traced_with(sample_index, of_entries.clone());
            let mut of_sample = SampleSlots {
                round: sample_index,
                found_end: 0,
                traced_first: traced.start,
                traced_end: traced.end,
                first_sample: of_entries.start,
                sample_of_hit: of_entries.end,
                shaded_end: sample_index + 1,
            };
            of_sample.found_end = entries.as_ref().map_or(0, |entries| entries.found_end(&of_sample));
            if self.shades_many {
                of_sample.shaded_end = (sample_index + targets.shaded_together).min(of_sample.found_end);
            }
            let uniform = frame.uniform(&of_sample);
            let sample_bindings = frame_bindings.clone().part("sample_slots", &uniform);
            let tracing = sample_bindings.clone().buffer("sampled_hits", &targets.hits);
            if traced_first.replace(traced.start) != Some(traced.start) {
                let groups = sample_order::workgroups(grid.size);
                self.trace.dispatch(frame, &view_context.structures, &tracing, groups);
            }
            let summing =
                sample_bindings.buffer("ray_irradiance", grid.sums).buffer("ray_counters", targets.counters.buffer());
            let mut shading =
                summing.clone().buffer("hits_to_shade", &targets.hits).buffer("chosen_lights", &targets.light_rays);
            if let Some(environment) = &environment {
                shading = shading.with(environment);
            }
            let light_bindings = summing.clone().buffer("light_rays", &targets.light_rays);
            match &mut entries {
                None => {
                    frame.dispatch(shade, &shading, workgroups);
                    frame.dispatch(shadow, &light_bindings, workgroups);
                }
                Some(entries) => {
                    if entries.looks_up(&of_sample) {
                        entries.find(frame, &summing.clone().buffer("sampled_hits", &targets.hits));
                    }
                    if sample_index >= shaded_end {
                        shaded_end = of_sample.shaded_end;
                        frame.dispatch_indirect(shade, &shading, &entries.dispatches, SHADE);
                        frame.dispatch_indirect(shadow, &light_bindings, &entries.dispatches, SHADOW);
                    }
                    entries.sample(frame, view_context, sample_index)?;
                }
            }
            if let Some(emitters) = emitters.filter(|_| sample_index < grid.emitter_rays) {
                frame.dispatch(emitters, &light_bindings, workgroups);
            }
            if let Some(entries) = &mut entries
                && sample_index + 1 == of_entries.end
                && grid.explores == 0
            {
                entries.gather(frame, view_context, &summing.clone().buffer("sampled_hits", &targets.hits))?;
            }
            sample_index += 1;
            if let Some(entries) = &mut entries
                && entries.starts_over(frame, view_context, sample_index - 1)?
            {
                frame.encoder().clear_buffer(targets.counters.buffer(), 0, None);
                (sample_index, shaded_end) = (0, 0);
            }
        }
        frame.release(&targets.hits);
        frame.release(&targets.light_rays);
        if let Some(entries) = &entries {
            entries.release(frame);
        }
        Ok(targets.counters)
    }
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
