//! Settings that the renderer recommends.

use super::Settings;
use crate::indirect::{Indirect, Quality};

impl Default for Settings {
    fn default() -> Self {
        Self::of_quality(Quality::default())
    }
}

impl Settings {
    /// The recommended settings at this level of effort for indirect light and edges: `lanternfish render --quality`. `Settings::default()`
    /// equals [`Quality::Good`].
    pub fn of_quality(quality: Quality) -> Self {
        Self { indirect: Indirect::preset(quality), samples: quality.samples(), ..Self::direct_light() }
    }
}
