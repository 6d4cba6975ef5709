//! Buffers that the passes of sampled indirect light write, beside the pixels' sums.

use std::ops::Range;

use glam::UVec2;
use lanternfish_gpu::{Frame, faulty_software};

use super::{LightRay, SampledHit, sample_order::place_count};
use crate::{denoise::Counters, error::RenderError};

/// Counters of every sample index: `counters.wesl`.
const COUNTERS: &[&str] = &["indirect/rays", "indirect/hits", "indirect/shadow_rays", "indirect/emitter_rays"];

/// Largest buffer of hits, bytes, which fits a storage binding: more than 8.4 million rays are traced in parts.
const MOST_BYTES: u64 = 96 << 20;
/// Most rays that an invocation traces in sequence: all of `quality good`, while no pass of some 1,000 pixels takes long.
pub(super) const MOST_SAMPLES: u64 = 20;

#[cfg(any(test, feature = "testing"))]
thread_local! {
    /// Replaces [`MOST_SAMPLES`] in tests.
    pub(crate) static MOST_SAMPLES_IN_TESTS: std::cell::Cell<u64> = const { std::cell::Cell::new(MOST_SAMPLES) };
}

/// Most rays that an invocation traces. One on old software drivers, which end loops early.
fn most_samples(device: &wgpu::Device) -> u64 {
    if faulty_software(&device.adapter_info()) {
        return 1;
    }
    #[cfg(any(test, feature = "testing"))]
    let most = MOST_SAMPLES_IN_TESTS.get();
    #[cfg(not(any(test, feature = "testing")))]
    let most = MOST_SAMPLES;
    most
}

/// Size of all parts but the last, for parts of at most `most`: parts are of equal or nearly equal size.
pub(super) fn in_parts(sample_count: u32, most: u32) -> u32 {
    let parts = sample_count.div_ceil(most).max(1);
    sample_count.div_ceil(parts).max(1)
}

#[cfg(test)]
#[test]
fn parts_have_nearly_equal_sizes() {
    let parts = [(20, 16), (20, 12), (12, 16), (20, 9), (1, 1), (0, 1)]
        .map(|(sample_count, most)| in_parts(sample_count, most));
    assert_eq!(parts, [10, 10, 12, 7, 1, 1]);
}

/// Number of sample indices that are traced together, of `sample_count`.
pub(super) fn traced_together(device: &wgpu::Device, size: UVec2, sample_count: u32) -> u32 {
    let bytes = size_of::<SampledHit>() as u64 * u64::from(place_count(size));
    in_parts(sample_count, (MOST_BYTES / bytes.max(1)).clamp(1, most_samples(device)) as u32)
}

/// Buffers of one view of a frame.
#[derive(Debug)]
pub(super) struct Targets {
    /// Number of sample indices that are traced together.
    together: u32,
    /// Hits of their rays.
    pub hits: wgpu::Buffer,
    /// Number of sample indices whose hits are shaded together.
    pub shaded_together: u32,
    pub light_rays: wgpu::Buffer,
    pub counters: Counters,
}

impl Targets {
    /// `shades_many`: the hits of many sample indices are shaded together.
    pub fn new(frame: &mut Frame<'_>, size: UVec2, sample_count: u32, shades_many: bool) -> Result<Self, RenderError> {
        let light_ray_bytes = size_of::<LightRay>() as u64 * u64::from(size.x) * u64::from(size.y);
        let bytes = size_of::<SampledHit>() as u64 * u64::from(place_count(size));
        let together = traced_together(frame.device, size, sample_count);
        let most_shaded = if shades_many { (MOST_BYTES / light_ray_bytes.max(1)).clamp(1, together.into()) } else { 1 };
        let shaded_together = in_parts(together, most_shaded as u32);
        Ok(Self {
            together,
            shaded_together,
            hits: frame.scratch("indirect/hits", bytes * u64::from(together))?,
            light_rays: frame.scratch("indirect/light_rays", light_ray_bytes * u64::from(shaded_together))?,
            counters: Counters::new(frame, "indirect/ray_counters", sample_count, COUNTERS)?,
        })
    }

    /// The sample indices of the range `among` that are traced together with this one.
    pub fn traced_with(&self, sample_index: u32, among: Range<u32>) -> Range<u32> {
        let first = among.start + (sample_index - among.start) / self.together * self.together;
        first..(first + self.together).min(among.end)
    }
}

#[cfg(test)]
#[test]
fn counters_are_the_shaders() {
    let constant = |name| crate::shaders::constant("indirect/sampled/counters", name);
    assert_eq!(constant("RAY_COUNTERS"), COUNTERS.len() as f64);
    assert_eq!(["RAYS", "HITS", "SHADOW_RAYS", "EMITTER_RAYS"].map(constant), [0.0, 1.0, 2.0, 3.0]);
}
