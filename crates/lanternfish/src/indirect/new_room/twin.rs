//! The shader's function in plain Rust: its specification.

use glam::Vec3;

/// Irradiance over π, nits. `normal`: unit, world space.
pub(super) fn arriving(radiance: f32, normal: Vec3) -> f32 {
    radiance * (0.75 + 0.25 * normal.y)
}
