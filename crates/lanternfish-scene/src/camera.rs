//! Cameras in world space.

use glam::{Affine3A, Mat3, Vec3};

use crate::Bounds;

/// A camera: looks down its own −z, +y up, +x right.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The file's name for it, or empty.
    pub name: String,
    /// Camera to world: rotation and translation only.
    pub world_from_camera: Affine3A,
    /// How the view is projected.
    pub projection: Projection,
}

/// How a view is projected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Through a point. The far plane is at infinity.
    Perspective {
        /// Full vertical angle, radians, in (0, π).
        fov_y: f32,
        /// Distance of the near plane, m, > 0.
        near: f32,
    },
    /// Along parallel lines.
    Orthographic {
        /// Half the height of the view, m, > 0.
        half_height: f32,
        /// Distance of the near plane, m, >= 0.
        near: f32,
        /// Distance of the far plane, m, > near.
        far: f32,
    },
}

impl Camera {
    /// At `eye`, looking at `target`, +y up as far as that goes (looking straight up or down, −z is up).
    ///
    /// `eye` and `target` must differ.
    pub fn look_at(eye: Vec3, target: Vec3, projection: Projection) -> Self {
        let back = (eye - target).normalize();
        let up = if back.y.abs() > 0.999_999 { Vec3::NEG_Z * back.y.signum() } else { Vec3::Y };
        let right = up.cross(back).normalize();
        let rotation = Mat3::from_cols(right, back.cross(right), back);
        Self { name: String::new(), world_from_camera: Affine3A::from_mat3_translation(rotation, eye), projection }
    }

    /// A perspective camera that sees the whole of `bounds` from the front, a little to the right and above, at any
    /// aspect ratio (width / height) given.
    pub fn framing(bounds: &Bounds, fov_y: f32, aspect: f32) -> Self {
        let radius = (0.5 * bounds.size().length()).max(1e-3);
        let half_angle = (0.5 * fov_y).min((aspect * (0.5 * fov_y).tan()).atan());
        let distance = radius / half_angle.sin();
        let eye = bounds.center() + distance * Vec3::new(0.4, 0.3, 1.0).normalize();
        Self::look_at(eye, bounds.center(), Projection::Perspective { fov_y, near: near_for(bounds, eye) })
    }

    /// Where the camera is, world space.
    pub fn eye(&self) -> Vec3 {
        self.world_from_camera.translation.into()
    }
}

/// A near plane for a view of `bounds` from `eye`: 1/1000 of the scene's size, and never beyond a tenth of the way to
/// it. Reverse-Z with an infinite far plane leaves precision to spare.
pub fn near_for(bounds: &Bounds, eye: Vec3) -> f32 {
    let size = bounds.size().length().max(1e-3);
    let to_box = (bounds.min - eye).max(eye - bounds.max).max(Vec3::ZERO).length();
    (1e-3 * size).min(0.1).max(0.1 * to_box.min(0.01 * size)).max(1e-5)
}
