//! Builds the virtual lights of a frame: from the surfaces that the scene's lights see to a set of lights with ranges.

use lanternfish::{
    RenderError, ViewContext,
    common::workgroups,
    denoise::Counters,
    gpu_scene::GpuScene,
    lights::{Light, LightCount, LightSet},
    rays::{Structure, TracePass, Tracer},
    settings::{Coefficients, Materials, Settings},
};
use lanternfish_gpu::{ComputeKernel, Counted, Feature, Frame, primitives::Scan, uniform_buffer_of};

use super::{
    DECLARED, Emission, MapSource, Ranges, Residual, VirtualLightParameters, VirtualLights,
    draw::MapRaster,
    parameters::{LightRange, Texel},
};
use crate::indirect::light_views::{KeptLightViews, LightViews, Squares, radius_of};

/// Name of the list of virtual lights, and of the lists of their indices.
const LIGHTS: &str = "indirect/virtual_lights";
const INDICES: &str = "indirect/virtual_light_indices";

/// Names of the counters: the constants of `ranges.wesl`. Flux is in 1/256 of the lights' mean flux per texel of the map.
const COUNTERS: &[&str] = &[
    "virtual_lights/unique",
    "virtual_lights/taken",
    "virtual_lights/listed",
    "virtual_lights/too_small",
    "virtual_lights/too_large",
    "virtual_lights/range_rays_missed",
    "virtual_lights/flux_sent",
    "virtual_lights/flux_arriving",
    "virtual_lights/flux_in_range",
    "virtual_lights/flux_given",
];

/// Maximum level of merged blocks: `emission.wesl`.
const MOST_LEVELS: u32 = 5;
/// Rays per range: `rays.wesl`.
const RANGE_RAYS: u64 = 6;
/// Units of flux per texel, in the mean.
const FLUX_UNITS: f32 = 256.0;

/// The lights of one frame, which all of its views share.
#[derive(Debug)]
pub(super) struct FrameLights {
    /// Number of the frame.
    frame: u64,
    /// The lights that culling makes lists of. The lights that carry cut-off flux follow after the capacity.
    pub set: LightSet,
    pub parameters: VirtualLightParameters,
    pub counters: Counters,
}

/// The passes that build the lights.
#[derive(Debug)]
pub(super) struct LightBuilder {
    settings: VirtualLights,
    materials: Materials,
    /// Light that mirrors reflect is left to caustics.
    leaves_mirrored: bool,
    /// Cut-off intensity, cd.
    threshold: f32,
    /// Of the attenuation `clq`.
    coefficients: Coefficients,
    /// None: the complete map is traced.
    raster: Option<MapRaster>,
    trace: ComputeKernel,
    merge: ComputeKernel,
    count_texels: ComputeKernel,
    weigh: ComputeKernel,
    thin: ComputeKernel,
    range_rays: Option<TracePass>,
    ranges: ComputeKernel,
    scan: Scan,
    scatter: ComputeKernel,
    choose_far: ComputeKernel,
    /// The uniform from which light culling reads the number of lights.
    count: wgpu::Buffer,
    /// Distribution of the map's texels over the lights.
    map: KeptLightViews,
    lights: Option<FrameLights>,
}

