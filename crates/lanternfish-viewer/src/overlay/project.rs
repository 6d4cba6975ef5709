//! Projection of world-space points and lines to the image, on the host. Lines are clipped to the frustum.

use egui::{Pos2, Rect, pos2};
use glam::{Affine3A, Vec2, Vec3};
use lanternfish_scene::{Camera, Projection};

/// Projects world space to the image of a camera.
#[derive(Clone, Copy, Debug)]
pub struct Projector {
    view_from_world: Affine3A,
    /// Left, right, bottom, top of the frustum: slopes, or m for an orthographic camera.
    sides: [f32; 4],
    /// Near distance along the axis, m; `None` for an orthographic camera.
    near: Option<f32>,
    rendering: Rect,
}

impl Projector {
    /// Creates a projector. `rendering` is the rectangle of the image, points.
    pub fn new(camera: &Camera, rendering: Rect) -> Self {
        let aspect = rendering.width() / rendering.height().max(1.0);
        let (sides, near) = sides(camera, aspect);
        Self { view_from_world: camera.world_from_camera.inverse(), sides, near, rendering }
    }

    /// The image position of a world-space point, points, which may lie outside the image. `None` if nearer than the near plane.
    pub fn point(&self, p_world: Vec3) -> Option<Pos2> {
        let p_view = self.view_from_world.transform_point3(p_world);
        self.near.is_none_or(|near| -p_view.z >= near).then(|| self.place(p_view))
    }

    /// The part of a world-space line that lies in the image.
    pub fn segment(&self, a: Vec3, b: Vec3) -> Option<[Pos2; 2]> {
        let [mut a, mut b] = [a, b].map(|p| self.view_from_world.transform_point3(p));
        if let Some(near) = self.near {
            if -a.z < near && -b.z < near {
                return None;
            }
            let cut = |from: Vec3, to: Vec3| from.lerp(to, (near + from.z) / (from.z - to.z));
            if -a.z < near {
                a = cut(a, b);
            } else if -b.z < near {
                b = cut(b, a);
            }
        }
        clip(self.rendering, self.place(a), self.place(b))
    }

    fn place(&self, p_view: Vec3) -> Pos2 {
        let [left, right, bottom, top] = self.sides;
        let across = if self.near.is_some() { p_view.truncate() / -p_view.z } else { p_view.truncate() };
        let fraction = (across - Vec2::new(left, top)) / Vec2::new(right - left, bottom - top);
        pos2(
            self.rendering.left() + fraction.x * self.rendering.width(),
            self.rendering.top() + fraction.y * self.rendering.height(),
        )
    }
}

/// The sides of a camera's frustum, and its near distance; `None` for an orthographic camera.
fn sides(camera: &Camera, aspect: f32) -> ([f32; 4], Option<f32>) {
    match camera.projection {
        Projection::Orthographic { half_height, .. } => {
            ([-aspect * half_height, aspect * half_height, -half_height, half_height], None)
        }
        projection => (projection.slopes(aspect).unwrap_or([-1.0, 1.0, -1.0, 1.0]), Some(projection.near())),
    }
}

/// Corners of a camera's frustum between two distances, world space, m. Bit 0 of the index selects x, bit 1 y, bit 2 the distance.
pub fn frustum(camera: &Camera, aspect: f32, [near, far]: [f32; 2]) -> [Vec3; 8] {
    let ([left, right, bottom, top], eye) = sides(camera, aspect);
    std::array::from_fn(|corner| {
        let distance = if corner < 4 { near } else { far };
        let scale = if eye.is_some() { distance } else { 1.0 };
        let x = if corner & 1 == 0 { left } else { right };
        let y = if corner & 2 == 0 { bottom } else { top };
        camera.world_from_camera.transform_point3(Vec3::new(x * scale, y * scale, -distance))
    })
}

/// The twelve edges of a hexahedron with these corners.
pub fn edges(corners: &[Vec3; 8]) -> impl Iterator<Item = [Vec3; 2]> {
    let of_axis =
        |axis: usize| (0..8).filter(move |corner| corner & axis == 0).map(move |corner| [corner, corner | axis]);
    [1, 2, 4].into_iter().flat_map(of_axis).map(|pair| pair.map(|corner| corners[corner]))
}

/// The part of a line that lies in a rectangle (Liang–Barsky clipping).
fn clip(rect: Rect, a: Pos2, b: Pos2) -> Option<[Pos2; 2]> {
    let along = b - a;
    let (mut from, mut to) = (0.0f32, 1.0f32);
    for (step, margin) in [
        (-along.x, a.x - rect.left()),
        (along.x, rect.right() - a.x),
        (-along.y, a.y - rect.top()),
        (along.y, rect.bottom() - a.y),
    ] {
        if step == 0.0 {
            if margin < 0.0 {
                return None;
            }
        } else if step < 0.0 {
            from = from.max(margin / step);
        } else {
            to = to.min(margin / step);
        }
    }
    // Lines with NaN coordinates are rejected.
    (from <= to && along.x.is_finite() && along.y.is_finite()).then(|| [a + from * along, a + to * along])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn projector() -> (Camera, Projector) {
        let projection = Projection::Perspective { fov_y: std::f32::consts::FRAC_PI_2, near: 0.1 };
        let camera = Camera::look_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, projection);
        let rendering = Rect::from_min_max(pos2(100.0, 50.0), pos2(500.0, 250.0));
        (camera.clone(), Projector::new(&camera, rendering))
    }

    #[test]
    fn points_are_projected_to_their_image_positions() {
        let (camera, projector) = projector();
        assert_eq!(projector.point(Vec3::ZERO), Some(pos2(300.0, 150.0)));
        // At 5 m the image is 10 m high: 20 points per metre. +y is up in the image.
        let up = projector.point(Vec3::new(1.0, 2.0, 0.0)).unwrap();
        assert!((up - pos2(320.0, 110.0)).length() < 1e-3, "{up}");
        assert_eq!(projector.point(Vec3::new(0.0, 0.0, 6.0)), None, "behind");
        let corners = frustum(&camera, 2.0, [1.0, 4.0]);
        let corner = projector.point(corners[3]).unwrap();
        assert!((corner - pos2(500.0, 50.0)).length() < 1e-2, "{corner}");
        assert_eq!(edges(&corners).count(), 12);
        let projection = Projection::Orthographic { half_height: 2.0, near: 0.0, far: 9.0 };
        let parallel = Projector::new(&Camera { projection, ..camera }, projector.rendering);
        let up = parallel.point(Vec3::new(0.0, 1.0, -3.0)).unwrap();
        assert!((up - pos2(300.0, 100.0)).length() < 1e-3, "{up}");
    }

    #[test]
    fn lines_are_clipped_to_the_near_plane_and_the_image() {
        let (_, projector) = projector();
        // A line from in front of the camera to behind it, 1 m to the right: the clipped end lies at the right edge.
        let [a, b] = projector.segment(Vec3::new(1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 20.0)).unwrap();
        assert!((a - pos2(320.0, 150.0)).length() < 1e-3 && (b - pos2(500.0, 150.0)).length() < 1e-2, "{a} {b}");
        assert_eq!(projector.segment(Vec3::new(0.0, 0.0, 6.0), Vec3::new(1.0, 0.0, 9.0)), None);
        assert_eq!(projector.segment(Vec3::new(20.0, 0.0, 0.0), Vec3::new(20.0, 1.0, 0.0)), None, "beside the image");
        assert_eq!(projector.segment(Vec3::NAN, Vec3::ONE), None);
    }
}
