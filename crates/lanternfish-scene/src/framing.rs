//! Cameras that frame a scene.

use glam::{Affine3A, Mat3, Vec2, Vec3, Vec3A, Vec3Swizzles as _};

use crate::{Bounds, Camera, Projection, Scene, named_enum, near_plane};

/// Fraction of the image's tighter dimension that a framed object fills.
const FILL: f32 = 0.8;

/// Default direction towards the eye, any length: from the front, slightly from the right and above.
pub(crate) const THREE_QUARTER: Vec3 = Vec3::new(0.4, 0.3, 1.0);

named_enum! {
    /// The side from which a scene is viewed. As in glTF, +y is up and an object's front faces +z; left and right are
    /// those of an observer who faces the front.
    Viewpoint {
        /// From +z.
        Front = "front": "From +z, the front in glTF",
        /// From −z.
        Back = "back": "From -z",
        /// From −x.
        Left = "left": "From -x, left of an observer who faces the front",
        /// From +x.
        Right = "right": "From +x",
        /// From +y; the front is at the bottom of the image.
        Top = "top": "From +y, the front at the bottom",
        /// From +x, +y and +z alike: the direction of an isometric drawing, in perspective.
        Iso = "iso": "From +x, +y and +z alike, in perspective",
    }
}

impl Viewpoint {
    /// Direction from the scene towards the eye, world space, unit length.
    #[doc(hidden)]
    pub fn towards_eye(self) -> Vec3 {
        match self {
            Self::Front => Vec3::Z,
            Self::Back => Vec3::NEG_Z,
            Self::Left => Vec3::NEG_X,
            Self::Right => Vec3::X,
            Self::Top => Vec3::Y,
            Self::Iso => Vec3::ONE.normalize(),
        }
    }
}

impl Camera {
    /// A perspective camera that frames `bounds` from the front, slightly from the right and above. The corners fill 80 % of
    /// the image's tighter dimension. `aspect` is width / height, `fov_y` is in radians. An empty box counts as a cube of
    /// 2 m around the origin.
    #[doc(hidden)]
    pub fn framing(bounds: &Bounds, fov_y: f32, aspect: f32) -> Self {
        let cube = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        let bounds = if bounds.is_empty() { &cube } else { bounds };
        let mut frame = Frame::new(bounds.center(), THREE_QUARTER, fov_y, aspect);
        frame.add(&bounds.corners(), &Affine3A::IDENTITY);
        frame.camera(bounds, fov_y)
    }

    /// A perspective camera that frames a scene from `side`; `None`: from the front, slightly from the right and above unless it is
    /// an upright card. The vertices, not their box, fill 80 % of the image's tighter dimension. `aspect` is width / height, `fov_y` is in
    /// radians. Takes time linear in the placed vertices, except those of instances within the bounds of others. A scene
    /// without geometry counts as a cube of 2 m around the origin.
    pub fn framing_scene(scene: &Scene, side: Option<Viewpoint>, fov_y: f32, aspect: f32) -> Self {
        let towards_eye = side.map_or_else(|| usual_direction(&scene.bounds()), Viewpoint::towards_eye);
        Self::framing_from(scene, towards_eye, fov_y, aspect)
    }

    /// [`Camera::framing_scene`] with the eye at this azimuth from the front, counter-clockwise seen from above, and this elevation;
    /// radians, `None`: as without a side.
    #[doc(hidden)]
    pub fn framing_turned(scene: &Scene, turn: [Option<f32>; 2], fov_y: f32, aspect: f32) -> Self {
        let usual = usual_direction(&scene.bounds()).normalize();
        let [azimuth, elevation] = [turn[0].unwrap_or(usual.x.atan2(usual.z)), turn[1].unwrap_or(usual.y.asin())];
        let level = Vec3::new(azimuth.sin(), 0.0, azimuth.cos());
        Self::framing_from(scene, elevation.cos() * level + elevation.sin() * Vec3::Y, fov_y, aspect)
    }

    /// A camera in this direction from the scene, of any length.
    pub(crate) fn framing_from(scene: &Scene, towards_eye: Vec3, fov_y: f32, aspect: f32) -> Self {
        let boxes = scene.boxes();
        let bounds = scene.bounds_of(&boxes);
        let cube = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        let is_empty = bounds.is_empty();
        let bounds = if is_empty { cube } else { bounds };
        let mut frame = Frame::new(bounds.center(), towards_eye, fov_y, aspect);
        for instance in &scene.instances {
            for (primitive, inner) in scene.meshes[instance.mesh].primitives.iter().zip(&boxes[instance.mesh]) {
                if frame.is_exceeded_by(&inner.corners(), &instance.world_from_object) {
                    frame.add(&primitive.positions, &instance.world_from_object);
                }
            }
        }
        if is_empty {
            frame.add(&bounds.corners(), &Affine3A::IDENTITY);
        }
        frame.camera(&bounds, fov_y)
    }
}

