//! Occlusion by the directions of deep images, and in screen space.

pub mod deep;
pub mod hbao;
#[cfg(test)]
mod tests;

use lanternfish::technique::{ParameterInfo, Range};

/// The parameter that both techniques share.
const DISTANCE: ParameterInfo = ParameterInfo::new(
    "occlusion-distance",
    "METRES",
    Range::Positive,
    "Largest distance of occluders, m. Higher: darker. Without it: with `occlusion deep` everything occludes, \
     however far; with hbao 1 m",
);
