//! What the passes of sampled indirect light write.

use glam::UVec2;
use lanternfish_gpu::{Bindings, Frame, GpuError, read_back};

use super::{LightRay, SampledHit};
use crate::{error::RenderError, indirect::layers_target};

/// Bytes of a pixel's sums: `PackedSums`.
const SUMS_BYTES: u64 = 48;
/// What is counted in every round: `counters.wesl`.
const COUNTERS: usize = 4;

/// What is written for one view of a frame.
#[derive(Debug)]
pub(super) struct Targets {
    pub hits: wgpu::Buffer,
    pub light_rays: wgpu::Buffer,
    pub sums: wgpu::Buffer,
    pub layers: [wgpu::TextureView; 2],
}

impl Targets {
    /// Those of a picture of this size. `scale`: pixels a sample, along an edge.
    pub fn new(frame: &mut Frame<'_>, size: UVec2, scale: u32) -> Result<Self, RenderError> {
        let samples = size.map(|side| side.div_ceil(scale));
        let count = u64::from(samples.x) * u64::from(samples.y);
        Ok(Self {
            hits: frame.scratch("indirect/hits", size_of::<SampledHit>() as u64 * count)?,
            light_rays: frame.scratch("indirect/light_rays", size_of::<LightRay>() as u64 * count)?,
            sums: frame.scratch("indirect/sums", SUMS_BYTES * count)?,
            layers: [(); 2].map(|()| layers_target(frame, size)),
        })
    }
}

/// How many rays a frame traced, on the device.
#[derive(Clone, Debug)]
pub struct RayCounters {
    counts: wgpu::Buffer,
    rounds: u32,
}

impl RayCounters {
    pub(super) fn new(frame: &mut Frame<'_>, rounds: u32) -> Result<Self, GpuError> {
        let bytes = (4 * COUNTERS) as u64 * u64::from(rounds);
        Ok(Self { counts: frame.zeroed("indirect/ray_counters", bytes)?, rounds })
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
