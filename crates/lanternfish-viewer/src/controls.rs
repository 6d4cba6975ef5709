//! Moving a camera: flying, looking about, going round what is looked at. No window, no clock.

use glam::{Affine3A, Mat3A, Vec3, Vec3A};
use lanternfish_scene::Camera;

use crate::record::Move;

/// Radians that the camera turns by a point of the window.
const TURN: f32 = 0.005;
/// How near to straight up and down it looks, radians.
const STEEPEST: f32 = std::f32::consts::FRAC_PI_2 - 0.01;

/// A camera that is moved by hand. It stands upright: +y is up.
#[derive(Clone, Debug)]
pub struct Controls {
    /// The camera, where it is now.
    pub camera: Camera,
    /// How fast it flies, m/s.
    pub speed: f32,
    /// How far before it lies what it goes round, m.
    pub reach: f32,
    /// What it has done since somebody took them; none where nobody asks.
    pub moves: Option<Vec<Move>>,
}

/// Ways to fly, each −1 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Way {
    /// To the right.
    pub right: f32,
    /// Up, of the world.
    pub up: f32,
    /// Where it looks.
    pub forward: f32,
}

impl Controls {
    /// `size`: of the scene, m: it is crossed in a few seconds.
    pub fn new(camera: Camera, size: f32) -> Self {
        let size = if size.is_finite() && size > 0.0 { size } else { 1.0 };
        Self { camera, speed: 0.2 * size, reach: 0.4 * size, moves: None }
    }

    fn note(&mut self, one: Move) {
        self.moves.iter_mut().for_each(|moves| moves.push(one.clone()));
    }

    /// Where it is, world space, m.
    pub fn eye(&self) -> Vec3 {
        self.camera.world_from_camera.translation.into()
    }

    /// Where it looks, unit, world space.
    pub fn forward(&self) -> Vec3 {
        Vec3::from(-self.camera.world_from_camera.matrix3.z_axis).normalize_or(Vec3::NEG_Z)
    }

    /// Heading about +y and height above the horizon, radians.
    fn angles(&self) -> (f32, f32) {
        let forward = self.forward();
        (forward.x.atan2(-forward.z), forward.y.clamp(-1.0, 1.0).asin())
    }

    fn turn_to(&mut self, heading: f32, height: f32) {
        let height = height.clamp(-STEEPEST, STEEPEST);
        let turned = Mat3A::from_rotation_y(-heading) * Mat3A::from_rotation_x(height);
        self.camera.world_from_camera.matrix3 = turned;
    }

    /// Looks about: by points of the window to the right and down.
    pub fn look(&mut self, right: f32, down: f32) {
        self.note(Move::Look(right, down));
        let (heading, height) = self.angles();
        self.turn_to(heading + TURN * right, height - TURN * down);
    }

    /// Goes round what lies before it.
    pub fn orbit(&mut self, right: f32, down: f32) {
        self.note(Move::Orbit(right, down));
        let middle = self.eye() + self.reach * self.forward();
        let (heading, height) = self.angles();
        self.turn_to(heading + TURN * right, height - TURN * down);
        let eye = middle - self.reach * self.forward();
        self.camera.world_from_camera.translation = Vec3A::from(eye);
    }

    /// Looks at a point, world space, m, and goes round it from now on. A point at the eye is no point to look at: nothing is done.
    pub fn focus(&mut self, p: Vec3) {
        let towards = p - self.eye();
        let (distance, Some(forward)) = (towards.length(), towards.try_normalize()) else { return };
        self.turn_to(forward.x.atan2(-forward.z), forward.y.clamp(-1.0, 1.0).asin());
        self.reach = distance;
    }

    /// Flies for so many seconds.
    pub fn fly(&mut self, way: Way, seconds: f32) {
        self.note(Move::Fly(way, seconds));
        let Affine3A { matrix3, .. } = self.camera.world_from_camera;
        let step = way.right * matrix3.x_axis - way.forward * matrix3.z_axis + way.up * Vec3A::Y;
        self.camera.world_from_camera.translation += self.speed * seconds * step;
    }

    /// Flies faster, or slower for notches below 0.
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
    use lanternfish_scene::Projection;

    use super::*;

    fn controls() -> Controls {
        let projection = Projection::Perspective { fov_y: 0.8, near: 0.1 };
        let camera = Camera::look_at(Vec3::new(1.0, 2.0, 5.0), Vec3::Y, projection);
        Controls::new(camera, 10.0)
    }

    #[test]
    fn a_camera_that_looks_about_stays_upright_and_comes_back() {
        let mut moved = controls();
        let start = moved.camera.world_from_camera;
        moved.look(0.0, 0.0);
        assert!(moved.camera.world_from_camera.abs_diff_eq(start, 1e-5), "turning by nothing is nothing");
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
    fn what_is_gone_round_stays_in_the_middle() {
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
    fn what_is_focused_on_is_in_the_middle_and_is_gone_round() {
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
}
