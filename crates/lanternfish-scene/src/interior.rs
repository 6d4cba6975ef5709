//! Scenes that are looked at from inside: rooms whose walls face inwards.

use std::collections::HashSet;

use glam::{Mat3, Vec2, Vec3};

use crate::{
    Bounds, Camera, Projection, Scene, near_plane,
    sight::{Face, Hit, look},
};

/// Cells a side of what is looked at from outside.
const OUTSIDE_CELLS: usize = 16;
/// Cells a side of the cube around a place inside.
const INSIDE_CELLS: usize = 8;
/// Triangles for each ray that meets one, below which what is seen from outside is plain.
const MOST_PLAIN: f32 = 0.25;
/// How many times as many are seen within a room that is worth entering.
const RICHER: f32 = 4.0;
/// Harmonic mean of the distances around a place, below which it is no room, as a share of the scene's size.
const LEAST_FREEDOM: f32 = 0.02;
/// Height of an eye over the bottom of a scene's box, as a share of its height.
const EYE_HEIGHT: f32 = 0.3;

impl Camera {
    /// A camera for a scene that has none, and whether it stands in a room: as [`Camera::framing_scene`] of no side, or
    /// in a room, level, along its length. `None` for `fov_y` is 45° outside and 60° inside.
    ///
    /// A room is a place around which at least half of the directions meet a surface, and nine tenths of these its
    /// front. It is looked at from inside if from outside most surfaces turn their backs, or if from outside plain walls
    /// are seen and inside there is much more detail: four times as many triangles for as many rays.
    pub fn overview(scene: &Scene, fov_y: Option<f32>, aspect: f32) -> (Self, bool) {
        let outside = Self::framing_scene(scene, None, fov_y.unwrap_or(45f32.to_radians()), aspect);
        let seen = Seen::through(scene, &outside, aspect);
        // Neither walls that turn their backs, nor large plain ones.
        if seen.surfaces == 0.0 || (seen.fronts > 0.5 && seen.detail > MOST_PLAIN) {
            return (outside, false);
        }
        let room = Room::of(scene).filter(|room| seen.fronts <= 0.5 || room.seen.detail > RICHER * seen.detail);
        match room {
            Some(room) => (room.camera(scene, &scene.bounds(), fov_y.unwrap_or(60f32.to_radians())), true),
            None => (outside, false),
        }
    }

    /// Whether light from outside can hardly reach the place of this camera: nearly every ray from it meets a surface.
    pub fn is_enclosed(&self, scene: &Scene) -> bool {
        let seen = look(scene, self.eye(), &Face::cube(), INSIDE_CELLS);
        seen.iter().filter(|hit| hit.is_none()).count() * 50 < seen.len()
    }
}

/// What some rays hit.
struct Seen {
    /// Share of the rays that meet a surface.
    surfaces: f32,
    /// Share of these that meet its front.
    fronts: f32,
    /// Triangles met, for each of these: 1 where each meets another.
    detail: f32,
}

