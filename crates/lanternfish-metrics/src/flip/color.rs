//! Opponent colour space and colour difference of ꟻLIP.

use rayon::prelude::*;

use crate::RgbImage;

/// X/Xₙ, Y/Yₙ, Z/Zₙ from linear sRGB: white is 1, 1, 1.
///
/// Made from Rec. 709's primaries and the white point (0.95043, 1, 1.08890) of the authors' evaluator; each row sums to 1.
const XYZ_FROM_RGB: [[f32; 3]; 3] = [
    [0.433_895_4, 0.376_242_37, 0.189_862_24],
    [0.212_636_82, 0.715_183, 0.072_180_2],
    [0.017_752_424, 0.109_465_63, 0.872_781_95],
];

const RGB_FROM_XYZ: [[f32; 3]; 3] = [
    [3.080_342, -1.537_399, -0.542_943],
    [-0.921_178_4, 1.875_93, 0.045_248_41],
    [0.052_881_293, -0.204_011_2, 1.151_13],
];

/// An image in the opponent colour space YCxCz, one plane per channel. The eye's contrast sensitivity was measured for these channels.
pub(super) struct Opponent {
    pub(super) width: usize,
    /// Y: 1 for white, 0 for black.
    pub(super) luminance: Vec<f32>,
    /// X/Xₙ − Y/Yₙ, which is Cx / 500.
    pub(super) red_green: Vec<f32>,
    /// Y/Yₙ − Z/Zₙ, which is Cz / 200.
    pub(super) blue_yellow: Vec<f32>,
}

impl Opponent {
    /// The opponent planes of an image. `linear` converts the image's values to linear display colours, 0..=1. The image must not
    /// be empty.
    ///
    /// In ꟻLIP Y is 116 Y/Yₙ − 16, Cx is 500 (X/Xₙ − Y/Yₙ) and Cz is 200 (Y/Yₙ − Z/Zₙ). All filters are linear and
    /// either preserve or remove a constant. Scale and offset are therefore left to [`lab_from_opponent`].
    pub(super) fn new(image: &RgbImage, linear: impl Fn([f32; 3]) -> [f32; 3] + Sync) -> Self {
        let width = image.width;
        let plane = || vec![0.0; image.pixels.len()];
        let mut rendering = Self { width, luminance: plane(), red_green: plane(), blue_yellow: plane() };
        let rows = image.pixels.par_chunks(width).zip(rendering.luminance.par_chunks_mut(width));
        let rows = rows.zip(rendering.red_green.par_chunks_mut(width)).zip(rendering.blue_yellow.par_chunks_mut(width));
        rows.for_each(|(((pixels, luminance), red_green), blue_yellow)| {
            for (i, pixel) in pixels.iter().enumerate() {
                let [x, y, z] = transformed(&XYZ_FROM_RGB, linear(*pixel));
                luminance[i] = y;
                red_green[i] = x - y;
                blue_yellow[i] = y - z;
            }
        });
        rendering
    }
}

/// L*a*b* with a and b scaled by L/100, since dark colours look less saturated (Hunt effect) [Andersson2020, colour pipeline].
///
/// The argument is Y/Yₙ, X/Xₙ − Y/Yₙ, Y/Yₙ − Z/Zₙ. Colours outside the display's gamut are clamped.
pub(super) fn lab_from_opponent([luminance, red_green, blue_yellow]: [f32; 3]) -> [f32; 3] {
    let rgb = transformed(&RGB_FROM_XYZ, [luminance + red_green, luminance, luminance - blue_yellow]);
    hunt_lab(rgb.map(|v| v.clamp(0.0, 1.0)))
}

fn hunt_lab(linear: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = transformed(&XYZ_FROM_RGB, linear)
        .map(|t| if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 });
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// Maps the distance between two colours to an error, 0..=1 [Andersson2020, colour pipeline].
pub(super) struct ColorDifference {
    /// Largest distance between two display colours, green and blue, raised to `EXPONENT`.
    largest: f32,
}

impl ColorDifference {
    /// Exponent of distances: compresses large distances, which all look large.
    const EXPONENT: f32 = 0.7;
    /// Distances up to this fraction of the largest …
    const KNEE_DISTANCE: f32 = 0.4;
    /// … map to errors up to this.
    const KNEE_ERROR: f32 = 0.95;

    pub(super) fn new() -> Self {
        let largest = distance(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(Self::EXPONENT);
        Self { largest }
    }

    /// Error, 0..=1, between two colours as [`lab_from_opponent`] gives them.
    pub(super) fn between(&self, a: [f32; 3], b: [f32; 3]) -> f32 {
        let fraction = distance(a, b).powf(Self::EXPONENT) / self.largest;
        if fraction < Self::KNEE_DISTANCE {
            Self::KNEE_ERROR / Self::KNEE_DISTANCE * fraction
        } else {
            let beyond = (fraction - Self::KNEE_DISTANCE) / (1.0 - Self::KNEE_DISTANCE);
            (Self::KNEE_ERROR + (1.0 - Self::KNEE_ERROR) * beyond).min(1.0)
        }
    }
}

/// HyAB distance between two L*a*b* colours: the sum of the lightness distance and the chromatic distance.
fn distance(p: [f32; 3], q: [f32; 3]) -> f32 {
    (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2])
}

/// Linear value, 0..=1, of an sRGB-encoded one, which is clamped to 0..=1.
pub(super) fn linear_from_srgb(encoded: f32) -> f32 {
    let encoded = encoded.clamp(0.0, 1.0);
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

fn transformed(matrix: &[[f32; 3]; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
    matrix.map(|[a, b, c]| a * x + b * y + c * z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_matrices_are_inverses_and_keep_white() {
        for rgb in [[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            let back = transformed(&RGB_FROM_XYZ, transformed(&XYZ_FROM_RGB, rgb));
            // The rounding error of a few operations on numbers up to 3.
            assert!(back.iter().zip(&rgb).all(|(b, v)| (b - v).abs() < 1e-6), "{rgb:?} became {back:?}");
        }
        let [lightness, a, b] = hunt_lab([1.0; 3]);
        assert!((lightness - 100.0).abs() < 1e-4 && a.abs() < 1e-4 && b.abs() < 1e-4);
    }

    #[test]
    fn no_colours_are_further_apart_than_green_and_blue() {
        let corners: Vec<[f32; 3]> =
            (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|v| v as f32)).map(hunt_lab).collect();
        let difference = ColorDifference::new();
        for p in &corners {
            for q in &corners {
                assert!(distance(*p, *q).powf(ColorDifference::EXPONENT) <= difference.largest);
                assert_eq!(difference.between(*p, *q) == 0.0, p == q);
            }
        }
        assert_eq!(difference.between(corners[2], corners[4]), 1.0);
    }
}
