//! CPU reference of `meter.wesl`.

use crate::settings::Exposure;

const BIN_COUNT: usize = 512;
const BIN_SHIFT: u32 = 20;
const FIRST_BIN: u32 = 760;
const SURFACE_WEIGHT: f32 = 8.0;
const HIGHLIGHT_FRACTION: f32 = 0.05;
const MIDDLE: f32 = 0.25;
const STEPS_A_STOP: f32 = 8.0;

/// The constants by the shader's names.
#[cfg(test)]
pub(super) const CONSTANTS: [(&str, f64); 7] = [
    ("BIN_COUNT", BIN_COUNT as f64),
    ("BIN_SHIFT", BIN_SHIFT as f64),
    ("FIRST_BIN", FIRST_BIN as f64),
    ("SURFACE_WEIGHT", SURFACE_WEIGHT as f64),
    ("HIGHLIGHT_FRACTION", HIGHLIGHT_FRACTION as f64),
    ("MIDDLE", MIDDLE as f64),
    ("STEPS_A_STOP", STEPS_A_STOP as f64),
];

impl Exposure {
    /// The exposure of an image, EV, from linear radiance, nits, and the coverage of surfaces.
    pub fn of(self, pixels: impl IntoIterator<Item = [f32; 4]>) -> f32 {
        match self {
            Self::Auto => metered_exposure(pixels),
            Self::Ev(ev) => ev,
        }
    }
}

/// The exposure, EV, that [`crate::settings::Exposure::Auto`] gives images that are displayed together, from linear
/// radiance, nits, and the coverage of surfaces (0 to 1). The order of the pixels does not matter.
///
/// A multiple of 1/8 between −34 and 30; 0 if every pixel is black.
pub(super) fn metered_exposure(pixels: impl IntoIterator<Item = [f32; 4]>) -> f32 {
    let mut weights = vec![0_u64; BIN_COUNT];
    for [red, green, blue, alpha] in pixels {
        let bits = (0.2126 * red + 0.7152 * green + 0.0722 * blue).to_bits();
        if bits >= f32::INFINITY.to_bits() || (bits >> BIN_SHIFT) < FIRST_BIN {
            continue;
        }
        let bin = ((bits >> BIN_SHIFT) - FIRST_BIN).min(BIN_COUNT as u32 - 1);
        let weight = 1.0 + (SURFACE_WEIGHT - 1.0) * alpha.clamp(0.0, 1.0);
        weights[bin as usize] += weight.round_ties_even() as u64;
    }
    let total = weights.iter().sum::<u64>() as f32;
    if total == 0.0 {
        return 0.0;
    }
    let above = HIGHLIGHT_FRACTION * total;
    let (mut highlight, mut passed) = (0.0, 0.0);
    for (bin, weight) in weights.iter().map(|weight| *weight as f32).enumerate().rev() {
        if passed + weight > above {
            highlight = luminance_in_bin(bin, 1.0 - (above - passed) / weight);
            break;
        }
        passed += weight;
    }
    let fraction = |(bin, weight): (usize, &u64)| *weight as f32 / total * luminance_in_bin(bin, 0.5).min(highlight);
    let mean = weights.iter().enumerate().map(fraction).sum::<f32>();
    (STEPS_A_STOP * (MIDDLE / mean).min(1.0 / highlight).log2()).round_ties_even() / STEPS_A_STOP + 0.0
}

/// Luminance at a fraction of a bin's width.
fn luminance_in_bin(bin: usize, fraction: f32) -> f32 {
    let edge = |bin: u32| f32::from_bits((FIRST_BIN + bin) << BIN_SHIFT);
    let (low, high) = (edge(bin as u32), edge(bin as u32 + 1));
    low + fraction * (high - low)
}
