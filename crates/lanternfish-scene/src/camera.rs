//! Cameras in world space.

use std::f32::consts::PI;

use glam::{Affine3A, Mat3, Mat3A, Vec3};

use crate::{Bounds, Scene, validate::UNIT_TOLERANCE};

/// A camera that looks along its −z axis, with +y up and +x right.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name in the file, or empty.
    pub name: String,
    /// Transform from camera space to world space: rotation and translation only.
    pub world_from_camera: Affine3A,
    /// How the view is projected.
    pub projection: Projection,
}

/// How a view is projected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Perspective projection, symmetric about the view axis. The far plane is at infinity.
    Perspective {
        /// Full vertical angle, radians, in (0, π): 45° are `45f32.to_radians()`.
        fov_y: f32,
        /// Distance of the near plane, m, > 0.
        near: f32,
    },
    /// Off-axis perspective projection: an eye of a head-mounted display, a tile of a larger image. Pixels need not be
    /// square. The far plane is at infinity.
    Frustum {
        /// Slope of the left side, view space: x over distance along the view axis.
        left: f32,
        /// Slope of the right side, x over distance; > left.
        right: f32,
        /// Slope of the bottom, y over distance.
        bottom: f32,
        /// Slope of the top, y over distance; > bottom.
        top: f32,
        /// Distance of the near plane, m, > 0.
        near: f32,
    },
    /// Orthographic projection.
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
    /// Slopes of the sides (left, right, bottom, top) of an image of aspect ratio `aspect`, width / height; `None` for
    /// orthographic projections.
    #[doc(hidden)]
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

    /// Checks that the projection is valid. The error names the invalid field and the expected values.
    fn validate(&self) -> Result<(), String> {
        let is_distance = |x: f32| x > 0.0 && x.is_finite();
        match *self {
            Self::Perspective { fov_y, .. } if !(fov_y > 0.0 && fov_y < PI) => {
                let degrees = "radians between 0 and π are meant; 45 degrees are 45f32.to_radians()";
                return Err(format!("fov_y is {fov_y}: {degrees}"));
            }
            Self::Frustum { left, right, bottom, top, .. } => {
                let finite = [left, right, bottom, top].iter().all(|slope| slope.is_finite());
                if !(finite && left < right && bottom < top) {
                    let slopes = format!("left {left}, right {right}, bottom {bottom}, top {top}");
                    return Err(format!("{slopes}: finite slopes are meant, left below right and bottom below top"));
                }
            }
            Self::Orthographic { half_height, near, far } => {
                if !is_distance(half_height) {
                    return Err(format!("half_height is {half_height}: metres above 0 are meant"));
                }
                if !(near >= 0.0 && far > near && far.is_finite()) {
                    return Err(format!("near is {near} and far is {far}: 0 <= near < far is meant, metres"));
                }
                return Ok(());
            }
            Self::Perspective { .. } => (),
        }
        match self.near() {
            near if is_distance(near) => Ok(()),
            near => Err(format!("near is {near}: metres above 0 are meant (near_plane() has one that fits a scene)")),
        }
    }

    /// Distance of the near plane, m.
    #[doc(hidden)]
    pub fn near(&self) -> f32 {
        match *self {
            Self::Perspective { near, .. } | Self::Frustum { near, .. } | Self::Orthographic { near, .. } => near,
        }
    }
}

impl Camera {
    /// A camera at `eye` that looks at `target`, world space, m; +y is up where possible (−z if the camera
    /// looks straight down, +z if it looks straight up).
    ///
    /// `eye` and `target` must differ: otherwise the camera has no direction and [`Camera::validate`] refuses it.
    pub fn look_at(eye: Vec3, target: Vec3, projection: Projection) -> Self {
        Self::looking_along(eye, target - eye, projection)
    }

    /// A camera at `eye` that looks along `direction`, of any length but zero. Use it far from the origin, where a target near the eye
    /// rounds to the eye.
    pub(crate) fn looking_along(eye: Vec3, direction: Vec3, projection: Projection) -> Self {
        let back = -direction.normalize();
        let up = if back.y.abs() > 0.999_999 { Vec3::NEG_Z * back.y.signum() } else { Vec3::Y };
        let right = up.cross(back).normalize();
        let rotation = Mat3::from_cols(right, back.cross(right), back);
        Self { name: String::new(), world_from_camera: Affine3A::from_mat3_translation(rotation, eye), projection }
    }