impl LightBuilder {
    /// Compiles the passes. `exact`: the tracer of rays from the scene's lights.
    pub fn new(
        device: &wgpu::Device,
        technique: VirtualLights,
        settings: &Settings,
        structure: &Structure,
        exact: Tracer,
    ) -> Result<Self, RenderError> {
        let kernel = |file: &str, features: &[Feature], entry: &str, label: &str| {
            let shader = DECLARED.link(&format!("indirect/virtual_lights/{file}"), features)?;
            let label = format!("indirect/virtual_lights/{label}");
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, &label))
        };
        let tracer = technique.range_tracer.check(device, "`vpl-range-tracer ray-query`", "`vpl-range-tracer bvh`")?;
        let by_range = || kernel("range_rays", &tracer.features(structure, false), "trace", "range_rays");
        let range_rays = technique.traces_ranges().then(by_range).transpose()?;
        Ok(Self {
            settings: technique,
            materials: settings.materials.model,
            leaves_mirrored: settings.finds_caustics(),
            threshold: settings.lights.range_threshold,
            coefficients: settings.lights.coefficients,
            raster: (technique.source == MapSource::Raster).then(|| MapRaster::new(device)).transpose()?,
            trace: kernel("trace", &exact.features(structure, false), "trace", "map")?,
            merge: kernel("merge", &[], "merge", "merge")?,
            count_texels: kernel("thin", &[], "count", "count")?,
            weigh: kernel("thin", &[], "weigh", "weigh")?,
            thin: kernel("thin", &[], "thin", "thin")?,
            range_rays: range_rays.map(|kernel| TracePass::new(tracer, structure, kernel)),
            ranges: kernel("ranges", &[], "ranges", "ranges")?,
            scan: Scan::new(device, "indirect/virtual_lights")?,
            scatter: kernel("scatter", &[], "scatter", "scatter")?,
            choose_far: kernel("scatter", &[], "choose_far", "choose_far")?,
            count: uniform_buffer_of(
                device,
                "indirect/virtual_lights/count",
                &LightCount::new(0, &settings.light_storage()),
            ),
            map: KeptLightViews::default(),
            lights: None,
        })
    }

    /// The lights of the current frame; computed for the first of its views.
    pub fn get(&mut self, frame: &mut Frame<'_>, view: &ViewContext<'_>) -> Result<&FrameLights, RenderError> {
        if self.lights.as_ref().is_none_or(|lights| lights.frame != frame.number()) {
            self.lights = Some(self.find(frame, view)?);
        }
        Ok(self.lights.as_ref().expect("built above if it was missing"))
    }

    fn find(&mut self, frame: &mut Frame<'_>, view_context: &ViewContext<'_>) -> Result<FrameLights, RenderError> {
        let ViewContext { scene, view, buffer, .. } = view_context;
        let texels = self.settings.map.texels().pow(2);
        self.map.renew(scene, texels, Squares::PowersOfTwo, view.frame_index);
        let mut parameters = self.parameters(scene, view.frame_index);
        let map = self.map.views();
        let count = parameters.texel_count;
        let scene_bindings = scene.bindings().with(&buffer.bindings());

        // The reflective shadow map.
        let views = map.record(frame, scene, view.frame_index)?;
        let texel_buffer =
            frame.scratch("indirect/virtual_lights/texels", size_of::<Texel>() as u64 * u64::from(texels))?;
        let uniform = frame.uniform(&parameters);
        let tracing = scene_bindings.clone().part("virtual_lights", &uniform);
        let tracing = tracing.with(&views.bindings()).buffer("texels", &texel_buffer);
        if let Some(raster) = &mut self.raster {
            raster.record(frame, scene, &map.views, self.settings.map.texels(), &tracing)?;
        }
        frame.dispatch(&self.trace, &tracing, workgroups(count - parameters.first_traced));
        for level in (1..=MOST_LEVELS).filter(|_| parameters.spacing > 0.0) {
            let uniform = frame.uniform(&VirtualLightParameters { level, ..parameters });
            let merging =
                lanternfish_gpu::Bindings::new().part("virtual_lights", &uniform).buffer("texels", &texel_buffer);
            frame.dispatch(&self.merge, &merging, workgroups((count >> (2 * level)).max(1)));
        }

        // Select the requested number of lights; all, if none is requested. From here on the texels are the selected lights.
        let mut counters = Counters::new(frame, "indirect/virtual_lights/counters", 1, COUNTERS)?;
        counters.adds_up = false;
        let weights = frame.scratch("indirect/virtual_lights/texel_weights", 4 * (u64::from(count) + 1))?;
        let weighing = lanternfish_gpu::Bindings::new()
            .part("virtual_lights", &uniform)
            .buffer("texels", &texel_buffer)
            .buffer("texel_weights", &weights)
            .buffer("light_counters", counters.buffer());
        frame.dispatch(&self.count_texels, &weighing, workgroups(count));
        let mut taken = None;
        if parameters.taken_count < count {
            frame.dispatch(&self.weigh, &weighing, workgroups(count + 1));
            self.scan.record(frame, &weights, count + 1)?;
            let bytes = size_of::<Texel>() as u64 * u64::from(parameters.taken_count);
            let lights = taken.insert(frame.scratch("indirect/virtual_lights/taken", bytes)?);
            frame.dispatch(&self.thin, &weighing.buffer("taken_texels", lights), workgroups(parameters.taken_count));
        }
        let texel_buffer = taken.unwrap_or(texel_buffer);
        (parameters.texel_count, parameters.level) = (parameters.taken_count, 0);
        let (count, texels) = (parameters.texel_count, parameters.texel_count);
        let uniform = frame.uniform(&parameters);

        // Measure the range of each light.
        let distances = frame.zeroed("indirect/virtual_lights/distances", 4 * RANGE_RAYS * u64::from(texels))?;
        let shared = scene_bindings.part("virtual_lights", &uniform).buffer("texels", &texel_buffer);
        if let Some(range_rays) = &self.range_rays {
            let tracing = shared.clone().buffer("range_distances", &distances);
            range_rays.dispatch(frame, &view_context.structures, &tracing, workgroups(count));
        }
        let ranges =
            frame.scratch("indirect/virtual_lights/ranges", size_of::<LightRange>() as u64 * u64::from(texels))?;
        let places = frame.scratch("indirect/virtual_lights/places", 4 * (u64::from(texels) + 1))?;
        let weights = frame.scratch("indirect/virtual_lights/far_weights", 4 * (u64::from(texels) + 1))?;
        let limiting = shared
            .clone()
            .buffer("range_distances", &distances)
            .buffer("light_ranges", &ranges)
            .buffer("light_places", &places)
            .buffer("far_weights", &weights)
            .buffer("light_counters", counters.buffer());
        frame.dispatch(&self.ranges, &limiting, workgroups(count + 1));

        // Write the kept lights in the order of the texels.
        let total = self.scan.record(frame, &places, count + 1)?;
        let counted_total = frame.scratch("indirect/virtual_lights/known", 16)?;
        frame.encoder().copy_buffer_to_buffer(&total, 0, &counted_total, 0, 4);
        let limit = frame.device.limits().max_storage_buffer_binding_size / size_of::<Light>() as u64;
        let limit = limit.saturating_sub(parameters.far_count.into());
        let grown = frame.capacity_for(&Counted {
            list: LIGHTS,
            words: &counted_total,
            starts: (&places, count as usize + 1),
            may_wrap: &|_| false,
            guess: u64::from(count / 4),
            limit,
        })?;
        if grown.elements > limit {
            let remedy = "choose a smaller `vpl-map`, or `vpl-unique on` with a larger `vpl-spacing`";
            return Err(RenderError::Overflow { list: LIGHTS, needed: grown.elements, limit, remedy });
        }
        parameters.capacity = grown.capacity as u32;
        let uniform = frame.uniform(&parameters);
        // A binding cannot be empty.
        let bytes = size_of::<Light>() as u64 * (grown.capacity + u64::from(parameters.far_count)).max(1);
        let lights = frame.scratch("indirect/virtual_lights/lights", bytes)?;
        let counted = frame.scratch("indirect/virtual_lights/counted", 16)?;
        if parameters.far_count > 0 {
            self.scan.record(frame, &weights, count + 1)?;
        }
        let placing = shared
            .part("virtual_lights", &uniform)
            .buffer("placed_ranges", &ranges)
            .buffer("placed_lights", &places)
            .buffer("texel_weights", &weights)
            .buffer("counted_lights", counters.buffer())
            .buffer("found_lights", &lights)
            .buffer("found_count", &counted);
        frame.dispatch(&self.scatter, &placing, workgroups(count));
        if parameters.far_count > 0 {
            frame.dispatch(&self.choose_far, &placing, workgroups(parameters.far_count));
        }
        frame.encoder().copy_buffer_to_buffer(&counted, 0, &self.count, 0, 4);
        let set = LightSet {
            lights,
            count: self.count.clone(),
            counted: Some(counted),
            on_host: [].into(),
            capacity: parameters.capacity,
            bounds: *scene.bounds(),
            list: INDICES,
            remedy: Some("choose a smaller `vpl-count` or `vpl-most-range`"),
        };
        Ok(FrameLights { frame: frame.number(), set, parameters, counters })
    }

    fn parameters(&self, scene: &GpuScene, frame_index: u32) -> VirtualLightParameters {
        let settings = &self.settings;
        let LightViews { views, flux, .. } = self.map.views();
        let [constant, linear, quadratic] = self.coefficients.0;
        let radius = radius_of(scene.bounds());
        let texels = settings.map.texels().pow(2);
        let taken_count = match settings.count {
            _ if views.is_empty() => 0,
            0 => texels,
            count => count.min(texels),
        };
        // Without ranges no light is too far.
        let most_range = if settings.ranges == Ranges::Unlimited { f32::MAX } else { settings.most_range * radius };
        VirtualLightParameters {
            constant,
            linear,
            quadratic,
            scene_radius: radius,
            texel_count: if views.is_empty() { 0 } else { texels },
            first_traced: if self.raster.is_some() { MapRaster::texels(views) } else { 0 },
            frame_index,
            level: 0,
            spacing: if settings.unique { settings.spacing * radius } else { 0.0 },
            flux_unit: (flux / texels as f32 / FLUX_UNITS).max(f32::MIN_POSITIVE),
            range_source: range_source(settings.ranges),
            axis: settings.axis as u32,
            statistic: u32::from(settings.ranges == Ranges::Maximum),
            least_range: settings.least_range * radius,
            most_range,
            large_kept: settings.large_kept as f32 / 100.0,
            threshold: cut_off_intensity(settings.ranges, self.threshold / scene.light_unit(), taken_count),
            falloff: settings.falloff as u32,
            traces_ranges: u32::from(self.range_rays.is_some()),
            emission: u32::from(settings.emission == Emission::Root),
            residual: settings.residual as u32,
            least_distance: settings.least_distance.unwrap_or(-1.0),
            capacity: 0,
            far_count: if settings.residual == Residual::FarLights { settings.far_lights } else { 0 },
            shadow_rays: settings.shadow_rays,
            weight_count: settings.weight_count,
            glossy: u32::from(self.materials == Materials::File && settings.glossy_rays == 0),
            leaves_mirrored: self.leaves_mirrored.into(),
            stride: settings.stride.max(1),
            taken_count,
        }
    }
}

