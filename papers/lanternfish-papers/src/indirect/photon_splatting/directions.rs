//! The directions that photons are split into, with their solid angles.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Quat, Vec3, Vec4};
use lanternfish::RenderError;

use crate::deep_images::directions::{DirectionSet, Directions};

/// Sample points on the sphere per direction, for the solid angles.
const PLACES: usize = 128;

/// A set of directions with their solid angles.
#[derive(Debug)]
pub(super) struct PhotonDirections {
    directions: Directions,
    /// Solid angle of each image's axis, sr; the sum is 2π.
    solid_angles: Vec<f32>,
}

impl PhotonDirections {
    /// Each direction covers the points that are nearer to it, or to its opposite, than to any other.
    pub fn new(set: DirectionSet) -> Result<Self, RenderError> {
        let directions = Directions::new(set).map_err(|error| RenderError::Directions { what: error.to_string() })?;
        let count = PLACES * directions.len();
        let mut nearest = vec![0u32; directions.len()];
        for i in 0..count {
            // Fibonacci spiral: uniform for any number of points.
            let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
            let (sin, cos) = (TAU * (0.618_033_988_749_895 * i as f64).fract()).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let (image, _) = directions.nearest(DVec3::new(r * cos, r * sin, z).as_vec3());
            nearest[image as usize] += 1;
        }
        let fraction = 2.0 * PI / count as f64;
        let solid_angles = nearest.iter().map(|count| (fraction * f64::from(*count)) as f32).collect();
        Ok(Self { directions, solid_angles })
    }

    /// The number of directions.
    pub fn len(&self) -> u32 {
        self.solid_angles.len() as u32
    }

    /// The directions as `directions.wesl` reads them, rotated.
    pub fn rotated(&self, rotation: Quat) -> Vec<Vec4> {
        let rotated = |axis: &Vec3| (rotation * *axis).normalize();
        self.directions
            .axes()
            .iter()
            .zip(&self.solid_angles)
            .map(|(axis, angle)| rotated(axis).extend(*angle))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells of an equal-area set are nearly equal, those of stacks and slices are not; they cover the hemisphere.
    #[test]
    fn solid_angles_add_up_to_the_hemisphere() {
        for (set, most) in [
            (DirectionSet::ZonalEqualArea { count: 169 }, 1.5),
            (DirectionSet::Cube { k: 5 }, 3.0),
            (DirectionSet::StacksSlices { stacks: 13, slices: 13 }, f32::INFINITY),
            (DirectionSet::ZonalEqualArea { count: 1 }, 1.0),
        ] {
            let directions = PhotonDirections::new(set).unwrap();
            let sum: f32 = directions.solid_angles.iter().sum();
            assert!((sum / (2.0 * PI as f32) - 1.0).abs() < 1e-5, "{set:?}: {sum}");
            let mean = sum / directions.len() as f32;
            let (least, greatest) =
                directions.solid_angles.iter().fold((f32::MAX, 0.0f32), |(a, b), x| (a.min(*x), b.max(*x)));
            assert!(greatest / mean <= most && least / mean >= 1.0 / most, "{set:?}: {least} to {greatest} of {mean}");
            if most == f32::INFINITY {
                assert!(greatest / least > 3.0, "{set:?} is even");
            }
        }
    }
}
