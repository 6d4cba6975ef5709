//! The passes of photon splatting, and the order in which they run.

use glam::{Quat, UVec2};
use lanternfish_gpu::{Bindings, BufferPart, ComputeKernel, Feature, Frame, primitives::Scan, uniform_buffer_of};

use super::{
    PhotonSplatting, Splat,
    directions::PhotonDirections,
    parameters::{PhotonHit, PhotonParameters, PrimaryPhoton},
    raster::SplatRaster,
};
use crate::{
    context::ViewContext,
    deep_images::{DeepImages, directions::rotation_of_turn, workgroups},
    error::RenderError,
    indirect::{
        Counters, IndirectPasses, IndirectSums,
        light_views::{KeptLightViews, radius_of},
        smoothing::{MOST_RADIUS, PixelSums, Smoothing},
    },
    light_culling::{LightCulling, Reach},
    lights::{Light, LightSet},
    prepass::Surface,
    rays::{self, Tracer},
    settings::{DeepImageSettings, Materials, Samples, Settings},
    shaders::SHADERS,
};

/// Name of the lists of photons' indices.
const INDICES: &str = "indirect/photon_indices";

/// What is counted: the constants of `counters.wesl`. Flux is in 1/2²⁸ of the lights' flux.
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

/// Units of flux that all lights have.
pub(super) const FLUX_UNITS: f32 = 268_435_456.0;
/// Edge of a tile that photons are looked for in: `tiles.wesl`.
pub(super) const TILE: u32 = 16;
/// The passes.
#[derive(Debug)]
pub struct PhotonPasses {
    settings: PhotonSplatting,
    materials: Materials,
    /// Frames that a picture is the mean of, at least.
    frames: u32,
    directions: PhotonDirections,
    views: KeptLightViews,
    emit: ComputeKernel,
    prepare: ComputeKernel,
    split: ComputeKernel,
    trace: ComputeKernel,
    tiles: ComputeKernel,
    keep: ComputeKernel,
    scan: Scan,
    place: ComputeKernel,
    /// None: what lies beyond edges is lost.
    land: Option<ComputeKernel>,
    next: ComputeKernel,
    splatting: Splatting,
    smoothing: Smoothing,
    /// The uniform that light culling reads the number of photons from.
    count: wgpu::Buffer,
    /// Photons of a chunk at most.
    most_slots: u32,
}

/// How photons come to pixels.
#[derive(Debug)]
enum Splatting {
    /// They are drawn.
    Raster(SplatRaster),
    /// Pixels add them up.
    Gather { culling: LightCulling, gather: ComputeKernel },
}

