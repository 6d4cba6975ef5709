//! View frusta, and the frustum that encloses several [VanGelderen2020, §4.1.1].

use std::array;

use glam::{Affine3A, DAffine3, DMat3, DVec2, DVec3, UVec2, Vec3};

/// The frustum of one camera, for clustering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewFrustum {
    /// Camera to world, rotation and translation only; looks down −z.
    pub world_from_view: Affine3A,
    /// Left, right, bottom, top: x or y over distance (perspective), or coordinates, m (orthographic).
    pub slopes: [f32; 4],
    /// Least distance along the axis of any visible point, m; above 0 unless `parallel`.
    pub near: f32,
    /// Greatest distance along the axis of any visible point, m; above `near`.
    pub far: f32,
    /// True for an orthographic projection.
    pub parallel: bool,
    /// Size of the image, pixels.
    pub size: UVec2,
}

impl ViewFrustum {
    /// The corners, world space, m: four of the near plane, then four of the far plane, each in the order left bottom, right bottom, left
    /// top, right top.
    pub fn corners(&self) -> [Vec3; 8] {
        self.exact_corners().map(|p_world| p_world.as_vec3())
    }

    pub(crate) fn exact_corners(&self) -> [DVec3; 8] {
        let world_from_view = self.world_from_view.as_daffine3();
        array::from_fn(|corner| {
            let distance = f64::from(if corner < 4 { self.near } else { self.far });
            let scale = if self.parallel { 1.0 } else { distance };
            let (x, y) = (self.slopes[corner & 1], self.slopes[2 + (corner >> 1 & 1)]);
            world_from_view.transform_point3(DVec3::new(f64::from(x) * scale, f64::from(y) * scale, -distance))
        })
    }

    /// The smallest frustum of a camera that contains all points, rounded outwards.
    ///
    /// Perspective: every point must lie in front of the camera by more than the f32 rounding error of its position.
    pub(crate) fn around(world_from_view: DAffine3, p_worlds: &[DVec3], parallel: bool, size: UVec2) -> Self {
        // The stored f32 camera is used, so that its rounding error excludes no point.
        let world_from_view = world_from_view.as_affine3a();
        let view_from_world = world_from_view.as_daffine3().inverse();
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p_world in p_worlds {
            let p_view = view_from_world.transform_point3(*p_world);
            let distance = -p_view.z;
            let scale = if parallel { 1.0 } else { distance };
            let p = (p_view.truncate() / scale).extend(distance);
            (low, high) = (low.min(p), high.max(p));
        }
        Self {
            world_from_view,
            slopes: [rounded_down(low.x), rounded_up(high.x), rounded_down(low.y), rounded_up(high.y)],
            near: rounded_down(low.z),
            far: rounded_up(high.z),
            parallel,
            size,
        }
    }

    /// The frustum from an eye moved back by `distance`, m, along its central ray, measured along the axis [VanGelderen2020, §4.3]. The far
    /// plane's rectangle is unchanged; near and far increase by `distance`.
    ///
    /// The thesis states both "along the central Z axis" and that asymmetric frusta become skewed cubes, which is only true along the
    /// central ray. Along the axis, an off-centre frustum would also lose near corners. The distance is at most [`FARTHEST_DISPLACEMENT`]
    /// times the far plane's distance. Orthographic frusta are unchanged.
    pub(crate) fn displaced(&self, distance: f32) -> Self {
        // f32::max of a number and NaN is the number.
        let distance = f64::from(distance.max(0.0).min(FARTHEST_DISPLACEMENT * self.far));
        if self.parallel || distance == 0.0 {
            return *self;
        }
        let world_from_view = self.world_from_view.as_daffine3();
        let distance = distance.max(position_error(world_from_view.translation.length()));
        let [left, right, bottom, top] = self.slopes.map(f64::from);
        let back = DVec3::new(-0.5 * (left + right), -0.5 * (bottom + top), 1.0) * distance;
        let displaced = world_from_view * DAffine3::from_translation(back);
        Self::around(displaced, &self.exact_corners(), false, self.size)
    }
}

/// Maximum displacement of an eye, in far-plane distances. The frustum is almost parallel then. Shaders distinguish fewer layers the
/// further back the eye is (`most_cells`): 49 at this limit.
const FARTHEST_DISPLACEMENT: f32 = 16.0;

/// Minimum advance along the common axis per metre along a corner ray. Below it, the frustum around a 90° view extends more than 88° to one
/// side, and most of it is invisible to every view.
const LEAST_ADVANCE: f64 = 0.05;

/// Upper bound of the f32 rounding error of a position at this distance from the origin, m: √3 / 2 ulp, with a safety factor of three.
fn position_error(distance: f64) -> f64 {
    4.0 * f64::from(f32::EPSILON) * distance
}

/// The largest f32 that is at most `value`.
fn rounded_down(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) > value { nearest.next_down() } else { nearest }
}

/// The smallest f32 that is at least `value`.
fn rounded_up(value: f64) -> f32 {
    -rounded_down(-value)
}

