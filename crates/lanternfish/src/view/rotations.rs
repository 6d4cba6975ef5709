//! Rotations for a direction set: a sequence that is evenly distributed at any length.

use glam::{DQuat, Quat};

/// The real root of x⁴ = x + 1; its powers are the steps of the R₃ sequence [Roberts2018].
const RATIO: f64 = 1.220_744_084_605_759_5;

/// The rotation of this index, unit: uniformly distributed over all rotations, from three numbers of a low-discrepancy sequence
/// [Shoemake1992; Roberts2018]. The same on every machine; neighbouring indices give very different rotations.
pub fn frame_rotation(index: u32) -> Quat {
    let [u1, u2, u3] = [1, 2, 3].map(|i| (0.5 + f64::from(index) * RATIO.powi(-i)).fract());
    let (sin_a, cos_a) = (std::f64::consts::TAU * u2).sin_cos();
    let (sin_b, cos_b) = (std::f64::consts::TAU * u3).sin_cos();
    let (a, b) = ((1.0 - u1).sqrt(), u1.sqrt());
    DQuat::from_xyzw(a * sin_a, a * cos_a, b * sin_b, b * cos_b).normalize().as_quat()
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use glam::Vec3;

    use super::*;
    use crate::testing::Random;

    const FRAMES: u32 = 4096;
    const SIDE: usize = 12;

    /// Chi-square per degree of freedom, over `SIDE` × `SIDE` equal-area cells of the sphere, of the rotated axes: 1 ± 0.12 for random
    /// rotations, less for evenly distributed ones.
    fn unevenness(axis: Vec3, rotation: impl Fn(u32) -> Quat) -> f64 {
        let mut counts = [0u32; SIDE * SIDE];
        for frame in 0..FRAMES {
            let d = rotation(frame) * axis;
            let part = |v: f32| ((v * SIDE as f32) as usize).min(SIDE - 1);
            counts[part(0.5 + 0.5 * d.z) * SIDE + part(d.y.atan2(d.x) / TAU + 0.5)] += 1;
        }
        let expected = f64::from(FRAMES) / counts.len() as f64;
        counts.iter().map(|count| (f64::from(*count) - expected).powi(2) / expected).sum::<f64>()
            / (counts.len() - 1) as f64
    }

    #[test]
    fn rotated_axes_are_uniform_on_the_sphere() {
        assert!((RATIO.powi(4) - RATIO - 1.0).abs() < 1e-14);
        let mut random = Random::new(3);
        for axis in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().chain((0..20).map(|_| random.direction())) {
            let actual = unevenness(axis, frame_rotation);
            assert!(actual < 0.8, "{axis}: {actual}");
        }
        // Check that the test can fail: three uniform Euler angles cluster at the poles.
        let euler = |frame: u32| {
            let [a, b, c] = [1, 2, 3].map(|i| TAU * (f64::from(frame) * RATIO.powi(-i)).fract() as f32);
            Quat::from_euler(glam::EulerRot::XYZ, a, b, c)
        };
        assert!(unevenness(Vec3::X, euler) > 2.0, "{}", unevenness(Vec3::X, euler));
    }

    #[test]
    fn rotations_are_unit_and_distinct() {
        let all: Vec<Quat> = (0..200).chain([u32::MAX - 1, u32::MAX]).map(frame_rotation).collect();
        for (i, rotation) in all.iter().enumerate() {
            assert!(rotation.is_normalized());
            assert!(all[..i].iter().all(|other| other.angle_between(*rotation) > 0.05), "{i}");
        }
    }
}
