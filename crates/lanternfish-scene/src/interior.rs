//! Cameras for interiors: scenes with walls that face inwards.

use std::collections::HashSet;

use glam::{Mat3, Vec2, Vec3};

use crate::{
    Bounds, Camera, Projection, Scene,
    framing::THREE_QUARTER,
    near_plane,
    sight::{Face, Hit, look},
};

/// Rays per side of the image from outside.
const OUTSIDE_CELLS: usize = 16;
/// Rays per side of each cube face around a position inside.
const INSIDE_CELLS: usize = 8;
/// Visible triangles per ray hit below which the view from outside counts as plain.
const MOST_PLAIN: f32 = 0.25;
/// Minimum ratio of the detail inside a room to that outside for a view from inside.
const RICHER: f32 = 4.0;
/// Minimum harmonic mean of the distances around a position in a room, as a fraction of the scene's size.
const LEAST_FREEDOM: f32 = 0.02;
/// Height of the eye over the bottom of the scene's box, as a fraction of the box's height.
const EYE_HEIGHT: f32 = 0.3;

impl Camera {
    /// A camera for a scene that has none, and true if it is inside a room. Outside, it is [`Camera::framing_scene`] without a
    /// side; inside, it looks horizontally along the room's length. `fov_y` is in radians; `None`: 45° outside, 60° inside.
    ///
    /// A room is a position around which at least half of the rays hit a surface, and nine tenths of these its front. The
    /// camera is inside if most surfaces visible from outside are back faces, or if the view from outside shows plain walls
    /// and the view from inside has much more detail: four times as many triangles per ray hit.
    pub fn overview(scene: &Scene, fov_y: Option<f32>, aspect: f32) -> (Self, bool) {
        let outside = Self::framing_scene(scene, None, fov_y.unwrap_or(45f32.to_radians()), aspect);
        let level = Self::framing_from(scene, THREE_QUARTER, fov_y.unwrap_or(45f32.to_radians()), aspect);
        let stats = HitStats::through(scene, &level, aspect);
        // Neither back faces of walls, nor large plain walls.
        if stats.surfaces == 0.0 || (stats.fronts > 0.5 && stats.detail > MOST_PLAIN) {
            return (outside, false);
        }
        let room = Room::of(scene).filter(|room| stats.fronts <= 0.5 || room.stats.detail > RICHER * stats.detail);
        match room {
            Some(room) => (room.camera(scene, &scene.bounds(), fov_y.unwrap_or(60f32.to_radians())), true),
            None => (outside, false),
        }
    }

    /// True if hardly any light from outside can reach the camera's position: more than 98 % of the rays from it hit a surface.
    #[doc(hidden)]
    pub fn is_enclosed(&self, scene: &Scene) -> bool {
        let hits = look(scene, self.eye(), &Face::cube(), INSIDE_CELLS);
        hits.iter().filter(|hit| hit.is_none()).count() * 50 < hits.len()
    }
}

/// Statistics of ray hits.
struct HitStats {
    /// Fraction of the rays that hit a surface.
    surfaces: f32,
    /// Fraction of the hits that are on a front face.
    fronts: f32,
    /// Distinct triangles per hit; 1 if each ray hits another triangle.
    detail: f32,
}

impl HitStats {
    fn of(rays: &[Option<Hit>]) -> Self {
        let hits: Vec<_> = rays.iter().flatten().collect();
        let count = hits.len().max(1) as f32;
        let fronts = hits.iter().filter(|hit| hit.is_front).count() as f32;
        let triangles: HashSet<_> = hits.iter().map(|hit| hit.triangle).collect();
        Self {
            surfaces: hits.len() as f32 / rays.len() as f32,
            fronts: if hits.is_empty() { 1.0 } else { fronts / count },
            detail: triangles.len() as f32 / count,
        }
    }

    fn through(scene: &Scene, camera: &Camera, aspect: f32) -> Self {
        let slopes = camera.projection.slopes(aspect).expect("in perspective");
        let face =
            Face { world_from_face: camera.world_from_camera.matrix3.into(), slope: Vec2::new(slopes[1], slopes[3]) };
        Self::of(&look(scene, camera.eye(), &[face], OUTSIDE_CELLS))
    }
}

impl Scene {
    /// True if walls that face inwards enclose a place in the scene.
    #[doc(hidden)]
    pub fn is_room(&self) -> bool {
        Room::of(self).is_some()
    }
}

/// A position inside a room.
struct Room {
    eye: Vec3,
    stats: HitStats,
    /// Harmonic mean of the distances in all directions, m: large if no surface is near.
    freedom: f32,
    /// Horizontal distances, m, in evenly spaced directions from −z to the right.
    level: Vec<f32>,
}

