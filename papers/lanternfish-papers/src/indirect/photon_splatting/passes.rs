//! The passes of photon splatting and their order.

mod chunk;

use std::any::Any;

use glam::{Quat, UVec2};
use lanternfish::{
    RenderError, ViewContext,
    common::workgroups,
    denoise::{
        Counters,
        smoothing::{IndirectClamp, MOST_RADIUS, PixelIrradiance, Smoothed, Smoothing},
    },
    indirect::{DemodulatedIrradiance, IndirectPasses},
    light_culling::LightCulling,
    lights::{Light, LightCount},
    prepass::Surface,
    rays::{Structure, TracePass, Tracer},
    settings::{Materials, Settings},
    view::rotations::frame_rotation,
};
use lanternfish_gpu::{ComputeKernel, Feature, Frame, gpu_constants, primitives::Scan, uniform_buffer_of};

use self::chunk::PhotonInputs;
use super::{
    DECLARED, PhotonSplatting, Splat, directions::PhotonDirections, parameters::PhotonParameters, raster::SplatRaster,
};
use crate::{
    deep_images::{DeepImages, settings::DeepImageSettings},
    indirect::light_views::{KeptLightViews, Squares},
};

/// Name of the lists of photon indices.
const INDICES: &str = "indirect/photon_indices";

/// Names of the counters: the constants of `counters.wesl`. Flux is in 1/2³² of the lights' flux.
pub(super) const COUNTERS: &[&str] = &[
    "photons/emitted",
    "photons/reflected",
    "photons/escaped",
    "photons/landed",
    "photons/off_screen",
    "photons/hidden",
    "photons/splatted",
    "photons/flux_arrived",
    "photons/flux_reflected",
    "photons/flux_landed",
    "photons/flux_splatted",
];

/// Flux of all lights, in units of the flux counters.
pub(super) const FLUX_UNITS: f32 = 4_294_967_296.0;

gpu_constants! {
    /// Rows of counters, which the host adds up: concurrent invocations count in different rows, and no sum exceeds its word.
    pub(super) const ROWS: u32 = 64;
    /// Edge of a tile in which photons are searched, pixels.
    pub(super) const TILE: u32 = 16;
}

/// What becomes of a photon at a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Photons {
    /// It is split into the directions of the set, and mirrored.
    Split,
    /// It is mirrored alone, and lights diffuse surfaces.
    Mirrored,
}

/// The passes.
#[derive(Debug)]
pub struct PhotonPasses {
    settings: PhotonSplatting,
    photons: Photons,
    materials: Materials,
    /// Minimum number of frames in the mean of an image.
    frames: u32,
    directions: PhotonDirections,
    views: KeptLightViews,
    emit: ComputeKernel,
    prepare: ComputeKernel,
    split: ComputeKernel,
    trace: TracePass,
    tiles: ComputeKernel,
    keep: ComputeKernel,
    scan: Scan,
    scatter: ComputeKernel,
    /// None: flux beyond edges is lost.
    land: Option<TracePass>,
    next: ComputeKernel,
    splatting: Splatting,
    smoothing: Smoothing,
    /// The uniform from which light culling reads the number of photons.
    count: wgpu::Buffer,
    /// Maximum number of photons in a chunk.
    most_slots: u32,
}

/// Photon splatting method.
#[derive(Debug)]
enum Splatting {
    /// Photons are rasterized.
    Raster(SplatRaster),
    /// Pixels gather the photons of their lists.
    Gather { culling: LightCulling, gather: ComputeKernel },
}