impl PhotonPasses {
    /// Compiles the passes. `tracer`: what shadows of the scene's lights are traced through, if there are any.
    pub fn new(
        device: &wgpu::Device,
        room: PhotonSplatting,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Self, RenderError> {
        check(&room, &settings.deep_images)?;
        let traced = room.tracer.check(device, "`photon-tracer ray-query`", "`photon-tracer bvh`")?;
        let kernel = |file: &str, features: &[Feature], entry: &str| {
            let shader = SHADERS.link(&format!("indirect/photon_splatting/{file}"), features)?;
            let label = format!("indirect/photon_splatting/{file}");
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, &label))
        };
        let images = &settings.deep_images;
        let exact = tracer.unwrap_or(Tracer::Bvh).exact();
        let limit = device.limits().max_storage_buffer_binding_size / size_of::<Light>() as u64;
        Ok(Self {
            settings: room,
            materials: settings.materials,
            frames: settings.accumulate,
            directions: PhotonDirections::new(images.directions)?,
            views: KeptLightViews::default(),
            emit: kernel("emit", &exact.features(images), "emit")?,
            prepare: kernel("prepare", &[], "prepare")?,
            split: kernel("split", &[], "split")?,
            trace: kernel("trace", &traced.features(images), "trace")?,
            tiles: kernel("tiles", &[], "find_surfaces")?,
            keep: kernel("keep", &[], "keep")?,
            scan: Scan::new(device, "indirect/photon_splatting")?,
            place: kernel("place", &[], "place")?,
            land: room.conserved.then(|| kernel("land", &traced.features(images), "land")).transpose()?,
            next: kernel("next", &[], "go_on")?,
            splatting: match room.splat {
                Splat::Raster => Splatting::Raster(SplatRaster::new(device, settings.materials == Materials::File)?),
                Splat::Gather => Splatting::Gather {
                    culling: LightCulling::new(device, settings.culling, Samples::One)?,
                    gather: kernel("gather", &[LightCulling::feature(settings.culling)], "gather")?,
                },
            },
            smoothing: Smoothing::new(device)?,
            count: uniform_buffer_of(device, "indirect/photon_splatting/count", &[0u32; 4]),
            most_slots: u64::from(room.chunk).min(limit) as u32,
        })
    }

    /// How the directions are turned in this frame: as deep images are; other structures answer for any direction.
    fn rotation(&self, view: &ViewContext<'_>) -> Quat {
        if self.settings.tracer.uses_deep_images() || view.rotation == Quat::IDENTITY {
            return view.rotation;
        }
        rotation_of_turn(view.view.frame_index)
    }

    fn parameters(&self, view: &ViewContext<'_>, size: UVec2, frames: u32) -> PhotonParameters {
        let views = self.views.views();
        let tiles = size.map(|side| side.div_ceil(TILE));
        PhotonParameters {
            scene_radius: radius_of(&view.scene.bounds),
            primary_count: views.texels(),
            direction_count: self.directions.len(),
            frame_index: view.view.frame_index,
            radius: self.settings.radius * (frames as f32).powf(-SHRINKING),
            widened: u32::from(self.settings.widened),
            glossy: u32::from(self.materials == Materials::File),
            flux_unit: (views.flux / FLUX_UNITS).max(f32::MIN_POSITIVE),
            columns: tiles.x,
            rows: tiles.y,
            is_first: 1,
            ..Default::default()
        }
    }
}

/// Power of the number of frames that footprints shrink by in a mean: as much as keeps noise and blur falling together.
const SHRINKING: f32 = 0.25;

/// What the passes of one view read.
struct Photons<'a> {
    images: Option<&'a DeepImages>,
    /// Of the scene and the view.
    scene: Bindings<'a>,
    directions: &'a wgpu::Buffer,
    tiles: &'a wgpu::Buffer,
    counters: &'a Counters,
    /// The view, of this surface.
    lit: &'a ViewContext<'a>,
    sums: &'a PixelSums,
}

impl IndirectPasses for PhotonPasses {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
        images: Option<&DeepImages>,
    ) -> Result<IndirectSums, RenderError> {
        let frames = self.frames.max(view.view.frame_index.saturating_add(1));
        self.views.renew(view.scene, self.settings.count, view.view.frame_index);
        let mut parameters = self.parameters(view, surface.size, frames);
        let lit = view.showing(surface);
        let settings = &self.settings;
        let sums =
            PixelSums::new(frame, surface.size, settings.resolution, settings.filter_radius, settings.clamp, frames)?;
        let mut counters = Counters::new(frame, "indirect/photon_splatting/counters", 1, COUNTERS)?;
        counters.adds_up = false;

        // What every bounce reads.
        let turned = self.directions.turned(self.rotation(view));
        let directions = frame.storage_of("indirect/photon_splatting/directions", &turned)?;
        let tile_count = parameters.columns * parameters.rows;
        let tiles = frame.scratch("indirect/photon_splatting/tiles", 8 * u64::from(tile_count))?;
        let surfaces = view.buffer.bindings().with(&surface.bindings());
        let uniform = frame.uniform(&parameters);
        let finding = surfaces.clone().part("photons", &uniform).buffer("surface_tiles", &tiles);
        frame.dispatch(&self.tiles, &finding, [parameters.columns, parameters.rows, 1]);

        // Photons from the lights.
        let light_views = self.views.views().record(frame, view.scene, view.view.frame_index)?;
        let mut primaries = self.room_for_primaries(frame, &parameters)?;
        let scene = view.scene.bindings().with(&view.buffer.bindings());
        let emitting = scene.clone().with(&light_views.bindings()).part("photons", &uniform);
        let emitting = emitting.buffer("primary_photons", &primaries).buffer("photon_counters", counters.buffer());
        frame.dispatch(&self.emit, &emitting, workgroups(parameters.primary_count));

        let images = images.filter(|_| settings.tracer.uses_deep_images());
        let texels = images.and_then(|images| images.chunks.first()).map(|chunk| chunk.grid.texels_per_metre);
        parameters.least_width = texels.map_or(0.0, |texels| 1.0 / texels);
        let photons = Photons {
            images,
            scene,
            directions: &directions,
            tiles: &tiles,
            counters: &counters,
            lit: &lit,
            sums: &sums,
        };
        for bounce in 0..settings.bounces {
            parameters.bounce = bounce;
            let is_last = bounce + 1 == self.settings.bounces;
            let next = (!is_last).then(|| self.room_for_primaries(frame, &parameters)).transpose()?;
            self.scatter(frame, &photons, &mut parameters, &primaries, next.as_ref())?;
            primaries = next.unwrap_or(primaries);
        }
        let layers = self.smoothing.record(frame, &surfaces, &sums);
        Ok(IndirectSums { layers, counters: Some(counters) })
    }
}

