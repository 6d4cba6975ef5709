//! The shader's function in plain Rust: its specification.

use glam::Vec3;

/// Share of the surroundings that a surface sees, whose openness is `ground` where it faces down. `normal`: unit, world space.
pub(super) fn openness(ground: f32, normal: Vec3) -> f32 {
    let up = 0.5 + 0.5 * normal.y;
    ground + (1.0 - ground) * up
}