impl PhotonPasses {
    /// Compiles the passes. `tracer`: the tracer for shadows of the scene's lights, if there are any.
    pub fn new(
        device: &wgpu::Device,
        technique: PhotonSplatting,
        settings: &Settings,
        tracer: Option<Tracer>,
        photons: Photons,
    ) -> Result<Self, RenderError> {
        check(&technique, &settings.structure)?;
        let traced = technique.tracer.fixed().check(device, "`photon-tracer ray-query`", "`photon-tracer bvh`")?;
        let kernel = |file: &str, features: &[Feature], entry: &str| {
            let shader = DECLARED.link(&format!("indirect/photon_splatting/{file}"), features)?;
            let label = format!("indirect/photon_splatting/{file}");
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, &label))
        };
        let structure = &settings.structure;
        let trace_pass = |file: &str| {
            let kernel = kernel(file, &traced.features(structure, true), file)?;
            Ok::<_, RenderError>(TracePass::new(traced, structure, kernel))
        };
        let exact = tracer.unwrap_or(Tracer::BVH).exact();
        let limit = device.limits().max_storage_buffer_binding_size / size_of::<Light>() as u64;
        Ok(Self {
            settings: technique,
            photons,
            materials: settings.materials.model,
            frames: settings.image.accumulate,
            directions: PhotonDirections::new(DeepImageSettings::of(structure).directions)?,
            views: KeptLightViews::default(),
            emit: kernel("emit", &exact.features(structure, true), "emit")?,
            prepare: kernel("prepare", &[], "prepare")?,
            split: kernel("split", &[], "split")?,
            trace: trace_pass("trace")?,
            tiles: kernel("tiles", &[], "find_surfaces")?,
            keep: kernel("keep", &[], "keep")?,
            scan: Scan::new(device, "indirect/photon_splatting")?,
            scatter: kernel("scatter", &[], "scatter")?,
            land: technique.conserved.then(|| trace_pass("land")).transpose()?,
            next: kernel("next", &[], "go_on")?,
            splatting: match technique.splat {
                Splat::Raster => {
                    Splatting::Raster(SplatRaster::new(device, settings.materials.model == Materials::File)?)
                }
                Splat::Gather => Splatting::Gather {
                    culling: LightCulling::new(device, &settings.culling, 1)?,
                    gather: kernel("gather", &[LightCulling::feature(&settings.culling)], "gather")?,
                },
            },
            smoothing: Smoothing::new(device, settings.history)?,
            count: uniform_buffer_of(
                device,
                "indirect/photon_splatting/count",
                &LightCount::new(0, &settings.light_storage()),
            ),
            most_slots: u64::from(technique.chunk).min(limit) as u32,
        })
    }

    /// The view's deep images, if photons are traced through them.
    fn deep_images<'v>(&self, view: &'v ViewContext<'_>) -> Option<&'v DeepImages> {
        let structure: &dyn Any = self.trace.structure(&view.structures)?;
        structure.downcast_ref()
    }

    /// Rotation of the directions in this frame: that of the deep images; other structures trace any direction.
    fn rotation(&self, view: &ViewContext<'_>) -> Quat {
        if self.deep_images(view).is_some() || view.rotation == Quat::IDENTITY {
            return view.rotation;
        }
        frame_rotation(view.view.frame_index)
    }

    fn parameters(&self, view: &ViewContext<'_>, size: UVec2, frames: u32) -> PhotonParameters {
        let views = self.views.views();
        let tiles = size.map(|side| side.div_ceil(TILE));
        PhotonParameters {
            primary_count: views.texels(),
            direction_count: if self.photons == Photons::Split { self.directions.len() } else { 0 },
            frame_index: view.view.random_index,
            radius: self.settings.radius * (frames as f32).powf(-SHRINKING),
            widened: u32::from(self.settings.widened),
            glossy: u32::from(self.materials == Materials::File),
            flux_unit: (views.flux / FLUX_UNITS).max(f32::MIN_POSITIVE),
            columns: tiles.x,
            rows: tiles.y,
            is_first: 1,
            own_directions: u32::from(frames > 1 && self.deep_images(view).is_none()),
            ..Default::default()
        }
    }
}

/// Exponent of the number of frames by which footprints shrink in a mean: noise and blur then fall together.
const SHRINKING: f32 = 0.25;