/// Cut-off intensity of each of `count` lights, cd.
fn cut_off_intensity(ranges: Ranges, threshold: f32, count: u32) -> f32 {
    match ranges {
        // R1 = √(I / I0) [VanGelderen2020, §A.1].
        Ranges::ThresholdEach => threshold,
        // All lights together lose no more than one light may.
        _ => threshold / count.max(1) as f32,
    }
}

/// Index of the range source in `ranges.wesl`.
fn range_source(ranges: Ranges) -> u32 {
    match ranges {
        Ranges::Average | Ranges::Maximum => 0,
        Ranges::Random => 1,
        Ranges::Threshold | Ranges::ThresholdEach => 2,
        Ranges::Unlimited => 3,
    }
}

#[cfg(test)]
#[test]
fn constants_are_the_shaders() {
    let constant =
        |file: &str, name| crate::shaders::SHADERS.constant(&format!("indirect/virtual_lights/{file}"), name) as u32;
    assert_eq!(
        (constant("emission", "MOST_LEVELS"), u64::from(constant("rays", "RANGE_RAYS"))),
        (MOST_LEVELS, RANGE_RAYS)
    );
    let sources = ["BY_RAYS", "RANDOM", "THRESHOLD", "UNLIMITED"].map(|name| constant("ranges", name));
    let ranges = [Ranges::Average, Ranges::Random, Ranges::Threshold, Ranges::Unlimited];
    assert_eq!(sources, ranges.map(range_source));
    let columns = [
        "UNIQUE",
        "TAKEN",
        "LISTED",
        "TOO_SMALL",
        "TOO_LARGE",
        "MISSES",
        "FLUX_SENT",
        "FLUX_ARRIVING",
        "FLUX_IN_RANGE",
    ];
    let columns: Vec<u32> = columns.iter().chain(&["FLUX_GIVEN"]).map(|name| constant("counters", name)).collect();
    assert_eq!(columns, (0..COUNTERS.len() as u32).collect::<Vec<_>>());
    use super::MapSize;
    assert!(MapSize::ALL.iter().all(|size| size.texels().is_power_of_two()));
}

