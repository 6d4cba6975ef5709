//! The camera of a shot over time: keyframes, or a recording of camera input.

use std::sync::Arc;

use glam::Affine3A;
use lanternfish_scene::{Camera, Move, Recording};

use super::track::Track;
use crate::args::ViewArgs;

/// A moving camera.
#[derive(Clone, Debug)]
pub enum CameraPath {
    Keyframes(Track),
    Recorded(RecordedPath),
}

impl CameraPath {
    /// Time of its start, seconds.
    pub fn first(&self) -> f32 {
        match self {
            Self::Keyframes(track) => track.first(),
            Self::Recorded(_) => 0.0,
        }
    }

    /// Time of its end, seconds.
    pub fn last(&self) -> f32 {
        match self {
            Self::Keyframes(track) => track.last(),
            Self::Recorded(path) => path.time(path.cameras.len().saturating_sub(1)),
        }
    }

    /// Time of frame `index` of `count`, seconds: the first frame is at the start, the last at the end.
    pub fn moment(&self, index: u32, count: u32) -> f32 {
        let (first, last) = (self.first(), self.last());
        if index + 1 == count && count > 1 {
            return last;
        }
        let fraction = f64::from(index) / f64::from((count - 1).max(1));
        (f64::from(first) + fraction * (f64::from(last) - f64::from(first))) as f32
    }

    /// The view at a time, seconds. What `flags` set goes before the path.
    pub fn view(&self, time: f32, flags: &ViewArgs) -> ViewArgs {
        match self {
            Self::Keyframes(track) => {
                let moment = track.at(time);
                let is_free = flags.view.is_none() && !flags.is_turned();
                ViewArgs {
                    eye: flags.eye.or(moment.eye.filter(|_| is_free)),
                    target: flags.target.or(moment.target.filter(|_| is_free)),
                    fov_y: flags.fov_y.or(moment.fov_y),
                    ..flags.clone()
                }
            }
            Self::Recorded(path) => {
                let is_free = flags.view.is_none() && !flags.is_turned() && flags.camera.is_none();
                ViewArgs { recorded: is_free.then(|| path.at(time)).flatten(), ..flags.clone() }
            }
        }
    }
}

/// The cameras of a recording.
#[derive(Clone, Debug)]
pub struct RecordedPath {
    /// The camera after each step.
    pub cameras: Arc<[Camera]>,
    /// Length of a step, seconds.
    step: f32,
    /// Steps at which the camera jumped, ascending.
    jumps: Arc<[usize]>,
}

impl RecordedPath {
    pub fn new(recording: &Recording) -> Self {
        let jumps =
            |(i, moves): (usize, &Vec<Move>)| moves.iter().any(|one| matches!(one, Move::Place(..))).then_some(i);
        Self {
            cameras: recording.cameras().into(),
            step: recording.step,
            jumps: recording.steps.iter().enumerate().filter_map(jumps).collect(),
        }
    }

    /// Time of a step, seconds: the first is at 0 s.
    pub fn time(&self, step: usize) -> f32 {
        (step as f64 * f64::from(self.step)) as f32
    }

    /// The camera at a time, seconds; `None` if there are no steps. Between two steps it is interpolated, except in a jump. After the end it is static.
    fn at(&self, time: f32) -> Option<Camera> {
        let last = self.cameras.len().checked_sub(1)?;
        let steps = (f64::from(time.max(0.0)) / f64::from(self.step)).min(last as f64);
        // The recorded camera itself at the time of a step, which was rounded.
        let nearest = steps.round() as usize;
        let below = if self.time(nearest) == time { nearest } else { steps as usize };
        let camera = &self.cameras[below];
        let is_between = self.time(below) < time && below < last && self.jumps.binary_search(&(below + 1)).is_err();
        if !is_between {
            return Some(camera.clone());
        }
        let (from, to) = (camera.world_from_camera, self.cameras[below + 1].world_from_camera);
        let fraction = (steps - below as f64) as f32;
        let [start, end] = [from, to].map(|pose| pose.to_scale_rotation_translation());
        let rotation = start.1.slerp(end.1, fraction);
        let pose = Affine3A::from_rotation_translation(rotation, start.2.lerp(end.2, fraction));
        Some(Camera { world_from_camera: pose, ..camera.clone() })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use lanternfish_scene::{Projection, Way};

    use super::{
        super::track::{Interpolation, Moment},
        *,
    };

    #[test]
    fn frames_run_from_the_first_keyframe_to_the_last() {
        let keyframes = [1.0, 3.0].map(|time| Moment { time, eye: Some(Vec3::X), ..Moment::default() }).into();
        let path = CameraPath::Keyframes(Track { interpolation: Interpolation::Linear, keyframes });
        assert_eq!([0, 1, 2].map(|i| path.moment(i, 3)), [1.0, 2.0, 3.0]);
        assert_eq!(path.moment(0, 1), 1.0);
        assert_eq!(path.moment(6, 7), 3.0);
    }

    #[test]
    fn a_recorded_path_is_exact_at_steps_smooth_between_and_cut_at_jumps() {
        let projection = Projection::Perspective { fov_y: 0.7, near: 0.05 };
        let far = Camera::look_at(Vec3::splat(50.0), Vec3::ZERO, projection);
        let fly = || Move::Fly(Way { forward: 1.0, ..Way::default() }, 0.1);
        let recording = Recording {
            first: Camera::look_at(Vec3::Z, Vec3::ZERO, projection),
            speed: 1.0,
            reach: 1.0,
            step: 1.0 / 60.0,
            steps: vec![
                vec![],
                vec![fly()],
                vec![Move::Look(20.0, 5.0)],
                vec![Move::Place(far, 1.0, 1.0)],
                vec![fly()],
            ],
        };
        let path = RecordedPath::new(&recording);
        let cameras = recording.cameras();
        for (i, camera) in cameras.iter().enumerate() {
            assert_eq!(path.at(path.time(i)).as_ref(), Some(camera), "step {i}");
        }
        let z = |steps: f32| path.at(steps / 60.0).unwrap().eye().z;
        assert!((z(0.25) - 0.975).abs() < 1e-5 && (z(0.5) - 0.95).abs() < 1e-5, "{} {}", z(0.25), z(0.5));
        let forward = |camera: &Camera| camera.world_from_camera.transform_vector3(Vec3::NEG_Z);
        let half = forward(&path.at(1.5 / 60.0).unwrap());
        let (before, after) = (forward(&cameras[1]), forward(&cameras[2]));
        assert!((half.angle_between(before) - half.angle_between(after)).abs() < 1e-3 && half.is_normalized());
        // No frame is halfway through a jump.
        assert_eq!(path.at(2.9 / 60.0).as_ref(), Some(&cameras[2]));
        assert_eq!((path.at(-1.0).as_ref(), path.at(9.0).as_ref()), (cameras.first(), cameras.last()));
        assert_eq!(RecordedPath::new(&Recording { steps: Vec::new(), ..recording }).at(0.0), None);
    }
}
