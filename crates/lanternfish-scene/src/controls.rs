//! Camera controls: fly, look around, orbit, dolly. They use neither a window nor a clock.

mod recording;

use glam::{Affine3A, Mat3A, Vec3, Vec3A};

pub use self::recording::{Move, RecordKeeper, Recorder, Recording};
use crate::{Camera, Projection};

/// Rotation of the camera, radians per point of pointer motion.
const RADIANS_PER_POINT: f32 = 0.005;
/// Least distance to the orbit centre after a dolly, s of flight.
const LEAST_REACH: f32 = 0.1;
/// Greatest elevation of the view direction, radians.
const MAX_ELEVATION: f32 = std::f32::consts::FRAC_PI_2 - 0.01;

/// A camera that the user moves. It has no roll: +y is up.
#[derive(Clone, Debug)]
pub struct Controls {
    /// The current camera.
    pub camera: Camera,
    /// Fly speed, m/s.
    pub speed: f32,
    /// Distance to the orbit centre along the view direction, m.
    pub reach: f32,
    /// Camera and orbit distance to which [`Self::go_home`] returns.
    home: (Camera, f32),
    /// The moves since they were last taken; `None` if moves are not recorded.
    pub moves: Option<Vec<Move>>,
}

/// A fly direction: each component is −1 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Way {
    /// To the right.
    pub right: f32,
    /// Up, along +y of the world.
    pub up: f32,
    /// Along the view direction.
    pub forward: f32,
}

impl Controls {
    /// Creates controls for a scene of `size` metres. The fly speed crosses the scene in 5 s.
    pub fn new(camera: Camera, size: f32) -> Self {
        let size = if size.is_finite() && size > 0.0 { size } else { 1.0 };
        let reach = 0.4 * size;
        Self { home: (camera.clone(), reach), camera, speed: 0.2 * size, reach, moves: None }
    }

    fn note(&mut self, one: Move) {
        self.moves.iter_mut().for_each(|moves| moves.push(one.clone()));
    }

    /// The camera's position, world space, m.
    pub fn eye(&self) -> Vec3 {
        self.camera.world_from_camera.translation.into()
    }

    /// The view direction, unit vector, world space.
    pub fn forward(&self) -> Vec3 {
        Vec3::from(-self.camera.world_from_camera.matrix3.z_axis).normalize_or(Vec3::NEG_Z)
    }

    /// Heading about +y and elevation above the horizon, radians.
    fn angles(&self) -> (f32, f32) {
        let forward = self.forward();
        (forward.x.atan2(-forward.z), forward.y.clamp(-1.0, 1.0).asin())
    }

    fn set_angles(&mut self, heading: f32, elevation: f32) {
        let elevation = elevation.clamp(-MAX_ELEVATION, MAX_ELEVATION);
        let rotation = Mat3A::from_rotation_y(-heading) * Mat3A::from_rotation_x(elevation);
        self.camera.world_from_camera.matrix3 = rotation;
    }

    /// Rotates the view direction by a pointer motion to the right and down, points.
    pub fn look(&mut self, right: f32, down: f32) {
        self.note(Move::Look(right, down));
        let (heading, elevation) = self.angles();
        self.set_angles(heading + RADIANS_PER_POINT * right, elevation - RADIANS_PER_POINT * down);
    }

    /// Orbits around the centre by a pointer motion to the right and down, points.
    pub fn orbit(&mut self, right: f32, down: f32) {
        self.note(Move::Orbit(right, down));
        let middle = self.eye() + self.reach * self.forward();
        let (heading, elevation) = self.angles();
        self.set_angles(heading + RADIANS_PER_POINT * right, elevation - RADIANS_PER_POINT * down);
        let eye = middle - self.reach * self.forward();
        self.camera.world_from_camera.translation = Vec3A::from(eye);
    }

    /// Looks at a point, world space, m, and makes it the orbit centre. Does nothing for a point at the eye.
    pub fn focus(&mut self, p: Vec3) {
        let towards = p - self.eye();
        let (distance, Some(forward)) = (towards.length(), towards.try_normalize()) else { return };
        self.set_angles(forward.x.atan2(-forward.z), forward.y.clamp(-1.0, 1.0).asin());
        self.reach = distance;
    }

    /// Flies for `seconds`.
    pub fn fly(&mut self, way: Way, seconds: f32) {
        self.note(Move::Fly(way, seconds));
        let Affine3A { matrix3, .. } = self.camera.world_from_camera;
        let step = way.right * matrix3.x_axis - way.forward * matrix3.z_axis + way.up * Vec3A::Y;
        self.camera.world_from_camera.translation += self.speed * seconds * step;
    }

    /// Moves towards the orbit centre, by a tenth of the distance to it per wheel notch; negative notches move away.
    /// Near the centre, the centre moves along. A parallel view gets smaller or larger.
    pub fn dolly(&mut self, notches: f32) {
        if notches == 0.0 {
            return;
        }
        self.note(Move::Dolly(notches));
        let least = LEAST_REACH * self.speed;
        let kept = 0.9f32.powf(notches);
        let step = self.reach.max(least) * (1.0 - kept);
        self.camera.world_from_camera.translation += Vec3A::from(step * self.forward());
        self.reach = (self.reach - step).max(least);
        if let Projection::Orthographic { half_height, .. } = &mut self.camera.projection {
            *half_height *= kept;
        }
    }

