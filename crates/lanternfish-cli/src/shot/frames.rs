//! The frames of a shot: which are rendered, their times and their cameras.

use std::f64::consts::TAU;

use super::Shot;
use crate::{
    args::ViewArgs,
    error::CliError,
    parse::{Frames, LightSet, PoseConvention},
};

/// One frame of a shot.
#[derive(Clone, Debug)]
pub struct ShotFrame {
    /// Number in the file's name; `None` for a single image.
    pub number: Option<u32>,
    /// Time, seconds; `None` if no flag sets it: the scene stays as the file has it.
    pub time: Option<f32>,
    /// The camera. Flags override the track.
    pub view: ViewArgs,
}

impl Shot {
    /// Refuses everything that can be refused before any work.
    pub(super) fn check(&self) -> Result<(), CliError> {
        let (when, view) = (&self.args.track, &self.args.view);
        if view.pose.is_none() && view.pose_convention != PoseConvention::default() {
            let hint = "add --pose, whose axes it states, or leave it out";
            return Err(CliError::new("--pose-convention without --pose", hint));
        }
        if let Some(count) = when.orbit {
            return self.check_orbit(count);
        }
        if when.time.is_some() && when.frames.is_some() {
            return Err(CliError::new("both --time and --frames", "give one: a single time or the sequence"));
        }
        if self.path.is_none() && matches!(when.frames, Some(Frames::Count(_))) {
            return Err(CliError::new(
                format!("--frames: {} has no camera track to divide into as many", self.args.scene),
                "say which frames: --frames 1-48; or render a shot (.toml) that has a [track]; `lanternfish shot SCENE` writes \
                 one to fill in (--accumulate N averages N frames of one image)",
            ));
        }
        match (&self.path, when.time) {
            // Other motion may continue after the camera has stopped.
            (Some(path), Some(time)) if !self.moves() && !(path.first()..=path.last()).contains(&time) => {
                Err(CliError::new(
                    format!("--time {time}: the camera track runs from {} to {} s", path.first(), path.last()),
                    "choose a time within it",
                ))
            }
            _ => Ok(()),
        }
    }

    /// Refuses what makes no sense with `--orbit`.
    fn check_orbit(&self, count: u32) -> Result<(), CliError> {
        if self.path.is_some() {
            let what = format!("{}: both --orbit and a camera track", self.args.scene);
            let hint = "each moves the camera: remove keyframes from [track], or leave --orbit (the key orbit) out";
            return Err(CliError::new(what, hint));
        }
        match self.args.track.frames {
            Some(Frames::Count(frames)) => Err(CliError::new(
                format!("--frames {frames} with --orbit {count}: which of the {count} frames?"),
                format!("say which: --frames 1-{frames}; or leave --frames out to render all {count}"),
            )),
            _ => Ok(()),
        }
    }

    /// True if flags request motion of something other than the camera.
    fn moves(&self) -> bool {
        self.args.track.animation.is_some() || matches!(self.args.lights.lights, Some(LightSet::Rain { .. }))
    }

    /// True if a time is requested but the camera stands still. If nothing in the scene moves either, the time has no effect.
    pub fn has_only_a_time(&self) -> bool {
        let when = &self.args.track;
        self.path.is_none() && when.orbit.is_none() && (when.time.is_some() || when.frames.is_some())
    }

    /// The frames, by ascending number.
    pub fn frames(&self) -> Vec<ShotFrame> {
        let when = &self.args.track;
        match (when.frames, when.orbit) {
            (Some(Frames::Span(span)), Some(count)) => {
                (span.first..=span.last).map(|i| self.on_orbit(i, count)).collect()
            }
            (_, Some(count)) => (1..=count).map(|i| self.on_orbit(i, count)).collect(),
            (None, None) => vec![self.at(None, self.time())],
            (Some(Frames::Count(count)), None) => {
                let time = |index| self.path.as_ref().map(|path| path.moment(index, count));
                (0..count).map(|index| self.at(Some(index + 1), time(index))).collect()
            }
            (Some(Frames::Span(span)), None) => {
                let time = |number| (f64::from(number) / f64::from(when.fps)) as f32;
                (span.first..=span.last).map(|number| self.at(Some(number), Some(time(number)))).collect()
            }
        }
    }

    /// The frame that sets light and exposure of all images: the first one. For frames by number it is the one at 0 s, and of an
    /// orbit frame 1, whichever are requested.
    pub fn first(&self) -> ShotFrame {
        let when = &self.args.track;
        match (when.frames, when.orbit) {
            (_, Some(count)) => self.on_orbit(1, count),
            (Some(Frames::Span(_)), None) => self.at(None, Some(0.0)),
            _ => self.frames().swap_remove(0),
        }
    }

    /// The frame so many frames' time later, or earlier if `steps` is negative, whichever other frames are requested. `None` if the frame has no
    /// time.
    pub fn beside(&self, frame: &ShotFrame, steps: i16) -> Option<ShotFrame> {
        if let (Some(count), Some(number)) = (self.args.track.orbit, frame.number) {
            return Some(self.after_steps(None, i64::from(number) - 1 + i64::from(steps), count));
        }
        let apart = match (self.args.track.frames, &self.path) {
            (Some(Frames::Count(count)), Some(path)) => path.moment(1, count.max(2)) - path.first(),
            _ => 1.0 / self.args.track.fps,
        };
        frame.time.map(|time| self.at(None, Some(time + f32::from(steps) * apart)))
    }

    /// The views of the frames.
    pub fn views(&self) -> Vec<ViewArgs> {
        self.frames().into_iter().map(|frame| frame.view).collect()
    }

    /// Time of a single image. A requested animation starts at 0 s.
    fn time(&self) -> Option<f32> {
        let when = &self.args.track;
        let start = || when.animation.as_ref().map(|_| 0.0);
        when.time.or_else(|| self.path.as_ref().map(|path| path.first())).or_else(start)
    }

    /// A frame of an orbit of `count` frames. Numbers beyond `count` repeat the revolution at later times.
    fn on_orbit(&self, number: u32, count: u32) -> ShotFrame {
        self.after_steps(Some(number), i64::from(number) - 1, count)
    }

    /// The frame so many steps of an orbit after its first.
    fn after_steps(&self, number: Option<u32>, steps: i64, count: u32) -> ShotFrame {
        let when = &self.args.track;
        let fraction = steps.rem_euclid(count.into()) as f64 / f64::from(count);
        let time = when.time.unwrap_or((steps as f64 / f64::from(when.fps)) as f32);
        let view = ViewArgs { orbit_angle: (fraction * TAU) as f32, ..self.args.view.clone() };
        ShotFrame { number, time: Some(time), view }
    }

    fn at(&self, number: Option<u32>, time: Option<f32>) -> ShotFrame {
        let view = &self.args.view;
        let on_path = self.path.as_ref().zip(time).map(|(path, time)| path.view(time, view));
        ShotFrame { number, time, view: on_path.unwrap_or_else(|| view.clone()) }
    }
}