impl IndirectPasses for PhotonPasses {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<DemodulatedIrradiance, RenderError> {
        let frames = self.frames.max(view.view.frame_index.saturating_add(1));
        self.views.renew(view.scene, self.settings.count, Squares::Any, view.view.random_index);
        let mut parameters = self.parameters(view, surface.size, frames);
        let lit = view.showing(surface);
        let settings = &self.settings;
        let smoothed = Smoothed::new(settings.filter_radius, settings.clamp == IndirectClamp::On, frames);
        let irradiance = PixelIrradiance::new(frame, surface.size, settings.resolution, smoothed)?;
        let mut counters = Counters::new(frame, "indirect/photon_splatting/counters", ROWS, COUNTERS)?;
        counters.adds_up = false;

        // Bindings of every bounce.
        let rotated = self.directions.rotated(self.rotation(view));
        let directions = frame.storage_of("indirect/photon_splatting/directions", &rotated)?;
        let tile_count = parameters.columns * parameters.rows;
        let tiles = frame.scratch("indirect/photon_splatting/tiles", 8 * u64::from(tile_count))?;
        let surfaces = view.buffer.bindings().with(&surface.bindings());
        let uniform = frame.uniform(&parameters);
        let finding = surfaces.clone().part("photons", &uniform).buffer("surface_tiles", &tiles);
        frame.dispatch(&self.tiles, &finding, [parameters.columns, parameters.rows, 1]);

        // Photons from the lights.
        let light_views = self.views.views().record(frame, view.scene, view.view.random_index)?;
        let mut primaries = self.capacity_for_primaries(frame, &parameters)?;
        let scene = view.scene.bindings().with(&view.buffer.bindings());
        let emitting = scene.clone().with(&light_views.bindings()).part("photons", &uniform);
        let emitting = emitting.buffer("primary_photons", &primaries).buffer("photon_counters", counters.buffer());
        frame.dispatch(&self.emit, &emitting, workgroups(parameters.primary_count));

        let chunks = self.deep_images(view).map(|images| images.chunks.iter());
        let texels = chunks.map(|chunks| chunks.map(|chunk| chunk.grid.texels_per_metre).fold(f32::INFINITY, f32::min));
        parameters.least_width = texels.map_or(0.0, |texels| 1.0 / texels);
        let photons = PhotonInputs {
            scene,
            directions: &directions,
            tiles: &tiles,
            counters: &counters,
            lit: &lit,
            irradiance: &irradiance,
            capacity: self.chunk_capacity(frame, &parameters, &irradiance)?,
        };
        for bounce in 0..settings.bounces {
            parameters.bounce = bounce;
            let is_last = bounce + 1 == self.settings.bounces;
            let next = (!is_last).then(|| self.capacity_for_primaries(frame, &parameters)).transpose()?;
            self.scatter(frame, &photons, &mut parameters, &primaries, next.as_ref())?;
            primaries = next.unwrap_or(primaries);
        }
        let layers = self.smoothing.record(frame, view, surface, &irradiance)?;
        Ok(DemodulatedIrradiance::new(layers).with_counters(vec![counters]))
    }
}

/// An error if a number is out of range, or if deep images lack the required triangles.
pub(super) fn check(technique: &PhotonSplatting, structure: &Structure) -> Result<(), RenderError> {
    let wrong = |needed| Err(RenderError::Together { setting: "`indirect photon-splatting`", needed });
    if !(16..=262_144).contains(&technique.count) || !(1..=16).contains(&technique.bounces) {
        return wrong("16 to 262144 photons, and 1 to 16 bounces");
    }
    if !(1024..=4_194_304).contains(&technique.chunk) {
        return wrong("chunks of 1024 to 4194304 photons");
    }
    // NaN is not above 0 either.
    if technique.filter_radius > MOST_RADIUS || technique.radius.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater)
    {
        return wrong("a filter of at most 64 pixels, and a radius above 0");
    }
    if !technique.tracer.fixed().finds_triangles(structure) {
        return wrong("deep images with triangles");
    }
    Ok(())
}
