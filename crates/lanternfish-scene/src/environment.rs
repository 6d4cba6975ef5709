//! Light from infinitely far, as an image of all directions.

mod read;

#[cfg(test)]
mod tests;

use std::f32::consts::{PI, TAU};
use std::path::Path;

use glam::Vec3;

use crate::SceneError;

/// An equirectangular image of the radiance that arrives from every direction.
///
/// A direction `d` of unit length, world space, lies in the image at
///
/// * `u = 0.5 + (atan2(d.x, -d.z) + rotation) / 2π`, which wraps: without rotation the image's centre is seen looking
///   along −z, and `u` grows to the right, towards +x;
/// * `v = acos(d.y) / π`: 0 straight up, 1 straight down.
///
/// Pixel (x, y) has its centre at `u = (x + 0.5) / width`, `v = (y + 0.5) / height`. Between centres the radiance is
/// bilinear; beyond the first and the last row of centres it is that of the row.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Pixels across; > 0.
    pub width: usize,
    /// Pixels down; > 0.
    pub height: usize,
    /// Radiance, nits, linear Rec. 709: finite and not negative; rows from the top (+y), `width * height` of them.
    pub pixels: Vec<Vec3>,
    /// Turns the environment about +y, counter-clockwise seen from above, radians. Finite.
    pub rotation: f32,
}

impl Environment {
    /// Most pixels a side of a file that is read.
    pub const MAX_SIDE: usize = 16_384;

    /// Reads a Radiance file (`.hdr`: RGBE, with or without run lengths) or an OpenEXR file (`.exr`: the first layer
    /// that has R, G and B, as half, float or integer), as it is: primaries are taken for Rec. 709 and values for nits.
    /// Not applied, with a warning: the exposure that a Radiance file states.
    ///
    /// Values that are no numbers or infinite are [`SceneError::Invalid`], which counts the pixels that have them; so
    /// are images without pixels, with more than [`Self::MAX_SIDE`] a side, and files that break off. Negative values,
    /// which filters leave, become 0 with a warning.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        read::load(path)
    }

    /// Radiance that arrives from `direction`: unit length, world space, pointing away from who looks; nits. The nearest
    /// pixels' mean, each weighted by how near it is (see [`Environment`]).
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

    /// Where `direction` (unit length, world space) lies in the image: `u` in 0..1 and `v` in 0..=1.
    pub fn uv(&self, direction: Vec3) -> (f32, f32) {
        let u = 0.5 + (direction.x.atan2(-direction.z) + self.rotation) / TAU;
        // The arc cosine, without its loss of digits towards the poles.
        let v = direction.x.hypot(direction.z).atan2(direction.y) / PI;
        // Just below a whole number the remainder rounds to 1.
        (u.rem_euclid(1.0) % 1.0, v.min(1.0))
    }

    /// The direction that lies at (u, v) of the image: unit length, world space. The inverse of [`Environment::uv`].
    pub fn direction(&self, u: f32, v: f32) -> Vec3 {
        let (sin_azimuth, cos_azimuth) = (TAU * (u - 0.5) - self.rotation).sin_cos();
        let (sin_polar, cos_polar) = (PI * v).sin_cos();
        Vec3::new(sin_azimuth * sin_polar, cos_polar, -cos_azimuth * sin_polar)
    }

    /// Whether it is as its fields' documentation promises; if not, the first fault.
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
