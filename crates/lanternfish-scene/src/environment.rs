//! Environment map: radiance from infinitely far away, as an equirectangular image.

mod read;
mod sun;

#[cfg(test)]
mod tests;

use std::f32::consts::{PI, TAU};
use std::path::Path;

use glam::Vec3;

use crate::SceneError;

/// An equirectangular environment map: the radiance that arrives from every direction.
///
/// A direction `d` (unit length, world space) maps to the image coordinates
///
/// * `u = 0.5 + (atan2(d.x, -d.z) + rotation) / 2π`, which wraps. Without rotation −z maps to the image's centre,
///   and `u` grows to the right, towards +x;
/// * `v = acos(d.y) / π`: 0 straight up, 1 straight down.
///
/// Pixel (x, y) has its centre at `u = (x + 0.5) / width`, `v = (y + 0.5) / height`. Radiance is interpolated bilinearly
/// between pixel centres. It wraps in `u` and is clamped to the first and last row in `v`.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Width, pixels; > 0.
    pub width: usize,
    /// Height, pixels; > 0.
    pub height: usize,
    /// Radiance of the pixels, nits, linear Rec. 709; finite and not negative. Row-major from the top (+y), `width * height` long.
    pub pixels: Vec<Vec3>,
    /// Rotation of the environment about +y, counter-clockwise seen from above, radians. Finite.
    pub rotation: f32,
}

impl Environment {
    /// Largest width and height that [`Environment::load`] reads, pixels.
    #[doc(hidden)]
    pub const MAX_SIDE: usize = 16_384;

    /// Reads a Radiance file (`.hdr`: RGBE, with or without run-length encoding) or an OpenEXR file (`.exr`: the first layer
    /// with R, G and B channels, as half, float or integer).
    ///
    /// Values are not converted: primaries are assumed to be Rec. 709 and values nits. The exposure of a Radiance
    /// file is ignored, with a warning. Negative values, which resampling filters produce, become 0 with a warning.
    ///
    /// # Errors
    ///
    /// [`SceneError::Invalid`] if pixels are NaN or infinite (the message counts them), if the image has no pixels or more
    /// than [`Self::MAX_SIDE`] a side, or if the file is truncated.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        read::load(path)
    }

    /// Radiance that arrives from `direction`, nits. `direction` has unit length, is in world space and points away from
    /// the viewer. The four nearest pixels are interpolated bilinearly (see [`Environment`]).
    #[doc(hidden)]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let (u, v) = self.uv(direction);
        let (x, y) = (u * self.width as f32 - 0.5, v * self.height as f32 - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let across = [0, 1].map(|i| (left as i64 + i).rem_euclid(self.width as i64) as usize);
        let down = [0, 1].map(|i| (top as i64 + i).clamp(0, self.height as i64 - 1) as usize);
        let [above, below] = down.map(|y| {
            let [left, right] = across.map(|x| self.pixels[y * self.width + x]);
            (left, right)
        });
        let mix = |a: Vec3, b: Vec3, fraction: f32| a * (1.0 - fraction) + b * fraction;
        mix(mix(above.0, above.1, x - left), mix(below.0, below.1, x - left), y - top)
    }

    /// Image coordinates of `direction` (unit length, world space): `u` in 0..1 and `v` in 0..=1.
    #[doc(hidden)]
    pub fn uv(&self, direction: Vec3) -> (f32, f32) {
        let u = 0.5 + (direction.x.atan2(-direction.z) + self.rotation) / TAU;
        // acos(y), without its loss of precision near the poles.
        let v = direction.x.hypot(direction.z).atan2(direction.y) / PI;
        // `rem_euclid` rounds to 1 just below an integer.
        (u.rem_euclid(1.0) % 1.0, v.min(1.0))
    }

    /// The direction at image coordinates (u, v): unit length, world space. The inverse of [`Environment::uv`].
    #[doc(hidden)]
    pub fn direction(&self, u: f32, v: f32) -> Vec3 {
        let (sin_azimuth, cos_azimuth) = (TAU * (u - 0.5) - self.rotation).sin_cos();
        let (sin_polar, cos_polar) = (PI * v).sin_cos();
        Vec3::new(sin_azimuth * sin_polar, cos_polar, -cos_azimuth * sin_polar)
    }

    /// Checks the invariants that the fields document; an error names the first violation.
    pub(crate) fn validate(&self) -> Result<(), String> {
        let Self { width, height, pixels, rotation } = self;
        if pixels.is_empty() || width.checked_mul(*height) != Some(pixels.len()) {
            return Err(format!("{} pixels for {width} × {height}", pixels.len()));
        }
        if let Some(i) = pixels.iter().position(|pixel| !(pixel.is_finite() && pixel.min_element() >= 0.0)) {
            return Err(format!("pixel {}, {}: {} is not a radiance", i % width, i / width, pixels[i]));
        }
        if !rotation.is_finite() {
            return Err(format!("its rotation is {rotation}"));
        }
        Ok(())
    }
}