impl Seen {
    fn of(hits: &[Option<Hit>]) -> Self {
        let met: Vec<_> = hits.iter().flatten().collect();
        let count = met.len().max(1) as f32;
        let fronts = met.iter().filter(|hit| hit.is_front).count() as f32;
        let triangles: HashSet<_> = met.iter().map(|hit| hit.triangle).collect();
        Self {
            surfaces: met.len() as f32 / hits.len() as f32,
            fronts: if met.is_empty() { 1.0 } else { fronts / count },
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

/// A place that is within something.
struct Room {
    eye: Vec3,
    seen: Seen,
    /// Harmonic mean of the distances around, m: nothing is near where it is large.
    freedom: f32,
    /// How far one can see level, m, in directions turned evenly to the right from −z.
    level: Vec<f32>,
}

impl Room {
    /// The place with most room about it, of nine.
    fn of(scene: &Scene) -> Option<Self> {
        let bounds = scene.bounds();
        let quarters = [0.5, 0.25, 0.75];
        let places = quarters.iter().flat_map(|x| quarters.map(|z| Vec3::new(*x, EYE_HEIGHT, z)));
        let rooms = places.filter_map(|fraction| Self::around(scene, &bounds, bounds.min + fraction * bounds.size()));
        // The first of equals: the middle.
        rooms.reduce(|best, room| if room.freedom > best.freedom { room } else { best })
    }

    fn around(scene: &Scene, bounds: &Bounds, eye: Vec3) -> Option<Self> {
        let hits = look(scene, eye, &Face::cube(), INSIDE_CELLS);
        let seen = Seen::of(&hits);
        if seen.surfaces < 0.5 || seen.fronts < 0.9 {
            return None;
        }
        let longest = bounds.size().length();
        let depth = |hit: &Option<Hit>| hit.map_or(longest, |hit| hit.depth);
        let freedom = hits.len() as f32 / hits.iter().map(|hit| 1.0 / depth(hit)).sum::<f32>();
        // Within a plate, or a body of which only the skin is there.
        if freedom < LEAST_FREEDOM * longest {
            return None;
        }
        // The two rows about the horizon of the four sides.
        let cells = INSIDE_CELLS;
        let level = (0..4 * cells).map(|i| {
            let (face, column) = (i / cells, i % cells);
            let at = |row: usize| depth(&hits[(face * cells + row) * cells + column]);
            let across = (2 * column + 1) as f32 / cells as f32 - 1.0;
            at(cells / 2 - 1).min(at(cells / 2)) * across.hypot(1.0)
        });
        Some(Self { eye, seen, freedom, level: level.collect() })
    }

    /// The direction of the i-th level ray.
    fn direction(i: usize) -> Vec3 {
        let (face, column) = (i / INSIDE_CELLS, i % INSIDE_CELLS);
        let across = (2 * column + 1) as f32 / INSIDE_CELLS as f32 - 1.0;
        (Face::cube()[face].world_from_face * Vec3::new(across, 0.0, -1.0)).normalize()
    }

    /// Stands back to where the room ends, and looks along its length.
    fn camera(&self, scene: &Scene, bounds: &Bounds, fov_y: f32) -> Camera {
        let count = self.level.len();
        let opposite = |i: usize| (i + count / 2) % count;
        let length = |i: usize| self.level[i] + self.level[opposite(i)];
        // The first of equals, so that rounding does not choose.
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

/// Harmonic mean of the distances that a camera sees, m.
fn clearance(scene: &Scene, bounds: &Bounds, camera: &Camera) -> f32 {
    let face = Face { world_from_face: Mat3::from(camera.world_from_camera.matrix3), slope: Vec2::splat(0.6) };
    let seen = look(scene, camera.eye(), &[face], INSIDE_CELLS);
    let longest = bounds.size().length();
    seen.len() as f32 / seen.iter().map(|hit| 1.0 / hit.map_or(longest, |hit| hit.depth)).sum::<f32>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Instance, Material, Mesh, Primitive, Viewpoint, generate};
    use glam::Affine3A;

    /// A box of `size` about (5, 1, −7), whose faces look inwards or outwards; without those of `open`.
    fn walls(size: Vec3, inwards: bool, open: &[usize]) -> Scene {
        let mut primitive = Primitive::default();
        for face in (0..6).filter(|face| !open.contains(face)) {
            let first = primitive.positions.len() as u32;
            let turned = Face::cube()[face].world_from_face;
            // Counter-clockwise as seen from the middle.
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            primitive.positions.extend(corners.map(|(x, y)| turned * Vec3::new(x, y, -1.0)));
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
    fn rooms_are_looked_at_from_inside_along_their_length() {
        for (size, length) in [(Vec3::new(4.0, 3.0, 20.0), Vec3::Z), (Vec3::new(30.0, 6.0, 5.0), Vec3::X)] {
            // Closed, and with the sky above.
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
        // Far from the origin, where a metre beside the eye is the eye.
        let mut far = walls(Vec3::new(4e3, 3e3, 2e4), true, &[]);
        far.instances[0].world_from_object.translation += 1e9;
        let (camera, inside) = Camera::overview(&far, None, 1.78);
        assert!(inside && camera.validate().is_ok() && is_within(&far, camera.eye()), "{camera:?}");
        // A mirroring transform turns every triangle, and what is its front.
        for inwards in [true, false] {
            let mut mirrored = walls(Vec3::splat(4.0), inwards, &[]);
            mirrored.instances[0].world_from_object.matrix3.x_axis *= -1.0;
            assert_eq!(Camera::overview(&mirrored, None, 1.0).1, inwards);
        }
    }

    #[test]
    fn a_plain_house_with_a_rich_room_is_entered() {
        // Plain walls that face outwards about the court of the atrium, and about balls, open above.
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
    fn things_are_looked_at_from_outside() {
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
