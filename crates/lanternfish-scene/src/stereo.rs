//! Stereo cameras.

use glam::{Affine3A, Quat, Vec3};

use crate::{Camera, Projection};

/// Eye transforms and frusta of a head-mounted display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereoRig {
    /// The left eye and the right one.
    pub eyes: [Eye; 2],
}

/// One eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// Transform from eye space to head space: rotation and translation only. The head looks along −z.
    pub head_from_eye: Affine3A,
    /// Slopes of the frustum's sides: left, right, bottom, top; x or y over distance. left < right, bottom < top.
    pub slopes: [f32; 4],
}

impl StereoRig {
    /// Eyes `distance` (m) apart. `slopes` are the left eye's; the right eye's are mirrored. `cant`: outward rotation of each
    /// eye, radians.
    pub fn new(distance: f32, slopes: [f32; 4], cant: f32) -> Self {
        let [left, right, bottom, top] = slopes;
        let eye = |side: f32, slopes| Eye {
            head_from_eye: Affine3A::from_rotation_translation(
                Quat::from_rotation_y(-side * cant),
                Vec3::X * (0.5 * side * distance),
            ),
            slopes,
        };
        Self { eyes: [eye(-1.0, slopes), eye(1.0, [-right, -left, bottom, top])] }
    }

    /// The HTC Vive: eyes 63 mm apart, and the slightly asymmetric frusta that its driver reports.
    pub fn vive() -> Self {
        Self::new(0.063, [-1.3905, 1.2468, -1.4721, 1.4619], 0.0)
    }

    /// Parallel eyes, `distance` (m) apart, both with the frustum of the perspective `camera` at the aspect ratio `aspect`,
    /// width / height. `None` for orthographic cameras.
    pub fn parallel(camera: &Camera, aspect: f32, distance: f32) -> Option<Self> {
        let slopes = camera.projection.slopes(aspect)?;
        let eye =
            |side: f32| Eye { head_from_eye: Affine3A::from_translation(Vec3::X * (0.5 * side * distance)), slopes };
        Some(Self { eyes: [eye(-1.0), eye(1.0)] })
    }

    /// The eyes' cameras for a head at `head`; `near` is the distance of their near planes, m.
    pub fn cameras(&self, head: &Camera, near: f32) -> [Camera; 2] {
        let names = ["left", "right"];
        std::array::from_fn(|i| {
            let [left, right, bottom, top] = self.eyes[i].slopes;
            Camera {
                name: names[i].to_owned(),
                world_from_camera: head.world_from_camera * self.eyes[i].head_from_eye,
                projection: Projection::Frustum { left, right, bottom, top, near },
            }
        })
    }
}

/// Stereo configuration of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Eyes {
    /// The eyes of the HTC Vive.
    Vive,
    /// Parallel eyes with the camera's frustum, this distance apart, m.
    Parallel(f32),
    /// The left eye's slopes (left, right, bottom, top), the distance between the eyes, m, and the outward rotation of each eye, radians.
    Rig([f32; 4], f32, f32),
}

impl Eyes {
    /// Distance between human eyes, m.
    pub const HUMAN: f32 = 0.063;

    /// The two cameras for a head at `head`, for images of the aspect ratio `aspect`, width / height. `None` for parallel eyes of an
    /// orthographic camera.
    pub fn cameras(self, head: &Camera, aspect: f32) -> Option<[Camera; 2]> {
        let rig = match self {
            Self::Vive => StereoRig::vive(),
            Self::Rig(slopes, distance, cant) => StereoRig::new(distance, slopes, cant),
            Self::Parallel(distance) => StereoRig::parallel(head, aspect, distance)?,
        };
        Some(rig.cameras(head, head.projection.near().max(1e-5)))
    }

    /// The aspect ratio, width / height, at which pixels are square. `None`: any.
    #[doc(hidden)]
    pub fn aspect(self) -> Option<f32> {
        let of = |[left, right, bottom, top]: [f32; 4]| (right - left) / (top - bottom);
        match self {
            Self::Vive => Some(of(StereoRig::vive().eyes[0].slopes)),
            Self::Rig(slopes, ..) => Some(of(slopes)),
            Self::Parallel(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eyes_are_symmetric() {
        // A turned head: its right is +z.
        let head = Camera::look_at(
            Vec3::new(1.0, 2.0, 3.0),
            Vec3::new(4.0, 2.0, 3.0),
            Projection::Perspective { fov_y: 1.0, near: 0.1 },
        );
        let [left, right] = StereoRig::vive().cameras(&head, 0.1);
        assert!((right.eye() - left.eye()).abs_diff_eq(Vec3::Z * 0.063, 1e-6));
        assert!((0.5 * (right.eye() + left.eye())).abs_diff_eq(head.eye(), 1e-6));
        let [a, b] = [left, right].map(|c| c.projection.slopes(1.0).unwrap());
        assert_eq!([-a[1], -a[0], a[2], a[3]], b);
        // Canted outwards: each eye's axis points to its own side.
        let [left, right] = StereoRig::new(0.063, [-1.0, 1.0, -1.0, 1.0], 0.1).cameras(&head, 0.1);
        let axis = |c: &Camera| c.world_from_camera.transform_vector3(Vec3::NEG_Z);
        assert!(axis(&left).z < -0.09 && axis(&right).z > 0.09);
    }

    #[test]
    fn parallel_eyes_have_the_cameras_frustum() {
        let projection = Projection::Perspective { fov_y: 1.2, near: 0.1 };
        let head = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, projection);
        let rig = StereoRig::parallel(&head, 1.5, 0.06).unwrap();
        assert_eq!(rig.eyes[0].slopes, rig.eyes[1].slopes);
        assert!(
            (rig.eyes[0].slopes[3] - 0.6f32.tan()).abs() < 1e-6
                && (rig.eyes[0].slopes[1] - 1.5 * 0.6f32.tan()).abs() < 1e-6
        );
        let flat = Projection::Orthographic { half_height: 1.0, near: 0.0, far: 9.0 };
        assert_eq!(StereoRig::parallel(&Camera { projection: flat, ..head }, 1.0, 0.06), None);
    }
}
