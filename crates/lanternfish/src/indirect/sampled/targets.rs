//! What the passes of sampled indirect light write beside the pixels' sums.

use std::ops::Range;

use glam::UVec2;
use lanternfish_gpu::{Frame, faulty_software};

use super::{LightRay, SampledHit, sample_order::place_count};
use crate::{error::RenderError, indirect::Counters};

/// What is counted in every round: `counters.wesl`.
const COUNTERS: &[&str] = &["indirect/rays", "indirect/hits", "indirect/shadow_rays", "indirect/emitter_rays"];

/// Bytes of what rays met at most, which fits a storage binding: rounds whose rays are more, 8.4 million, are traced in parts.
const MOST_BYTES: u64 = 96 << 20;
/// Rays at most that an invocation traces one after the other: all of `quality good`, and no pass of some 1,000 pixels takes long.
pub(super) const MOST_SAMPLES: u64 = 20;

#[cfg(any(test, feature = "testing"))]
thread_local! {
    /// What stands for [`MOST_SAMPLES`] in tests.
    pub(crate) static MOST_SAMPLES_IN_TESTS: std::cell::Cell<u64> = const { std::cell::Cell::new(MOST_SAMPLES) };
}

/// Rays that an invocation traces at most. Old software drivers end loops early: there one.
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

/// Rounds of each part but the last, where at most so many go together: parts are of one size, or nearly.
pub(super) fn in_parts(rounds: u32, most: u32) -> u32 {
    let parts = rounds.div_ceil(most).max(1);
    rounds.div_ceil(parts).max(1)
}

#[cfg(test)]
#[test]
fn parts_are_of_one_size() {
    let parts = [(20, 16), (20, 12), (12, 16), (20, 9), (1, 1), (0, 1)].map(|(rounds, most)| in_parts(rounds, most));
    assert_eq!(parts, [10, 10, 12, 7, 1, 1]);
}

/// Rounds that are traced together, of so many.
pub(super) fn traced_together(device: &wgpu::Device, samples: UVec2, rounds: u32) -> u32 {
    let bytes = size_of::<SampledHit>() as u64 * u64::from(place_count(samples));
    in_parts(rounds, (MOST_BYTES / bytes.max(1)).clamp(1, most_samples(device)) as u32)
}

/// What is written for one view of a frame, of so many samples across and down.
#[derive(Debug)]
pub(super) struct Targets {
    /// Rounds that are traced together.
    together: u32,
    /// What their rays met.
    pub hits: wgpu::Buffer,
    pub light_rays: wgpu::Buffer,
    pub counters: Counters,
}

impl Targets {
    pub fn new(frame: &mut Frame<'_>, samples: UVec2, rounds: u32) -> Result<Self, RenderError> {
        let count = u64::from(samples.x) * u64::from(samples.y);
        let bytes = size_of::<SampledHit>() as u64 * u64::from(place_count(samples));
        let together = traced_together(frame.device, samples, rounds);
        Ok(Self {
            together,
            hits: frame.scratch("indirect/hits", bytes * u64::from(together))?,
            light_rays: frame.scratch("indirect/light_rays", size_of::<LightRay>() as u64 * count)?,
            counters: Counters::new(frame, "indirect/ray_counters", rounds, COUNTERS)?,
        })
    }

    /// The rounds that are traced with this one, of those in which it is.
    pub fn traced_with(&self, round: u32, among: Range<u32>) -> Range<u32> {
        let first = among.start + (round - among.start) / self.together * self.together;
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
