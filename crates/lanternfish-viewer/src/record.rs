//! What a hand does to a camera, kept step by step, and done again [VanGelderen2020, §6.1.1].
//!
//! Time goes by steps of one length while a window records, however long its frames take: so the same moves make the same cameras again, to
//! the bit, without a window.

use lanternfish_scene::Camera;

use crate::controls::{Controls, Way};

/// One thing that was done to a camera.
#[derive(Clone, Debug, PartialEq)]
pub enum Move {
    /// It looked about, by points of the window to the right and down.
    Look(f32, f32),
    /// It went round what lies before it, by points to the right and down.
    Orbit(f32, f32),
    /// It flew, for so many seconds.
    Fly(Way, f32),
    /// It became faster, by so many notches of the wheel.
    Accelerate(f32),
    /// It was put somewhere else by something other than the hand: its camera, its speed in m/s and its reach in m.
    Place(Camera, f32, f32),
}

/// Everything that was done to a camera, from its first place on.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Where it was at first.
    pub first: Camera,
    /// How fast it flew at first, m/s.
    pub speed: f32,
    /// How far before it lay what it went round, m.
    pub reach: f32,
    /// Seconds of a step.
    pub step: f32,
    /// What was done in each step, in its order.
    pub steps: Vec<Vec<Move>>,
}

impl Recording {
    /// Where the camera was after each step.
    pub fn cameras(&self) -> Vec<Camera> {
        let mut controls = self.start();
        let after = |moves: &Vec<Move>| {
            moves.iter().for_each(|one| controls.make(one));
            controls.camera.clone()
        };
        self.steps.iter().map(after).collect()
    }

    fn start(&self) -> Controls {
        Controls { speed: self.speed, reach: self.reach, ..Controls::new(self.first.clone(), 1.0) }
    }
}

impl Controls {
    /// Does again what was done.
    pub fn make(&mut self, one: &Move) {
        match one {
            Move::Look(right, down) => self.look(*right, *down),
            Move::Orbit(right, down) => self.orbit(*right, *down),
            Move::Fly(way, seconds) => self.fly(*way, *seconds),
            Move::Accelerate(notches) => self.accelerate(*notches),
            Move::Place(camera, speed, reach) => {
                (self.camera, self.speed, self.reach) = (camera.clone(), *speed, *reach);
            }
        }
    }
}

/// What becomes of a recording that has ended: it is written, or it is said why not.
pub type RecordKeeper = Box<dyn Fn(&Recording) -> Result<(), String>>;

/// Keeps what is done to a camera.
pub struct Recorder {
    recording: Recording,
    /// Where the kept moves have brought a camera: the one that is watched, unless something else has moved that.
    follower: Controls,
    keep: RecordKeeper,
}

impl Recorder {
    /// From now on `controls` remembers its moves. `step`: seconds of a step.
    pub fn begin(controls: &mut Controls, step: f32, keep: RecordKeeper) -> Self {
        controls.moves = Some(Vec::new());
        let Controls { camera, speed, reach, .. } = controls;
        let recording = Recording { first: camera.clone(), speed: *speed, reach: *reach, step, steps: Vec::new() };
        let follower = recording.start();
        Self { recording, follower, keep }
    }

    /// Seconds that pass for the camera from one [`Self::note`] to the next.
    pub fn step(&self) -> f32 {
        self.recording.step
    }

    /// Ends a step: takes what `controls` has done since the last.
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

    /// Ends the recording, and hands it on.
    pub fn end(self) -> Result<(), String> {
        (self.keep)(&self.recording)
    }
}

#[cfg(test)]
mod tests {
    use std::{cell::RefCell, rc::Rc};

    use glam::Vec3;
    use lanternfish_scene::Projection;

    use super::*;

    fn controls() -> Controls {
        let projection = Projection::Perspective { fov_y: 0.8, near: 0.1 };
        Controls::new(Camera::look_at(Vec3::new(1.0, 2.0, 5.0), Vec3::Y, projection), 10.0)
    }

    /// Records what `hand` does in `steps` steps: the recording, and the cameras that were there.
    fn recorded(steps: u32, mut hand: impl FnMut(u32, &mut Controls)) -> (Recording, Vec<Camera>) {
        let kept = Rc::new(RefCell::new(None));
        let keep = {
            let kept = Rc::clone(&kept);
            Box::new(move |recording: &Recording| {
                *kept.borrow_mut() = Some(recording.clone());
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
        let recording = kept.borrow_mut().take().unwrap();
        (recording, cameras)
    }

    fn bits(camera: &Camera) -> Vec<u32> {
        camera.world_from_camera.to_cols_array().map(f32::to_bits).into()
    }

    #[test]
    fn what_was_done_makes_the_same_cameras_to_the_bit() {
        let (recording, cameras) = recorded(500, |i, controls| {
            let wave = (i as f32 * 0.37).sin();
            match i % 7 {
                0 => {}
                1 => controls.look(3.0 * wave, -1.7),
                2 => controls.orbit(0.1 + wave, 2.3 * wave),
                3 => controls.accelerate(wave),
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
        // And it would be seen if one move were another.
        let mut other = recording;
        other.steps[1] = vec![Move::Look(0.0, -1.7)];
        assert_ne!(bits(&other.cameras()[499]), bits(&cameras[499]));
    }

    #[test]
    fn what_something_else_did_is_kept_as_a_place() {
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