impl PhotonPasses {
    fn room_for_primaries(
        &self,
        frame: &mut Frame<'_>,
        parameters: &PhotonParameters,
    ) -> Result<wgpu::Buffer, RenderError> {
        let bytes = size_of::<PrimaryPhoton>() as u64 * u64::from(parameters.primary_count.max(1));
        Ok(frame.scratch("indirect/photon_splatting/primaries", bytes)?)
    }

    /// Splits photons, and adds up the light of what they were split into, chunk by chunk. `next`: where those that go on are put.
    fn scatter(
        &mut self,
        frame: &mut Frame<'_>,
        photons: &Photons<'_>,
        parameters: &mut PhotonParameters,
        primaries: &wgpu::Buffer,
        next: Option<&wgpu::Buffer>,
    ) -> Result<(), RenderError> {
        let count = parameters.primary_count;
        let uniform = frame.uniform(parameters);
        let preparing = Bindings::new()
            .part("photons", &uniform)
            .buffer("primary_photons", primaries)
            .buffer("photon_directions", photons.directions)
            .buffer("photon_counters", photons.counters.buffer());
        frame.dispatch(&self.prepare, &preparing, workgroups(count));
        // And the mirror direction; and, of light from emissive triangles, where it arrived.
        let has_arrivals = parameters.bounce == 0 && photons.lit.scene.has_emissive_triangles();
        let directions = parameters.direction_count + 1 + u32::from(has_arrivals);
        let step = (self.most_slots / count.max(1)).clamp(1, directions);
        for first in (0..directions).step_by(step as usize) {
            parameters.first_direction = first;
            parameters.chunk_directions = step.min(directions - first);
            parameters.slot_count = parameters.chunk_directions * count;
            let uniform = frame.uniform(parameters);
            let hits = self.trace_chunk(frame, photons, parameters, &uniform, primaries)?;
            self.splat_chunk(frame, photons, parameters, &uniform, primaries, &hits)?;
            if let Some(next) = next {
                let going = photons
                    .scene
                    .clone()
                    .part("photons", &uniform)
                    .buffer("split_photons", primaries)
                    .buffer("landed_hits", &hits)
                    .buffer("next_photons", next);
                frame.dispatch(&self.next, &going, workgroups(count));
            }
            parameters.is_first = 0;
        }
        Ok(())
    }

    /// Where the photons of a chunk come to.
    fn trace_chunk(
        &self,
        frame: &mut Frame<'_>,
        photons: &Photons<'_>,
        parameters: &PhotonParameters,
        uniform: &BufferPart,
        primaries: &wgpu::Buffer,
    ) -> Result<wgpu::Buffer, RenderError> {
        let bytes = size_of::<PhotonHit>() as u64 * u64::from(parameters.slot_count.max(1));
        let hits = frame.scratch("indirect/photon_splatting/hits", bytes)?;
        let tracing = photons
            .scene
            .clone()
            .part("photons", uniform)
            .buffer("split_photons", primaries)
            .buffer("photon_hits", &hits);
        let splitting = tracing.clone().buffer("photon_directions", photons.directions);
        frame.dispatch(&self.split, &splitting, workgroups(parameters.slot_count));
        rays::dispatch(frame, &self.trace, &tracing, workgroups(parameters.slot_count), photons.images);
        Ok(hits)
    }

