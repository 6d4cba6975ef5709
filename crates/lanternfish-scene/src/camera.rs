//! Cameras in world space.

use glam::{Affine3A, Mat3, Vec2, Vec3, Vec3A};

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
    /// Through a point, off the axis if need be: an eye of a head-mounted display, a part of a larger picture. Pixels need
    /// not be square. The far plane is at infinity.
    Frustum {
        /// Slope of the left side: x over distance.
        left: f32,
        /// Of the right side, > left.
        right: f32,
        /// Of the bottom: y over distance.
        bottom: f32,
        /// Of the top, > bottom.
        top: f32,
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

impl Projection {
    /// Slopes of the sides, left, right, bottom, top, in a picture `aspect` times as wide as high; `None` where lines are
    /// parallel.
    pub fn slopes(&self, aspect: f32) -> Option<[f32; 4]> {
        match *self {
            Self::Perspective { fov_y, .. } => {
                let slope = (0.5 * fov_y).tan();
                Some([-aspect * slope, aspect * slope, -slope, slope])
            }
            Self::Frustum { left, right, bottom, top, .. } => Some([left, right, bottom, top]),
            Self::Orthographic { .. } => None,
        }
    }

    /// Distance of the near plane, m.
    pub fn near(&self) -> f32 {
        match *self {
            Self::Perspective { near, .. } | Self::Frustum { near, .. } | Self::Orthographic { near, .. } => near,
        }
    }
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

    /// A perspective camera that just sees the whole of `bounds`, from the front, a little to the right and above.
    /// `aspect` is width / height. An empty box is taken for a cube of 2 m around the origin.
    pub fn framing(bounds: &Bounds, fov_y: f32, aspect: f32) -> Self {
        let cube = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        let bounds = if bounds.is_empty() { &cube } else { bounds };
        let center = bounds.center();
        let towards_eye = Vec3::new(0.4, 0.3, 1.0).normalize();
        let turned = Self::look_at(center + towards_eye, center, Projection::Perspective { fov_y, near: 1.0 });
        let camera_from_world = turned.world_from_camera.matrix3.transpose();

        // A corner (x, y, z) around the centre is in view when |x| and |y| are below the frustum's half extents at it.
        let slope = Vec2::new(aspect, 1.0) * (0.5 * fov_y).tan();
        let mut distance = 0.0f32;
        for corner in bounds.corners() {
            let c = camera_from_world * Vec3A::from(corner - center);
            distance = distance.max(c.z + (c.x.abs() / slope.x).max(c.y.abs() / slope.y));
        }
        let eye = center + (1.05 * distance).max(1e-3) * towards_eye;
        Self::look_at(eye, center, Projection::Perspective { fov_y, near: near_plane(bounds) })
    }

    /// Where the camera is, world space.
    pub fn eye(&self) -> Vec3 {
        self.world_from_camera.translation.into()
    }
}

/// Distance of a near plane, m, for a camera anywhere in or around `bounds`: a thousandth of its size, at most 10 cm.
/// Reverse-Z with an infinite far plane leaves precision to spare.
pub fn near_plane(bounds: &Bounds) -> f32 {
    (1e-3 * bounds.size().length()).clamp(1e-5, 0.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn framing_shows_all_corners_and_fills_the_view() {
        for (size, aspect) in [(Vec3::new(9.0, 1.0, 2.0), 1.78), (Vec3::new(1.0, 7.0, 1.0), 0.5), (Vec3::ONE, 1.0)] {
            let bounds = Bounds { min: Vec3::splat(3.0), max: Vec3::splat(3.0) + size };
            let camera = Camera::framing(&bounds, 0.8, aspect);
            let camera_from_world = camera.world_from_camera.inverse();
            let mut widest = 0.0f32;
            for corner in bounds.corners() {
                let p = camera_from_world.transform_point3(corner);
                let ndc = Vec2::new(p.x / aspect, p.y) / (-p.z * 0.4f32.tan());
                assert!(p.z < 0.0 && ndc.abs().max_element() <= 1.0, "{corner} is at {ndc}");
                widest = widest.max(ndc.abs().max_element());
            }
            assert!(widest > 0.8, "the view is filled to {widest} only");
        }
    }
}
