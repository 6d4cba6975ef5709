//! What the passes of sampled indirect light write beside the pixels' sums.

use glam::UVec2;
use lanternfish_gpu::Frame;

use super::{LightRay, SampledHit};
use crate::{error::RenderError, indirect::Counters};

/// What is counted in every round: `counters.wesl`.
const COUNTERS: &[&str] =
    &["indirect/rays", "indirect/hits", "indirect/shadow_rays", "indirect/emitter_rays", "indirect/lost_cells"];

/// Bytes of what rays met at most: rounds whose rays are more are traced in parts.
const MOST_BYTES: u64 = 96 << 20;

/// What is written for one view of a frame, of so many samples across and down.
#[derive(Debug)]
pub(super) struct Targets {
    /// Rounds that are traced together.
    pub rounds: u32,
    /// What their rays met.
    pub hits: wgpu::Buffer,
    pub light_rays: wgpu::Buffer,
    pub counters: Counters,
}

impl Targets {
    pub fn new(frame: &mut Frame<'_>, samples: UVec2, rounds: u32) -> Result<Self, RenderError> {
        let count = u64::from(samples.x) * u64::from(samples.y);
        let bytes = size_of::<SampledHit>() as u64 * count;
        let together = u32::try_from(MOST_BYTES / bytes.max(1)).unwrap_or(u32::MAX).clamp(1, rounds.max(1));
        Ok(Self {
            rounds: together,
            hits: frame.scratch("indirect/hits", bytes * u64::from(together))?,
            light_rays: frame.scratch("indirect/light_rays", size_of::<LightRay>() as u64 * count)?,
            counters: Counters::new(frame, "indirect/ray_counters", rounds, COUNTERS)?,
        })
    }
}

#[cfg(test)]
#[test]
fn counters_are_the_shaders() {
    let constant = |name| crate::shaders::constant("indirect/sampled/counters", name);
    assert_eq!(constant("RAY_COUNTERS"), COUNTERS.len() as f64);
    assert_eq!(["RAYS", "HITS", "SHADOW_RAYS", "EMITTER_RAYS", "LOST_CELLS"].map(constant), [0.0, 1.0, 2.0, 3.0, 4.0]);
}