    /// Adds their light to the pixels.
    fn splat_chunk(
        &mut self,
        frame: &mut Frame<'_>,
        photons: &Photons<'_>,
        parameters: &PhotonParameters,
        uniform: &BufferPart,
        primaries: &wgpu::Buffer,
        hits: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        let slots = parameters.slot_count;
        let places = frame.scratch("indirect/photon_splatting/places", 4 * (u64::from(slots) + 1))?;
        let footprints = photons
            .scene
            .clone()
            .part("photons", uniform)
            .buffer("split_photons", primaries)
            .buffer("photon_directions", photons.directions)
            .buffer("landed_hits", hits);
        let keeping = footprints
            .clone()
            .buffer("seen_tiles", photons.tiles)
            .buffer("photon_places", &places)
            .buffer("photon_counters", photons.counters.buffer());
        frame.dispatch(&self.keep, &keeping, workgroups(slots + 1));
        let total = self.scan.record(frame, &places, slots + 1)?;
        let bytes = size_of::<Light>() as u64 * u64::from(slots.max(1));
        let lights = frame.scratch("indirect/photon_splatting/photons", bytes)?;
        let placing = footprints.buffer("places", &places).buffer("placed_photons", &lights);
        frame.dispatch(&self.place, &placing, workgroups(slots));
        frame.encoder().copy_buffer_to_buffer(&total, 0, &self.count, 0, 4);
        if let Some(land) = &self.land {
            let landing = photons.scene.clone().part("photons", uniform).buffer("landed_photons", &lights);
            let landing = landing.buffer("light_count", &self.count);
            rays::dispatch(frame, land, &landing, workgroups(slots), photons.images);
        }
        let set = LightSet {
            lights,
            count: self.count.clone(),
            counted: Some(total),
            on_host: [].into(),
            capacity: slots,
            bounds: photons.lit.scene.bounds,
            list: INDICES,
            remedy: Some("choose a smaller `photon-count` or `photon-radius`"),
        };
        let sums = photons.sums;
        let surface = photons.lit.surface.bindings();
        let gathering = photons.scene.clone().with(&surface).with(&sums.bindings()).with(&set.bindings());
        let gathering = gathering.part("photons", uniform).buffer("pixel_sums", &sums.sums);
        match &mut self.splatting {
            Splatting::Raster(raster) => raster.record(frame, &gathering, slots, sums),
            Splatting::Gather { culling, gather } => {
                let lists = culling.record(frame, std::slice::from_ref(photons.lit), Reach::Surface, &set)?.remove(0);
                let [width, height, _] = gather.workgroup_size();
                let groups = [sums.size.x.div_ceil(width), sums.size.y.div_ceil(height), 1];
                frame.dispatch(gather, &gathering.with(&lists.bindings()), groups);
            }
        }
        Ok(())
    }
}

/// An error where a number is out of range, or deep images lack the triangles that are needed.
pub(super) fn check(room: &PhotonSplatting, images: &DeepImageSettings) -> Result<(), RenderError> {
    let wrong = |needed| Err(RenderError::Together { setting: "`indirect photon-splatting`", needed });
    if !(1..=262_144).contains(&room.count) || !(1..=16).contains(&room.bounces) {
        return wrong("1 to 262144 photons, and 1 to 16 bounces");
    }
    if !(1024..=4_194_304).contains(&room.chunk) {
        return wrong("1024 to 4194304 photons in hand at a time");
    }
    // What is no number is not above 0 either.
    if room.filter_radius > MOST_RADIUS || room.radius.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
        return wrong("a filter of at most 64 pixels, and a radius above 0");
    }
    if room.tracer.uses_deep_images() && !images.payload {
        return wrong("deep images with triangles");
    }
    Ok(())
}