/// A light's range is √(I / I0) [VanGelderen2020, §A.1], with I0 for each light or for all of them together; or the mean
/// length of its rays that hit something [Archer2019, §3.1], of whichever there are, and the scene's width if none does.
#[cfg(test)]
#[gpu_test(crate::testing::gpu)]
fn gpu_ranges_are_those_of_a_cut_off_intensity_or_of_rays_that_hit(gpu: &lanternfish_gpu::Gpu) {
    use glam::Vec3;
    use lanternfish_gpu::testing::Memory;
    const COUNT: u32 = 100;
    let flux = |i: u32| 0.01 * (i + 1) as f32;
    // A diffuse surface of this flux sends flux / π along its normal; luminances of equal channels are these.
    let cut_off = |shared: u32| move |i| (flux(i) / std::f32::consts::PI * shared as f32 / 0.25).sqrt();
    let distances =
        |i: u32| if i.is_multiple_of(2) { [2.0, -1.0, 4.0, -1.0, -1.0, -1.0] } else { [-1f32; RANGE_RAYS as usize] };
    let by_rays = |i: u32| if i.is_multiple_of(2) { 3.0 } else { 2e6 };
    let cases: [(Ranges, &dyn Fn(u32) -> f32); 3] =
        [(Ranges::ThresholdEach, &cut_off(1)), (Ranges::Threshold, &cut_off(COUNT)), (Ranges::Average, &by_rays)];
    for (ranges, expected) in cases {
        let parameters = VirtualLightParameters {
            scene_radius: 1e6,
            texel_count: COUNT,
            flux_unit: 1.0,
            range_source: range_source(ranges),
            least_range: f32::MIN_POSITIVE,
            most_range: f32::MAX,
            threshold: cut_off_intensity(ranges, 0.25, COUNT),
            ..VirtualLightParameters::default()
        };
        let texel = |i: u32| Texel { flux: Vec3::splat(flux(i)), ..Texel::default() };
        let mut memory = Memory::new();
        memory.bind(&["virtual_lights"], &[parameters]);
        memory.bind(&["texels"], &(0..COUNT).map(texel).collect::<Vec<_>>());
        memory.bind(&["range_distances"], &(0..COUNT).flat_map(distances).collect::<Vec<_>>());
        memory.bind(&["light_ranges"], &vec![LightRange::default(); COUNT as usize]);
        for name in ["light_places", "far_weights"] {
            memory.bind(&[name], &vec![0u32; COUNT as usize + 1]);
        }
        memory.bind(&["light_counters"], &vec![0u32; COUNTERS.len()]);
        let shader = DECLARED.link("indirect/virtual_lights/ranges", &[]).expect("it links");
        memory.run_on(gpu, &shader, "ranges", workgroups(COUNT + 1));
        let found: Vec<LightRange> = memory.get("light_ranges");
        for (i, found) in (0..).zip(found) {
            let expected = expected(i);
            assert!((found.range / expected - 1.0).abs() < 1e-5, "{ranges} {i}: {found:?}, not {expected}");
        }
    }
}
