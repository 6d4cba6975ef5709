//! Recording and replay of camera moves, step by step [VanGelderen2020, §6.1.1].
//!
//! While a window records, time advances by a fixed step, whatever the frame time. Replayed moves therefore give the
//! same cameras bit for bit, without a window.

use super::{Controls, Way};
use crate::Camera;

/// One move of a camera.
#[derive(Clone, Debug, PartialEq)]
pub enum Move {
    /// Looks around, by a pointer motion to the right and down, points.
    Look(f32, f32),
    /// Orbits, by a pointer motion to the right and down, points.
    Orbit(f32, f32),
    /// Flies in a direction for a time, s.
    Fly(Way, f32),
    /// Changes the fly speed by wheel notches.
    Accelerate(f32),
    /// Moves towards the orbit centre, by wheel notches.
    Dolly(f32),
    /// Sets the camera, its fly speed in m/s and its orbit distance in m, after a change that is not a move.
    Place(Camera, f32, f32),
}

/// All moves of a camera, from its initial state on.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The initial camera.
    pub first: Camera,
    /// Initial fly speed, m/s.
    pub speed: f32,
    /// Initial distance to the orbit centre, m.
    pub reach: f32,
    /// Length of a step, s.
    pub step: f32,
    /// The moves of each step, in order.
    pub steps: Vec<Vec<Move>>,
}

impl Recording {
    /// The camera after each step.
    pub fn cameras(&self) -> Vec<Camera> {
        let mut controls = self.start();
        let after = |moves: &Vec<Move>| {
            moves.iter().for_each(|one| controls.make(one));
            controls.camera.clone()
        };
        self.steps.iter().map(after).collect()
    }

    fn start(&self) -> Controls {
        let mut controls = Controls::new(self.first.clone(), 1.0);
        (controls.speed, controls.reach) = (self.speed, self.reach);
        controls
    }
}

impl Controls {
    /// Executes a move.
    pub fn make(&mut self, one: &Move) {
        match one {
            Move::Look(right, down) => self.look(*right, *down),
            Move::Orbit(right, down) => self.orbit(*right, *down),
            Move::Fly(way, seconds) => self.fly(*way, *seconds),
            Move::Accelerate(notches) => self.accelerate(*notches),
            Move::Dolly(notches) => self.dolly(*notches),
            Move::Place(camera, speed, reach) => {
                (self.camera, self.speed, self.reach) = (camera.clone(), *speed, *reach);
            }
        }
    }
}

/// Stores a completed recording. The error is a message for the user.
pub type RecordKeeper = Box<dyn Fn(&Recording) -> Result<(), String>>;

/// Records the moves of a camera.
pub struct Recorder {
    recording: Recording,
    /// The camera state after replay of the recorded moves. It differs from the recorded camera only after a change
    /// that is not a move.
    follower: Controls,
    keep: RecordKeeper,
}

impl Recorder {
    /// Starts a recording of the moves of `controls`. `step`: length of a step, s.
    pub fn begin(controls: &mut Controls, step: f32, keep: RecordKeeper) -> Self {
        controls.moves = Some(Vec::new());
        let Controls { camera, speed, reach, .. } = controls;
        let recording = Recording { first: camera.clone(), speed: *speed, reach: *reach, step, steps: Vec::new() };
        let follower = recording.start();
        Self { recording, follower, keep }
    }

    /// Camera time between two calls of [`Self::note`], s.
    pub fn step(&self) -> f32 {
        self.recording.step
    }

    /// Ends a step: takes the moves of `controls` since the last step.
    pub fn note(&mut self, controls: &mut Controls) {
        let mut moves = controls.moves.replace(Vec::new()).unwrap_or_default();
        moves.iter().for_each(|one| self.follower.make(one));
        let state = |c: &Controls| (c.camera.clone(), c.speed, c.reach);
        if state(&self.follower) != state(controls) {
            let placed = Move::Place(controls.camera.clone(), controls.speed, controls.reach);
            self.follower.make(&placed);
            moves.push(placed);
        }
        self.recording.steps.push(moves);
    }

    /// Ends the recording, and passes it to the keeper.
    pub fn end(self) -> Result<(), String> {
        (self.keep)(&self.recording)
    }
}

#[cfg(test)]
mod tests {
    use std::{cell::RefCell, rc::Rc};

    use glam::Vec3;

    use super::*;
    use crate::Projection;

    fn controls() -> Controls {
        let projection = Projection::Perspective { fov_y: 0.8, near: 0.1 };
        Controls::new(Camera::look_at(Vec3::new(1.0, 2.0, 5.0), Vec3::Y, projection), 10.0)
    }

    /// Records the moves of `hand` in `steps` steps. Returns the recording, and the camera after each step.
    fn recorded(steps: u32, mut hand: impl FnMut(u32, &mut Controls)) -> (Recording, Vec<Camera>) {
        let stored = Rc::new(RefCell::new(None));
        let keep = {
            let stored = Rc::clone(&stored);
            Box::new(move |recording: &Recording| {
                *stored.borrow_mut() = Some(recording.clone());
                Ok(())
            })
        };
        let mut controls = controls();
        let mut recorder = Recorder::begin(&mut controls, 1.0 / 60.0, keep);
        let mut cameras = Vec::new();
        for step in 0..steps {
            hand(step, &mut controls);
            recorder.note(&mut controls);
            cameras.push(controls.camera.clone());
        }
        recorder.end().unwrap();
        let recording = stored.borrow_mut().take().unwrap();
        (recording, cameras)
    }

    fn bits(camera: &Camera) -> Vec<u32> {
        camera.world_from_camera.to_cols_array().map(f32::to_bits).into()
    }

    #[test]
    fn replayed_cameras_equal_the_recorded_ones_bit_for_bit() {
        let (recording, cameras) = recorded(500, |i, controls| {
            let wave = (i as f32 * 0.37).sin();
            match i % 7 {
                0 => {}
                1 => controls.look(3.0 * wave, -1.7),
                2 => controls.orbit(0.1 + wave, 2.3 * wave),
                3 => controls.accelerate(wave),
                4 => controls.dolly(wave),
                _ => {
                    controls.look(wave, 0.3);
                    controls.fly(Way { right: wave, up: 0.2, forward: 1.0 }, 1.0 / 60.0);
                }
            }
        });
        let again = recording.cameras();
        assert_eq!((recording.steps.len(), again.len()), (500, 500));
        assert_eq!(recording.steps[0], []);
        assert!(again.iter().zip(&cameras).all(|(again, camera)| bits(again) == bits(camera)));
        assert_ne!(bits(&again[0]), bits(&again[499]));
        // Check that the comparison detects one different move.
        let mut other = recording;
        other.steps[1] = vec![Move::Look(0.0, -1.7)];
        assert_ne!(bits(&other.cameras()[499]), bits(&cameras[499]));
    }

    #[test]
    fn changes_that_are_not_moves_are_recorded_as_places() {
        let (recording, cameras) = recorded(6, |i, controls| match i {
            2 => controls.camera = Camera::look_at(Vec3::ONE, Vec3::ZERO, controls.camera.projection),
            4 => *controls = Controls::new(controls.camera.clone(), 99.0),
            _ => controls.fly(Way { forward: 1.0, ..Way::default() }, 0.1),
        });
        let again = recording.cameras();
        assert!(again.iter().zip(&cameras).all(|(again, camera)| bits(again) == bits(camera)));
        let placed: Vec<_> = (0..6).filter(|i| matches!(recording.steps[*i][..], [Move::Place(..)])).collect();
        assert_eq!(placed, [2, 4]);
    }
}
