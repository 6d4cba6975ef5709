//! Settings that the renderer recommends.

use super::Settings;
use crate::indirect::Quality;

impl Default for Settings {
    fn default() -> Self {
        Self::of_quality(Quality::default())
    }
}

impl Settings {
    /// What the renderer recommends, with this much spent on indirect light and on edges: `lanternfish render --quality`. `Settings::default()`
    /// is that of [`Quality::Good`].
    pub fn of_quality(quality: Quality) -> Self {
        Self { indirect: quality.sampled().into(), samples: quality.samples(), ..Self::direct_light() }
    }
}
