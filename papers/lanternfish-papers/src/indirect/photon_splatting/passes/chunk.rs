//! Splits, traces and adds up photons, chunk by chunk.

use lanternfish::{
    RenderError, ViewContext,
    common::workgroups,
    denoise::{Counters, smoothing::PixelIrradiance},
    light_culling::Reach,
    lights::{Light, LightSet},
};
use lanternfish_gpu::{Bindings, BufferPart, Frame};

use super::{
    super::parameters::{PhotonHit, PhotonParameters, PrimaryPhoton},
    INDICES, PhotonPasses, Splatting,
};

/// Maximum number of photon lists in a frame.
const MOST_CHUNKS: u32 = 512;

/// Inputs of the passes of one view.
pub(super) struct PhotonInputs<'a> {
    /// Bindings of the scene and the view.
    pub scene: Bindings<'a>,
    pub directions: &'a wgpu::Buffer,
    pub tiles: &'a wgpu::Buffer,
    pub counters: &'a Counters,
    /// The view with this surface.
    pub lit: &'a ViewContext<'a>,
    pub irradiance: &'a PixelIrradiance,
    pub capacity: ChunkCapacity,
}

/// Buffers that all chunks of all bounces of one view share; they run in sequence.
#[derive(Debug)]
pub(super) struct ChunkCapacity {
    /// Maximum number of directions in a chunk; at least one, for any number of photons.
    directions: u32,
    hits: wgpu::Buffer,
    places: wgpu::Buffer,
    lights: wgpu::Buffer,
    /// Render targets of photons, if they are rasterized.
    targets: Option<[wgpu::TextureView; 4]>,
}

impl PhotonPasses {
    pub(super) fn capacity_for_primaries(
        &self,
        frame: &mut Frame<'_>,
        parameters: &PhotonParameters,
    ) -> Result<wgpu::Buffer, RenderError> {
        let bytes = size_of::<PrimaryPhoton>() as u64 * u64::from(parameters.primary_count.max(1));
        Ok(frame.scratch("indirect/photon_splatting/primaries", bytes)?)
    }

    /// Splits photons, and adds up the light of the resulting photons, chunk by chunk. `next`: receives the photons that continue.
    pub(super) fn scatter(
        &mut self,
        frame: &mut Frame<'_>,
        photons: &PhotonInputs<'_>,
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
        // The mirror direction is added; for light from emissive triangles, the photon's own hit point too.
        let has_arrivals = parameters.bounce == 0
            && self.photons == super::Photons::Split
            && photons.lit.scene.has_emissive_triangles();
        let directions = parameters.direction_count + 1 + u32::from(has_arrivals);
        let step = photons.capacity.directions;
        for first in (0..directions).step_by(step as usize) {
            parameters.first_direction = first;
            parameters.chunk_directions = step.min(directions - first);
            parameters.slot_count = parameters.chunk_directions * count;
            let uniform = frame.uniform(parameters);
            self.trace_chunk(frame, photons, parameters, &uniform, primaries);
            self.splat_chunk(frame, photons, parameters, &uniform, primaries)?;
            if let Some(next) = next {
                let going = photons
                    .scene
                    .clone()
                    .part("photons", &uniform)
                    .buffer("split_photons", primaries)
                    .buffer("landed_hits", &photons.capacity.hits)
                    .buffer("next_photons", next);
                frame.dispatch(&self.next, &going, workgroups(count));
            }
            parameters.is_first = 0;
        }
        Ok(())
    }

    /// Traces the photons of a chunk to their hits.
    fn trace_chunk(
        &self,
        frame: &mut Frame<'_>,
        photons: &PhotonInputs<'_>,
        parameters: &PhotonParameters,
        uniform: &BufferPart,
        primaries: &wgpu::Buffer,
    ) {
        let tracing = photons
            .scene
            .clone()
            .part("photons", uniform)
            .buffer("split_photons", primaries)
            .buffer("photon_hits", &photons.capacity.hits);
        let splitting = tracing.clone().buffer("photon_directions", photons.directions);
        frame.dispatch(&self.split, &splitting, workgroups(parameters.slot_count));
        self.trace.dispatch(frame, &photons.lit.structures, &tracing, workgroups(parameters.slot_count));
    }