/// Direction towards the eye without a choice, any length: cards that face the front are seen from there, flat objects from higher above, and
/// those that are thin in x from the right.
fn usual_direction(bounds: &Bounds) -> Vec3 {
    const MOST_DEPTH: f32 = 0.02;
    const THIN: f32 = 0.25;
    if bounds.is_empty() {
        return THREE_QUARTER;
    }
    let (size, usual) = (bounds.size(), THREE_QUARTER);
    if size.z < MOST_DEPTH * size.x.min(size.y) {
        return Vec3::Z;
    }
    if size.y < THIN * size.x.max(size.z) && size.y < size.x.min(size.z) {
        // 45° above.
        return Vec3::new(usual.x, usual.xz().length(), usual.z);
    }
    let is_thin = size.x < THIN * size.z && size.x < size.y;
    if is_thin { Vec3::new(usual.z, usual.y, usual.x) } else { usual }
}

/// The four planes through the eye that bound the framed points, with a margin to the image's sides. The planes' slopes do not
/// depend on the eye's position; each plane is determined by the outermost point.
struct Frame {
    /// Origin of the coordinates, for float precision far from the world's origin; world space, m.
    center: Vec3,
    world_from_turned: Mat3,
    /// Slopes of the planes, x and y over distance along the view axis: those of the image's sides times [`FILL`].
    slope: Vec2,
    /// Outermost plane offsets of the points, m: max(x + slope z) and so on for the right, top, left and bottom plane, where z points
    /// towards the eye; then max(z).
    reach: [f32; 5],
}

impl Frame {
    fn new(center: Vec3, towards_eye: Vec3, fov_y: f32, aspect: f32) -> Self {
        // Only the rotation is used.
        let projection = Projection::Perspective { fov_y, near: 1.0 };
        let world_from_turned = Camera::look_at(towards_eye, Vec3::ZERO, projection).world_from_camera.matrix3.into();
        let slope = FILL * Vec2::new(aspect, 1.0) * (0.5 * fov_y).tan();
        Self { center, world_from_turned, slope, reach: [f32::NEG_INFINITY; 5] }
    }

    /// Outermost plane offsets of these points: see the field `reach`.
    fn reach(&self, points: &[Vec3], world_from_points: &Affine3A) -> [f32; 5] {
        let center = Affine3A::from_translation(-self.center);
        let turned = Affine3A::from_mat3(self.world_from_turned.transpose()) * center * *world_from_points;
        let mut reach = [f32::NEG_INFINITY; 5];
        for point in points {
            let p = turned.transform_point3a(Vec3A::from(*point));
            let (x, y) = (self.slope.x * p.z, self.slope.y * p.z);
            let outer = [x + p.x, y + p.y, x - p.x, y - p.y, p.z];
            reach = std::array::from_fn(|i| reach[i].max(outer[i]));
        }
        reach
    }

    fn is_exceeded_by(&self, points: &[Vec3], world_from_points: &Affine3A) -> bool {
        self.reach(points, world_from_points).iter().zip(self.reach).any(|(outer, own)| *outer > own)
    }

    fn add(&mut self, points: &[Vec3], world_from_points: &Affine3A) {
        let outer = self.reach(points, world_from_points);
        self.reach = std::array::from_fn(|i| self.reach[i].max(outer[i]));
    }

    /// The nearest camera whose planes bound all points. The margins on opposite sides are equal.
    fn camera(&self, bounds: &Bounds, fov_y: f32) -> Camera {
        let [right, top, left, bottom, nearest] = self.reach;
        let near = near_plane(bounds);
        let back = ((right + left) / (2.0 * self.slope.x)).max((top + bottom) / (2.0 * self.slope.y));
        // A point, or a line towards the eye, has no width.
        let back = back.max(nearest + 2.0 * near);
        let eye = Vec3::new(0.5 * (right - left), 0.5 * (top - bottom), back);
        let world_from_camera =
            Affine3A::from_mat3_translation(self.world_from_turned, self.center + self.world_from_turned * eye);
        let projection = Projection::Perspective { fov_y, near };
        Camera { name: String::new(), world_from_camera, projection }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Instance, Mesh, Primitive};