    /// Returns to the first camera.
    pub fn go_home(&mut self) {
        (self.camera, self.reach) = self.home.clone();
    }

    /// Multiplies the fly speed by 1.2 per wheel notch; negative notches slow it down.
    pub fn accelerate(&mut self, notches: f32) {
        if notches == 0.0 {
            return;
        }
        self.note(Move::Accelerate(notches));
        self.speed = (self.speed * 1.2f32.powf(notches)).clamp(1e-4, 1e6);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controls() -> Controls {
        let projection = Projection::Perspective { fov_y: 0.8, near: 0.1 };
        let camera = Camera::look_at(Vec3::new(1.0, 2.0, 5.0), Vec3::Y, projection);
        Controls::new(camera, 10.0)
    }

    #[test]
    fn a_camera_that_looks_around_stays_upright() {
        let mut moved = controls();
        let start = moved.camera.world_from_camera;
        moved.look(0.0, 0.0);
        assert!(moved.camera.world_from_camera.abs_diff_eq(start, 1e-5), "a rotation by 0 changes nothing");
        for (right, down) in [(300.0, 40.0), (-120.0, 90.0), (5000.0, -4000.0), (20.0, 9000.0)] {
            moved.look(right, down);
            let sideways: Vec3 = moved.camera.world_from_camera.matrix3.x_axis.into();
            assert!(sideways.y.abs() < 1e-5, "the horizon is level");
            assert!((moved.camera.world_from_camera.matrix3.determinant() - 1.0).abs() < 1e-4);
            assert!(moved.forward().y.abs() < 1.0);
            assert_eq!(moved.camera.world_from_camera.translation, start.translation);
        }
        let mut to_the_right = controls();
        let before = to_the_right.forward();
        to_the_right.look(10.0, 0.0);
        assert!(before.cross(to_the_right.forward()).y < 0.0, "to the right is clockwise from above");
    }

    #[test]
    fn the_orbit_centre_stays_in_the_middle() {
        let mut moved = controls();
        let middle = moved.eye() + moved.reach * moved.forward();
        for _ in 0..50 {
            moved.orbit(37.0, 3.0);
            let now = moved.eye() + moved.reach * moved.forward();
            assert!(now.abs_diff_eq(middle, 1e-3), "{now} for {middle}");
        }
        assert!(!moved.eye().abs_diff_eq(controls().eye(), 0.1));
    }

    #[test]
    fn the_focused_point_is_centred_and_becomes_the_orbit_centre() {
        let mut moved = controls();
        let (eye, p) = (moved.eye(), Vec3::new(-2.0, 0.5, 3.0));
        moved.focus(p);
        assert!(moved.eye() == eye && moved.forward().abs_diff_eq((p - eye).normalize(), 1e-5));
        for _ in 0..20 {
            moved.orbit(31.0, -7.0);
            assert!((moved.eye() + moved.reach * moved.forward()).abs_diff_eq(p, 1e-3));
        }
        let before = moved.clone();
        moved.focus(moved.eye());
        assert!(moved.camera == before.camera && moved.reach == before.reach);
    }

    #[test]
    fn it_flies_where_it_looks_at_its_speed() {
        let mut moved = controls();
        let (eye, forward) = (moved.eye(), moved.forward());
        moved.fly(Way { forward: 1.0, ..Way::default() }, 0.5);
        assert!((moved.eye() - eye - 0.5 * moved.speed * forward).length() < 1e-5);
        moved.fly(Way { up: -1.0, ..Way::default() }, 1.0);
        assert!(moved.eye().y < eye.y);
        let speed = moved.speed;
        moved.accelerate(2.0);
        moved.accelerate(-2.0);
        assert!((moved.speed - speed).abs() < 1e-4 && moved.speed > 0.0);
    }

    #[test]
    fn the_wheel_moves_towards_the_centre_and_back() {
        let mut moved = controls();
        let (eye, reach) = (moved.eye(), moved.reach);
        let middle = eye + reach * moved.forward();
        moved.dolly(2.0);
        assert!((moved.reach / reach - 0.81).abs() < 1e-5);
        assert!((moved.eye() + moved.reach * moved.forward()).abs_diff_eq(middle, 1e-4));
        moved.dolly(-2.0);
        assert!(moved.eye().abs_diff_eq(eye, 1e-4) && (moved.reach - reach).abs() < 1e-4);
        // It does not get stuck at the centre.
        (0..200).for_each(|_| moved.dolly(1.0));
        assert!((moved.eye() - middle).dot(moved.forward()) > 0.0, "{}", moved.eye());
        moved.camera.projection = Projection::Orthographic { half_height: 2.0, near: 0.0, far: 9.0 };
        moved.dolly(1.0);
        let Projection::Orthographic { half_height, .. } = moved.camera.projection else { unreachable!() };
        assert!((half_height - 1.8).abs() < 1e-5);
    }

    #[test]
    fn home_is_the_first_camera() {
        let mut moved = controls();
        let first = moved.clone();
        moved.orbit(70.0, 9.0);
        moved.dolly(5.0);
        moved.fly(Way { forward: 1.0, ..Way::default() }, 100.0);
        assert!(moved.camera != first.camera);
        moved.go_home();
        assert!(moved.camera == first.camera && moved.reach == first.reach);
    }
}