impl Room {
    /// The position with the largest freedom, of nine.
    fn of(scene: &Scene) -> Option<Self> {
        let bounds = scene.bounds();
        let quarters = [0.5, 0.25, 0.75];
        let positions = quarters.iter().flat_map(|x| quarters.map(|z| Vec3::new(*x, EYE_HEIGHT, z)));
        let rooms =
            positions.filter_map(|fraction| Self::around(scene, &bounds, bounds.min + fraction * bounds.size()));
        // The first of equals, which is the centre.
        rooms.reduce(|best, room| if room.freedom > best.freedom { room } else { best })
    }

    fn around(scene: &Scene, bounds: &Bounds, eye: Vec3) -> Option<Self> {
        let hits = look(scene, eye, &Face::cube(), INSIDE_CELLS);
        let stats = HitStats::of(&hits);
        if stats.surfaces < 0.5 || stats.fronts < 0.9 {
            return None;
        }
        let longest = bounds.size().length();
        let depth = |hit: &Option<Hit>| hit.map_or(longest, |hit| hit.depth);
        let freedom = hits.len() as f32 / hits.iter().map(|hit| 1.0 / depth(hit)).sum::<f32>();
        // Inside a plate, or between the sides of a hollow body.
        if freedom < LEAST_FREEDOM * longest {
            return None;
        }
        // The two rows next to the horizon, of the four sides.
        let cells = INSIDE_CELLS;
        let level = (0..4 * cells).map(|i| {
            let (face, column) = (i / cells, i % cells);
            let at = |row: usize| depth(&hits[(face * cells + row) * cells + column]);
            let across = (2 * column + 1) as f32 / cells as f32 - 1.0;
            at(cells / 2 - 1).min(at(cells / 2)) * across.hypot(1.0)
        });
        Some(Self { eye, stats, freedom, level: level.collect() })
    }

    /// Direction of the i-th horizontal ray, unit length.
    fn direction(i: usize) -> Vec3 {
        let (face, column) = (i / INSIDE_CELLS, i % INSIDE_CELLS);
        let across = (2 * column + 1) as f32 / INSIDE_CELLS as f32 - 1.0;
        (Face::cube()[face].world_from_face * Vec3::new(across, 0.0, -1.0)).normalize()
    }

    /// A camera near the end of the room that looks along its length.
    fn camera(&self, scene: &Scene, bounds: &Bounds, fov_y: f32) -> Camera {
        let count = self.level.len();
        let opposite = |i: usize| (i + count / 2) % count;
        let length = |i: usize| self.level[i] + self.level[opposite(i)];
        // The first of nearly equal lengths, so that rounding does not decide.
        let longest = (1..count).fold(0, |best, i| if length(i) > 1.001 * length(best) { i } else { best });
        let projection = Projection::Perspective { fov_y, near: near_plane(bounds) };
        let views = [longest, opposite(longest)].into_iter().flat_map(|ahead| {
            [0.85, 0.5, 0.0].map(|fraction| {
                let direction = Self::direction(ahead);
                let eye = self.eye - fraction * self.level[opposite(ahead)] * direction;
                Camera::looking_along(eye, direction, projection)
            })
        });
        let rated = views.map(|camera| (clearance(scene, bounds, &camera), camera));
        let best = rated.reduce(|best, view| if view.0 > 1.05 * best.0 { view } else { best });
        best.expect("there are six").1
    }
}