    /// Least and greatest x and y of the projected points, in −1..=1 for the image. All must be before the eye.
    fn extent(camera: &Camera, aspect: f32, points: impl Iterator<Item = Vec3>) -> [f32; 4] {
        let Projection::Perspective { fov_y, near } = camera.projection else { panic!("{camera:?}") };
        let camera_from_world = camera.world_from_camera.inverse();
        let slope = Vec2::new(aspect, 1.0) * (0.5 * fov_y).tan();
        let mut extent = [f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY];
        for point in points {
            let p = camera_from_world.transform_point3(point);
            assert!(-p.z > near, "{p} is behind the near plane");
            let (x, y) = (p.x / (-p.z * slope.x), p.y / (-p.z * slope.y));
            extent = [extent[0].min(x), extent[1].min(y), extent[2].max(x), extent[3].max(y)];
        }
        extent
    }

    /// A ball, a pole, a plate, a ring of twenty pieces far from the origin, and a mirrored cone.
    fn shapes() -> Vec<Scene> {
        let ball = |i: usize| {
            let (a, b) = (0.1 * i as f32, 0.37 * i as f32);
            Vec3::new(a.sin() * b.cos(), b.sin(), a.cos() * b.cos())
        };
        let cone = |i: usize| {
            let height = (i % 50) as f32 / 50.0;
            let ring = Vec3::new((i as f32).sin(), 0.0, (i as f32).cos());
            (1.0 - height) * ring + 3.0 * height * Vec3::Y
        };
        let scene = |positions: Vec<Vec3>, placed: Vec<Affine3A>| Scene {
            meshes: vec![Mesh { primitives: vec![Primitive { positions, ..Primitive::default() }], ..Mesh::default() }],
            instances: placed
                .into_iter()
                .map(|world_from_object| Instance { name: String::new(), mesh: 0, world_from_object })
                .collect(),
            ..Scene::default()
        };
        let balls = || (0..500).map(ball).collect::<Vec<_>>();
        let stretched = |x, y, z| Affine3A::from_scale(Vec3::new(x, y, z));
        let ring = |i: usize| {
            let angle = i as f32 * 0.314;
            let place = Vec3::new(900.0 + 7.0 * angle.sin(), 40.0, -300.0 + 7.0 * angle.cos());
            Affine3A::from_translation(place) * Affine3A::from_rotation_y(angle)
        };
        vec![
            scene(balls(), vec![stretched(2.0, 2.0, 2.0)]),
            scene(balls(), vec![stretched(1.0, 4.0, 1.0)]),
            scene(balls(), vec![stretched(30.0, 0.1, 20.0)]),
            scene(balls(), (0..20).map(ring).collect()),
            scene((0..500).map(cone).collect(), vec![stretched(-1.0, 1.0, 1.0) * Affine3A::from_rotation_x(0.4)]),
        ]
    }

    #[test]
    fn framed_objects_fill_four_fifths_of_the_tighter_dimension() {
        for (i, scene) in shapes().iter().enumerate() {
            let points = || {
                let placed = |at: &Instance| {
                    let at = at.world_from_object;
                    scene.meshes[0].primitives[0]
                        .positions
                        .iter()
                        .map(move |p| at.transform_point3(*p))
                        .collect::<Vec<_>>()
                };
                scene.instances.iter().flat_map(placed)
            };
            for side in std::iter::once(None).chain(Viewpoint::ALL.iter().copied().map(Some)) {
                for (aspect, fov_y) in [(16.0 / 9.0, 0.785), (1.0, 0.3), (0.5, 1.2), (3.0, 0.6)] {
                    let camera = Camera::framing_scene(scene, side, fov_y, aspect);
                    let [left, bottom, right, top] = extent(&camera, aspect, points());
                    let what = format!("shape {i}, {side:?}, {aspect}: {left} to {right}, {bottom} to {top}");
                    let widest = (0.5 * (right - left)).max(0.5 * (top - bottom));
                    assert!((widest - 0.8).abs() < 2e-3, "{what}");
                    assert!(left > -0.803 && bottom > -0.803 && right < 0.803 && top < 0.803, "{what}");
                }
            }
        }
    }

    #[test]
    fn flat_and_thin_objects_show_their_broad_side() {
        let of = |x, y, z| {
            let half = 0.5 * Vec3::new(x, y, z);
            usual_direction(&Bounds { min: -half, max: half }).normalize()
        };
        assert_eq!(of(1.0, 1.0, 1.0), THREE_QUARTER.normalize());
        assert!(of(2.0, 0.3, 5.0).y > 0.7 && of(0.1, 1.0, 1.0).x > 0.8 && of(1.0, 1.0, 0.001) == Vec3::Z);
        assert!(of(0.3, 2.0, 0.4) == THREE_QUARTER.normalize(), "a pillar");
    }

