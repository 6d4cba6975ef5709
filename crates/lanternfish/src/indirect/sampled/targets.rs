//! What the passes of sampled indirect light write.

use std::collections::HashMap;

use glam::UVec2;
use lanternfish_gpu::{Bindings, GpuError, read_back, storage_buffer};

use super::{LightRay, SampledHit};
use crate::{error::RenderError, prepass::Surface};

/// Bytes of a pixel's sums: `PackedSums`.
const SUMS_BYTES: u64 = 48;
/// Of the sums: diffuse and glossy, each at normal and at grazing incidence.
const LAYERS: u32 = 4;
/// What is counted in every round: `counters.wesl`.
const COUNTERS: usize = 4;

/// What is written for one view of a frame.
#[derive(Debug)]
pub(super) struct Targets {
    size: UVec2,
    pub hits: wgpu::Buffer,
    pub light_rays: wgpu::Buffer,
    pub sums: wgpu::Buffer,
    pub layers: [wgpu::TextureView; 2],
}

impl Targets {
    /// Makes those of a view's slot, where they are not there yet. `scale`: pixels a sample, along an edge.
    pub fn fit(
        all: &mut HashMap<usize, Self>,
        device: &wgpu::Device,
        surface: &Surface,
        scale: u32,
    ) -> Result<(), RenderError> {
        let (size, slot) = (surface.size, surface.slot);
        if all.get(&slot).is_some_and(|targets| targets.size == size) {
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
        let targets = Self {
            size,
            hits: storage_buffer(device, "indirect/hits", size_of::<SampledHit>() as u64 * count)?,
            light_rays: storage_buffer(device, "indirect/light_rays", size_of::<LightRay>() as u64 * count)?,
            sums: storage_buffer(device, "indirect/sums", SUMS_BYTES * count)?,
            layers: [layers(), layers()],
        };
        all.insert(slot, targets);
        Ok(())
    }
}

/// How many rays a frame traced, on the device.
#[derive(Clone, Debug)]
pub struct RayCounters {
    counts: wgpu::Buffer,
    rounds: u32,
}

impl RayCounters {
    pub(super) fn new(device: &wgpu::Device, rounds: u32) -> Result<Self, GpuError> {
        let bytes = (4 * COUNTERS) as u64 * u64::from(rounds);
        Ok(Self { counts: storage_buffer(device, "indirect/ray_counters", bytes)?, rounds })
    }

    pub(super) fn bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("ray_counters", &self.counts)
    }

    /// Name and count of each, once the frame was handed to the device.
    pub(crate) fn read(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<[(&'static str, u64); COUNTERS], GpuError> {
        let rows = read_back::<[u32; COUNTERS]>(device, queue, &self.counts, self.rounds as usize)?;
        let sum = |column: usize| rows.iter().map(|row| u64::from(row[column])).sum();
        Ok([
            ("indirect/rays", sum(0)),
            ("indirect/hits", sum(1)),
            ("indirect/shadow_rays", sum(2)),
            ("indirect/emitter_rays", sum(3)),
        ])
    }
}

#[cfg(test)]
#[test]
fn counters_are_the_shaders() {
    let constant = |name| crate::shaders::constant("indirect/sampled/counters", name);
    assert_eq!(constant("RAY_COUNTERS"), COUNTERS as f64);
    assert_eq!(["RAYS", "HITS", "SHADOW_RAYS", "EMITTER_RAYS"].map(constant), [0.0, 1.0, 2.0, 3.0]);
}