    /// Adds their light to the pixels.
    fn splat_chunk(
        &mut self,
        frame: &mut Frame<'_>,
        photons: &PhotonInputs<'_>,
        parameters: &PhotonParameters,
        uniform: &BufferPart,
        primaries: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        let slots = parameters.slot_count;
        let ChunkCapacity { hits, places, lights, .. } = &photons.capacity;
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
            .buffer("photon_places", places)
            .buffer("photon_counters", photons.counters.buffer());
        frame.dispatch(&self.keep, &keeping, workgroups(slots + 1));
        let total = self.scan.record(frame, places, slots + 1)?;
        let placing = footprints.buffer("places", places).buffer("placed_photons", lights);
        frame.dispatch(&self.scatter, &placing, workgroups(slots));
        frame.encoder().copy_buffer_to_buffer(&total, 0, &self.count, 0, 4);
        if let Some(land) = &self.land {
            let landing = photons.scene.clone().part("photons", uniform).buffer("landed_photons", lights);
            let landing = landing.buffer("light_count", &self.count);
            land.dispatch(frame, &photons.lit.structures, &landing, workgroups(slots));
        }
        let set = LightSet {
            lights: lights.clone(),
            count: self.count.clone(),
            counted: Some(total),
            on_host: [].into(),
            capacity: slots,
            bounds: *photons.lit.scene.bounds(),
            list: INDICES,
            remedy: Some("choose a smaller `photon-chunk`"),
        };
        let irradiance = photons.irradiance;
        let surface = photons.lit.surface.bindings();
        let gathering = photons.scene.clone().with(&surface).with(&irradiance.bindings()).with(&set.bindings());
        let gathering = gathering.part("photons", uniform).buffer("pixel_irradiance", &irradiance.irradiance);
        match &mut self.splatting {
            Splatting::Raster(raster) => {
                raster.record(frame, &gathering, slots, irradiance, photons.capacity.targets.as_ref())
            }
            Splatting::Gather { culling, gather } => {
                let lists = culling.record(frame, std::slice::from_ref(photons.lit), Reach::Surface, &set)?.remove(0);
                let [width, height, _] = gather.workgroup_size();
                let groups = [irradiance.size.x.div_ceil(width), irradiance.size.y.div_ceil(height), 1];
                frame.dispatch(gather, &gathering.with(&lists.bindings()), groups);
            }
        }
        Ok(())
    }
}

impl PhotonPasses {
    /// Capacity for chunks of the photons that are split; an error if there are too many.
    pub(super) fn chunk_capacity(
        &self,
        frame: &mut Frame<'_>,
        parameters: &PhotonParameters,
        irradiance: &PixelIrradiance,
    ) -> Result<ChunkCapacity, RenderError> {
        let count = parameters.primary_count.max(1);
        let most = parameters.direction_count + 2;
        let directions = (self.most_slots / count).clamp(1, most);
        if most.div_ceil(directions) * self.settings.bounces > MOST_CHUNKS {
            let setting = "`indirect photon-splatting`";
            return Err(RenderError::Together {
                setting,
                needed: "a larger `photon-chunk`, or fewer `photon-bounces`",
            });
        }
        let slots = u64::from(directions) * u64::from(count);
        Ok(ChunkCapacity {
            directions,
            hits: frame.scratch("indirect/photon_splatting/hits", size_of::<PhotonHit>() as u64 * slots)?,
            places: frame.scratch("indirect/photon_splatting/places", 4 * (slots + 1))?,
            lights: frame.scratch("indirect/photon_splatting/photons", size_of::<Light>() as u64 * slots)?,
            targets: match &self.splatting {
                Splatting::Raster(raster) => Some(raster.targets(frame, irradiance)),
                Splatting::Gather { .. } => None,
            },
        })
    }
}