    #[test]
    fn sides_are_those_of_an_observer_who_faces_the_front() {
        let scene = &shapes()[0];
        let camera = |side| Camera::framing_scene(scene, Some(side), 0.8, 1.0);
        let right_of = |side| camera(side).world_from_camera.transform_vector3(Vec3::X);
        assert!(right_of(Viewpoint::Front).abs_diff_eq(Vec3::X, 1e-6));
        assert!(right_of(Viewpoint::Back).abs_diff_eq(Vec3::NEG_X, 1e-6));
        assert!(right_of(Viewpoint::Right).abs_diff_eq(Vec3::NEG_Z, 1e-6));
        assert!(right_of(Viewpoint::Left).abs_diff_eq(Vec3::Z, 1e-6));
        assert!(right_of(Viewpoint::Top).abs_diff_eq(Vec3::X, 1e-6));
        assert!(camera(Viewpoint::Top).eye().y > 2.0 && camera(Viewpoint::Iso).eye().min_element() > 1.0);
    }

    #[test]
    fn cards_are_seen_from_the_front_and_turns_are_angles() {
        let scaled = |x, y, z| {
            let mut scene = shapes().swap_remove(0);
            scene.instances[0].world_from_object = Affine3A::from_scale(Vec3::new(x, y, z));
            scene
        };
        let towards_eye = |scene: &Scene, turn| {
            let camera = Camera::framing_turned(scene, turn, 0.8, 1.0);
            camera.world_from_camera.transform_vector3(Vec3::Z)
        };
        let usual = THREE_QUARTER.normalize();
        for (scene, expected) in [
            (scaled(2.0, 3.0, 0.01), Vec3::Z),
            (scaled(2.0, 0.01, 3.0), Vec3::new(0.4, 0.4f32.hypot(1.0), 1.0).normalize()),
            (scaled(1.0, 1.0, 1.0), usual),
        ] {
            let camera = Camera::framing_scene(&scene, None, 0.8, 1.0);
            assert!(camera.world_from_camera.transform_vector3(Vec3::Z).abs_diff_eq(expected, 1e-6), "{camera:?}");
            assert!(towards_eye(&scene, [None, None]).abs_diff_eq(expected, 1e-6));
        }
        let ball = scaled(1.0, 1.0, 1.0);
        let [quarter, half] = [90f32, 180.0].map(f32::to_radians);
        assert!(towards_eye(&ball, [Some(quarter), Some(0.0)]).abs_diff_eq(Vec3::X, 1e-6));
        assert!(
            towards_eye(&ball, [Some(half), Some(0.5 * quarter)])
                .abs_diff_eq(Vec3::new(0.0, 1.0, -1.0).normalize(), 1e-6)
        );
        assert!(towards_eye(&ball, [Some(0.0), Some(-quarter)]).abs_diff_eq(Vec3::NEG_Y, 1e-6));
        assert!((towards_eye(&ball, [Some(0.0), None]).y - usual.y).abs() < 1e-6);
    }

    #[test]
    fn boxes_and_empty_scenes_are_framed() {
        for (size, aspect) in [(Vec3::new(9.0, 1.0, 2.0), 1.78), (Vec3::new(1.0, 7.0, 1.0), 0.5), (Vec3::ONE, 1.0)] {
            let bounds = Bounds { min: Vec3::splat(3.0), max: Vec3::splat(3.0) + size };
            let camera = Camera::framing(&bounds, 0.8, aspect);
            let [left, bottom, right, top] = extent(&camera, aspect, bounds.corners().into_iter());
            let widest = (0.5 * (right - left)).max(0.5 * (top - bottom));
            assert!((widest - 0.8).abs() < 1e-3 && left.min(bottom) > -0.801 && right.max(top) < 0.801, "{widest}");
        }
        let nothing = Camera::framing(&Bounds::EMPTY, 0.8, 1.5);
        assert_eq!(Camera::framing_scene(&Scene::default(), None, 0.8, 1.5), nothing);
        // An instance without triangles, as in a file that has only points or lines.
        let mut dust = shapes().swap_remove(0);
        dust.meshes[0].primitives.clear();
        assert_eq!(Camera::framing_scene(&dust, None, 0.8, 1.5), nothing);
        // A point has no size.
        let mut point = shapes().swap_remove(0);
        point.instances[0].world_from_object = Affine3A::from_scale(Vec3::splat(0.0));
        let camera = Camera::framing_scene(&point, None, 0.8, 1.0);
        assert!(camera.eye().is_finite() && camera.eye().length() > 1e-6);
    }
}
