//! Camera rays.

use glam::{Vec3A, vec3a};
use lanternfish_scene::{Camera, Projection};

/// Origin and unit direction of the ray through (x, y), in pixels from the top left of an image of this size.
///
/// Orthographic rays start at the near plane. Perspective rays start at the eye, so surfaces before the near plane are visible.
pub(crate) fn ray(camera: &Camera, x: f64, y: f64, width: usize, height: usize) -> (Vec3A, Vec3A) {
    let (width, height) = (width as f64, height as f64);
    let ndc_x = ((2.0 * x / width - 1.0) * (width / height)) as f32;
    let ndc_y = (1.0 - 2.0 * y / height) as f32;
    let world_from_camera = &camera.world_from_camera;
    let (origin, direction) = match camera.projection {
        Projection::Perspective { fov_y, .. } => {
            let slope = (0.5 * fov_y).tan();
            (Vec3A::ZERO, vec3a(slope * ndc_x, slope * ndc_y, -1.0))
        }
        Projection::Frustum { left, right, bottom, top, .. } => {
            let across = left + (right - left) * (x / width) as f32;
            let down = top + (bottom - top) * (y / height) as f32;
            (Vec3A::ZERO, vec3a(across, down, -1.0))
        }
        Projection::Orthographic { half_height, near, .. } => {
            (vec3a(half_height * ndc_x, half_height * ndc_y, -near), Vec3A::NEG_Z)
        }
    };
    (world_from_camera.transform_point3a(origin), world_from_camera.transform_vector3a(direction).normalize())
}