/// Harmonic mean of the distances ahead of a camera, m.
fn clearance(scene: &Scene, bounds: &Bounds, camera: &Camera) -> f32 {
    let face = Face { world_from_face: Mat3::from(camera.world_from_camera.matrix3), slope: Vec2::splat(0.6) };
    let hits = look(scene, camera.eye(), &[face], INSIDE_CELLS);
    let longest = bounds.size().length();
    hits.len() as f32 / hits.iter().map(|hit| 1.0 / hit.map_or(longest, |hit| hit.depth)).sum::<f32>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Instance, Material, Mesh, Primitive, Viewpoint, generate};
    use glam::Affine3A;

    /// A box of `size` about (5, 1, −7) whose faces point inwards or outwards, without the faces in `open`.
    fn walls(size: Vec3, inwards: bool, open: &[usize]) -> Scene {
        let mut primitive = Primitive::default();
        for face in (0..6).filter(|face| !open.contains(face)) {
            let first = primitive.positions.len() as u32;
            let world_from_face = Face::cube()[face].world_from_face;
            // Counter-clockwise as seen from the middle.
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            primitive.positions.extend(corners.map(|(x, y)| world_from_face * Vec3::new(x, y, -1.0)));
            let order = if inwards { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
            primitive.indices.extend(order.map(|i| first + i));
        }
        let world_from_object =
            Affine3A::from_translation(Vec3::new(5.0, 1.0, -7.0)) * Affine3A::from_scale(0.5 * size);
        Scene {
            meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
            instances: vec![Instance { name: String::new(), mesh: 0, world_from_object }],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    fn is_within(scene: &Scene, p: Vec3) -> bool {
        let bounds = scene.bounds();
        p.cmpgt(bounds.min).all() && p.cmplt(bounds.max).all()
    }

    #[test]
    fn rooms_are_viewed_from_inside_along_their_length() {
        for (size, length) in [(Vec3::new(4.0, 3.0, 20.0), Vec3::Z), (Vec3::new(30.0, 6.0, 5.0), Vec3::X)] {
            // Closed, and open at the top.
            for open in [&[][..], &[4]] {
                let scene = walls(size, true, open);
                let (camera, inside) = Camera::overview(&scene, None, 1.78);
                assert!(inside && is_within(&scene, camera.eye()), "{size}, {open:?}: {camera:?}");
                let forward = camera.world_from_camera.transform_vector3(Vec3::NEG_Z);
                assert!(forward.dot(length).abs() > 0.9, "{size}: {forward}");
                let ahead = (camera.eye() - scene.bounds().center()).dot(forward);
                assert!(ahead < -0.2 * size.dot(length), "it stands back: {ahead}");
                assert_eq!(camera.is_enclosed(&scene), open.is_empty());
            }
        }
        // Far from the origin, where a point one metre from the eye rounds to the eye.
        let mut far = walls(Vec3::new(4e3, 3e3, 2e4), true, &[]);
        far.instances[0].world_from_object.translation += 1e9;
        let (camera, inside) = Camera::overview(&far, None, 1.78);
        assert!(inside && camera.validate().is_ok() && is_within(&far, camera.eye()), "{camera:?}");
        // A mirroring transform flips every triangle and its front.
        for inwards in [true, false] {
            let mut mirrored = walls(Vec3::splat(4.0), inwards, &[]);
            mirrored.instances[0].world_from_object.matrix3.x_axis *= -1.0;
            assert_eq!(Camera::overview(&mirrored, None, 1.0).1, inwards);
        }
    }

    #[test]
    fn a_plain_house_with_a_detailed_room_is_viewed_from_inside() {
        // Plain walls that face outwards around the court of the atrium, and around balls; open at the top.
        let crate_around = |mut scene: Scene| {
            let mut house = walls(Vec3::ONE, false, &[4]);
            let bounds = scene.bounds();
            house.meshes[0].primitives[0].material = 0;
            let size = Affine3A::from_scale(0.51 * bounds.size());
            house.instances[0].world_from_object = Affine3A::from_translation(bounds.center()) * size;
            house.instances[0].mesh = scene.meshes.len();
            scene.meshes.append(&mut house.meshes);
            scene.instances.append(&mut house.instances);
            scene
        };
        let court = crate_around(generate::demo("atrium").unwrap());
        let (camera, inside) = Camera::overview(&court, None, 1.78);
        assert!(inside && is_within(&court, camera.eye()), "{camera:?}");
        assert!(!Camera::overview(&crate_around(generate::demo("furnace").unwrap()), None, 1.78).1);
    }

    #[test]
    fn objects_are_viewed_from_outside() {
        let size = Vec3::new(4.0, 3.0, 3.0);
        // A solid box, a room open to the front, and a plate seen from behind.
        let front = 2;
        for scene in [walls(size, false, &[]), walls(size, true, &[front]), walls(size, true, &[0, 1, 3, 4, 5])] {
            let (camera, inside) = Camera::overview(&scene, None, 1.78);
            assert!(!inside, "{:?}", scene.bounds());
            assert_eq!(camera, Camera::framing_scene(&scene, None, 45f32.to_radians(), 1.78));
            assert!(!camera.is_enclosed(&scene));
        }
        for demo in ["cornell", "street", "furnace"] {
            assert!(!Camera::overview(&generate::demo(demo).unwrap(), None, 1.78).1, "{demo}");
        }
        assert!(!Camera::overview(&Scene::default(), None, 1.78).1);
        assert_eq!(Camera::framing_scene(&Scene::default(), Some(Viewpoint::Top), 0.8, 1.0).eye().x, 0.0);
    }
}