    /// Checks that the camera is valid. The error names the invalid field and the remedy.
    #[doc(hidden)]
    pub fn validate(&self) -> Result<(), String> {
        let (axes, eye) = (self.world_from_camera.matrix3, self.eye());
        if eye.is_nan() || eye.abs().max_element() > Scene::FARTHEST {
            let farthest = Scene::FARTHEST;
            return Err(format!("world_from_camera stands at {eye}: numbers up to {farthest:e} m are meant"));
        }
        if !self.world_from_camera.is_finite() {
            let mistake = "Camera::look_at needs an eye and a target that are finite and differ";
            return Err(format!("world_from_camera at {eye} looks nowhere: its axes are not numbers; {mistake}"));
        }
        let is_rotation = (axes * axes.transpose()).abs_diff_eq(Mat3A::IDENTITY, UNIT_TOLERANCE);
        if !is_rotation || axes.determinant() < 0.0 {
            let axes = [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| axis.to_array());
            return Err(format!(
                "world_from_camera scales, shears or mirrors, axes {axes:?}: it may rotate and move, no more"
            ));
        }
        self.projection.validate()
    }

    /// Position of the camera, world space, m.
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
    fn cameras_without_a_view_are_refused_by_the_name_of_the_field() {
        let through = |projection| Camera::look_at(Vec3::Z, Vec3::ZERO, projection);
        let perspective = |fov_y, near| through(Projection::Perspective { fov_y, near });
        let parallel = |half_height, near, far| through(Projection::Orthographic { half_height, near, far });
        let frustum = |left, right, bottom, top| through(Projection::Frustum { left, right, bottom, top, near: 0.1 });
        let (sound, nan) = (perspective(1.0, 0.1), f32::NAN);
        for camera in [sound.clone(), parallel(1.0, 0.0, 2.0), frustum(-1.0, 0.5, 0.0, 1.0)] {
            assert_eq!(camera.validate(), Ok(()));
        }
        for straight in [Vec3::Y, Vec3::NEG_Y] {
            assert_eq!(
                Camera::look_at(straight, Vec3::ZERO, sound.projection).validate(),
                Ok(()),
                "straight {straight}"
            );
        }
        let moved = |change: fn(&mut Affine3A)| {
            let mut camera = sound.clone();
            change(&mut camera.world_from_camera);
            camera
        };
        for (camera, named) in [
            (perspective(45.0, 0.1), ["fov_y is 45", "45f32.to_radians()"]),
            (perspective(PI, 0.1), ["fov_y is 3.14", "radians"]),
            (perspective(0.0, 0.1), ["fov_y is 0", "radians"]),
            (perspective(nan, 0.1), ["fov_y is NaN", "radians"]),
            (perspective(1.0, 0.0), ["near is 0", "above 0"]),
            (perspective(1.0, -0.1), ["near is -0.1", "above 0"]),
            (perspective(1.0, f32::INFINITY), ["near is inf", "above 0"]),
            (parallel(0.0, 0.0, 1.0), ["half_height is 0", "above 0"]),
            (parallel(1.0, 1.0, 1.0), ["near is 1 and far is 1", "near < far"]),
            (parallel(1.0, 0.0, f32::INFINITY), ["far is inf", "near < far"]),
            (frustum(1.0, -1.0, -1.0, 1.0), ["left 1, right -1", "left below right"]),
            (frustum(-1.0, 1.0, nan, 1.0), ["bottom NaN", "finite"]),
            (Camera::look_at(Vec3::X, Vec3::X, sound.projection), ["looks nowhere", "look_at"]),
            (Camera::look_at(Vec3::X, Vec3::NAN, sound.projection), ["looks nowhere", "look_at"]),
            (Camera::look_at(Vec3::NAN, Vec3::X, sound.projection), ["stands at", "numbers"]),
            (moved(|m| m.matrix3 *= 2.0), ["scales", "rotate"]),
            (moved(|m| m.matrix3.x_axis *= 0.0), ["scales", "rotate"]),
            (moved(|m| m.matrix3.x_axis *= -1.0), ["mirrors", "rotate"]),
        ] {
            let fault = camera.validate().expect_err(named[0]);
            assert!(named.iter().all(|part| fault.contains(part)), "{named:?}: {fault}");
        }
    }

    #[test]
    fn a_scene_without_cameras_gets_a_framing_camera() {
        let mut scene = crate::generate::demo("cornell").expect("it is built in");
        assert_eq!(scene.default_camera(1.5), scene.cameras[0]);
        scene.cameras.clear();
        let camera = scene.default_camera(1.5);
        assert_eq!(camera.validate(), Ok(()));
        let p = camera.world_from_camera.inverse().transform_point3(scene.bounds().center());
        assert!(p.z < 0.0 && p.truncate().length() < 0.1 * -p.z, "the middle is at {p}");
        assert_eq!(Scene::default().default_camera(1.5).validate(), Ok(()), "an empty scene too");
    }
}