/// The frustum that encloses all of these views; near and far are as tight as the corners allow [VanGelderen2020, §4.1.1].
///
/// A single view is returned as it is. For several views the frustum has the mean orientation and lies on the axis through their mean
/// origin, as far back as the supporting lines between near and far corners require. It contains every corner of every view, rounded
/// outwards. Its image has the largest width and the largest height in pixels of any view. For orthographic views it is their bounding box.
///
/// It extends the construction of the thesis. Slopes and distances cover *all* corners, which canted displays need; the thesis takes slopes
/// over the far corners and displaced distances. Near and far corners need not be separated in depth. Lines that converge towards the axis
/// are ignored. The eye moves back by at most the distance of the farthest corner (for lines almost parallel to the axis, as of telescopes
/// and of orthographic views).
///
/// None if the views are not aligned: a corner ray of some view points almost sideways or backwards. `views` must not be empty.
pub fn enclosing(views: &[ViewFrustum]) -> Option<ViewFrustum> {
    if let [view] = views {
        return Some(*view);
    }
    let world_from_head = world_from_head(views)?;
    let parallel = views.iter().all(|view| view.parallel);
    let eye = if parallel { 0.0 } else { enclosing_eye(views, &world_from_head) };
    let world_from_view = world_from_head * DAffine3::from_translation(DVec3::new(0.0, 0.0, -eye));
    let size = views.iter().map(|view| view.size).fold(UVec2::ZERO, UVec2::max);
    Some(ViewFrustum::around(world_from_view, &corners_of(views), parallel, size))
}

pub(crate) fn corners_of(views: &[ViewFrustum]) -> Vec<DVec3> {
    views.iter().flat_map(ViewFrustum::exact_corners).collect()
}

/// Mean origin of the cameras, world space, m.
pub(crate) fn mean_origin(views: &[ViewFrustum]) -> DVec3 {
    views.iter().map(|view| view.world_from_view.as_daffine3().translation).sum::<DVec3>() / views.len() as f64
}

/// Head space: mean origin and orientation. None if a view does not face that direction.
pub(crate) fn world_from_head(views: &[ViewFrustum]) -> Option<DAffine3> {
    let rotations = || views.iter().map(|view| view.world_from_view.as_daffine3().matrix3);
    let back = rotations().map(|rotation| rotation.z_axis).sum::<DVec3>().try_normalize()?;
    let up = rotations().map(|rotation| rotation.y_axis).sum::<DVec3>().reject_from_normalized(back);
    // Cameras may be upside down relative to each other.
    let up = up.try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
    let aligned = views.iter().zip(rotations()).all(|(view, rotation)| {
        let slopes = if view.parallel { [0.0; 4] } else { view.slopes };
        (0..4).all(|corner| {
            let (x, y) = (slopes[corner & 1], slopes[2 + (corner >> 1)]);
            -(rotation * DVec3::new(f64::from(x), f64::from(y), -1.0)).dot(back) >= LEAST_ADVANCE
        })
    });
    let rotation = DMat3::from_cols(up.cross(back), up, back);
    aligned.then(|| DAffine3::from_mat3_translation(rotation, mean_origin(views)))
}

/// Position of the enclosing frustum's eye, m ahead of the head's origin; behind all corners.
fn enclosing_eye(views: &[ViewFrustum], world_from_head: &DAffine3) -> f64 {
    let head_from_world = world_from_head.inverse();
    let p_heads: Vec<_> = corners_of(views).into_iter().map(|p| head_from_world.transform_point3(p)).collect();
    let (mut near, mut far) = (Vec::new(), Vec::new());
    for corners in p_heads.chunks_exact(8) {
        near.extend_from_slice(&corners[..4]);
        far.extend_from_slice(&corners[4..]);
    }
    let sides = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y];
    let eye = sides.into_iter().filter_map(|side| supported_crossing(side, &near, &far)).fold(f64::INFINITY, f64::min);
    let eye = if eye == f64::INFINITY { 0.0 } else { eye };

    let farthest = p_heads.iter().map(|p| p.z.abs()).fold(0.0, f64::max);
    let eye = eye.max(-farthest);
    let nearest = p_heads.iter().map(|p| -p.z).fold(f64::INFINITY, f64::min);
    let least_near = views.iter().filter(|view| !view.parallel).map(|view| view.near).fold(f32::INFINITY, f32::min);
    let from_origin = world_from_head.translation.length() + eye.abs();
    eye.min(nearest - (LEAST_ADVANCE * f64::from(least_near)).max(position_error(from_origin)))
}

/// Where the supporting line of one side crosses the axis behind the corners, m ahead of the origin; −∞ if the line is parallel to the
/// axis. None if it converges towards the axis, so it crosses it ahead or not at all.
///
/// Of the lines from a near to a far corner, the one with all corners on one side is the outermost where it passes between the two sets: it
/// lies on their convex hull there, and one hull edge per side passes.
fn supported_crossing(side: DVec3, near: &[DVec3], far: &[DVec3]) -> Option<f64> {
    // Distance, and offset from the axis.
    let project = |p_heads: &[DVec3]| p_heads.iter().map(|p| DVec2::new(-p.z, p.dot(side))).collect::<Vec<_>>();
    let (near, far) = (project(near), project(far));
    let deepest_near = near.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max);
    let shallowest_far = far.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
    let between = 0.5 * (deepest_near + shallowest_far);
    let mut outermost = f64::NEG_INFINITY;
    let mut slope = f64::NEG_INFINITY;
    for first in near.iter().filter(|p| p.x < between) {
        for last in far.iter().filter(|p| p.x > between) {
            let rise = (last.y - first.y) / (last.x - first.x);
            let out = first.y + rise * (between - first.x);
            if out > outermost {
                (outermost, slope) = (out, rise);
            }
        }
    }
    (slope > 0.0 || slope == 0.0 && outermost > 0.0).then(|| between - outermost / slope)
}
