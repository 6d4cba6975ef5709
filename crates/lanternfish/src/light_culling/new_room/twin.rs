//! The shader's test in plain Rust: its specification.

use glam::Vec3;
use lanternfish_scene::Camera;

/// Whether a point light of this range, m, reaches what lies before the eye.
pub(super) fn reaches_view(camera: &Camera, position: Vec3, range: f32) -> bool {
    camera.world_from_camera.inverse().transform_point3(position).z <= range
}
