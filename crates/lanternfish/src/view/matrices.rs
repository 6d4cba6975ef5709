//! Validation of views that are given as matrices.

use glam::{Affine3A, Mat4, Vec4};
use lanternfish_scene::{Camera, Projection};

/// Checks that a camera exists with these matrices; the error describes the defect.
pub(crate) fn check(clip_from_view: Mat4, world_from_view: Mat4) -> Result<(), String> {
    if world_from_view.row(3) != Vec4::W {
        return Err(format!("world_from_view has the last row {}: 0, 0, 0, 1 is meant", world_from_view.row(3)));
    }
    let world_from_camera = Affine3A::from_mat4(world_from_view);
    let projection = projection(clip_from_view).ok_or_else(|| {
        format!(
            "clip_from_view is {clip_from_view}: reverse-Z is meant, depth near / distance in perspective (far at infinity), \
             (far - distance) / (far - near) where rays are parallel"
        )
    })?;
    Camera { name: String::new(), world_from_camera, projection }.validate()
}

/// The projection of a matrix, if [`super::clip_from_view`] can produce it.
fn projection(clip_from_view: Mat4) -> Option<Projection> {
    let Mat4 { x_axis: x, y_axis: y, z_axis: z, w_axis: w } = clip_from_view;
    let scales = x == Vec4::X * x.x && y == Vec4::Y * y.y;
    if scales && (z.z, z.w) == (0.0, -1.0) && w == Vec4::Z * w.z {
        let slope = |ndc: f32, axis: usize, scale: f32| (ndc + z[axis]) / scale;
        let (left, right, bottom, top) =
            (slope(-1.0, 0, x.x), slope(1.0, 0, x.x), slope(-1.0, 1, y.y), slope(1.0, 1, y.y));
        return Some(Projection::Frustum { left, right, bottom, top, near: w.z });
    }
    if scales && x.x > 0.0 && w.is_finite() && z == Vec4::Z * z.z && w.w == 1.0 {
        // Near is the small difference of two rounded numbers and may be negative.
        let (far, span) = (w.z / z.z, 1.0 / z.z);
        let near = if (far - span).abs() <= 1e-5 * span { 0.0 } else { far - span };
        return Some(Projection::Orthographic { half_height: 1.0 / y.y, near, far });
    }
    None
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn matrices_of_cameras_are_valid_and_others_are_not() {
        let eye = Affine3A::from_rotation_y(0.4) * Affine3A::from_translation(Vec3::new(1.0, 2.0, 3.0));
        for projection in [
            Projection::Perspective { fov_y: 0.8, near: 0.1 },
            Projection::Frustum { left: -0.4, right: 0.5, bottom: -0.1, top: 0.3, near: 0.02 },
            Projection::Orthographic { half_height: 2.0, near: 0.0, far: 20.0 },
            Projection::Orthographic { half_height: 2.0, near: 0.3, far: 7.0 },
        ] {
            let clip_from_view = crate::view::clip_from_view(&projection, 1.5);
            assert_eq!(check(clip_from_view, Mat4::from(eye)), Ok(()), "{projection:?}");
            let scaled = Mat4::from(eye) * Mat4::from_scale(Vec3::splat(2.0));
            assert!(check(clip_from_view, scaled).is_err() && check(clip_from_view, Mat4::NAN).is_err());
        }
        let sound = crate::view::clip_from_view(&Projection::Perspective { fov_y: 0.8, near: 0.1 }, 1.5);
        // A forward depth range, from 0 at the near plane to 1 at infinity, and one with a far plane.
        let forward = Mat4 { z_axis: -Vec4::Z - Vec4::W, w_axis: -0.1 * Vec4::Z, ..sound };
        let with_end = Mat4 { z_axis: 0.01 * Vec4::Z - Vec4::W, ..sound };
        for (clip_from_view, word) in [
            (Mat4::IDENTITY, "near"),
            (forward, "reverse-Z"),
            (with_end, "reverse-Z"),
            (Mat4 { w_axis: -0.1 * Vec4::Z, ..sound }, "near"),
            (Mat4::NAN, "reverse-Z"),
        ] {
            let error = check(clip_from_view, Mat4::from(eye)).unwrap_err();
            assert!(error.contains(word), "{clip_from_view}: {error}");
        }
        let sheared = Mat4 { w_axis: Vec4::new(0.0, 0.0, 0.0, 2.0), ..Mat4::from(eye) };
        assert!(check(sound, sheared).unwrap_err().contains("last row"));
    }
}
