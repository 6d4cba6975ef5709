//! Which frames of a shot are rendered, when they are, and where the camera is then.

use super::Shot;
use crate::{
    args::ViewArgs,
    error::CliError,
    parse::{Frames, LightSet},
};

/// An image of a shot.
#[derive(Clone, Debug)]
pub struct ShotFrame {
    /// What stands in its file's name; none where the shot is one image.
    pub number: Option<u32>,
    /// Seconds; none where nothing says a time: all is as the file has it.
    pub time: Option<f32>,
    /// What flags say of the camera stays as said; the rest follows the track.
    pub view: ViewArgs,
}

impl Shot {
    /// What can be refused before any work.
    pub(super) fn check(&self) -> Result<(), CliError> {
        let when = &self.args.track;
        if when.time.is_some() && when.frames.is_some() {
            return Err(CliError::new("both --time and --frames", "give one: a moment, or the whole sequence"));
        }
        if self.track.is_none() && matches!(when.frames, Some(Frames::Count(_))) {
            return Err(CliError::new(
                format!("--frames: {} has no camera track to divide into as many", self.args.scene),
                "say which frames: --frames 1-48; or render a shot (.toml) that has a [track]; `lanternfish shot SCENE` writes \
                 one to fill in (--accumulate N averages N frames of one image)",
            ));
        }
        match (&self.track, when.time) {
            // What else moves may go on when the camera stands.
            (Some(track), Some(time)) if !self.moves() && !(track.first()..=track.last()).contains(&time) => {
                Err(CliError::new(
                    format!("--time {time}: the camera track runs from {} to {} s", track.first(), track.last()),
                    "choose a moment of it",
                ))
            }
            _ => Ok(()),
        }
    }

    /// True if flags say that something moves beside the camera.
    fn moves(&self) -> bool {
        self.args.track.animation.is_some() || matches!(self.args.lights.lights, Some(LightSet::Rain { .. }))
    }

    /// Whether a time is requested, though the camera has no track: where nothing in the scene moves, it changes nothing.
    pub fn has_only_a_time(&self) -> bool {
        let when = &self.args.track;
        self.track.is_none() && (when.time.is_some() || when.frames.is_some())
    }

    /// The images, in the order of their numbers.
    pub fn frames(&self) -> Vec<ShotFrame> {
        match self.args.track.frames {
            None => vec![self.at(None, self.time())],
            Some(Frames::Count(count)) => {
                let time = |index| self.track.as_ref().map(|track| track.moment(index, count));
                (0..count).map(|index| self.at(Some(index + 1), time(index))).collect()
            }
            Some(Frames::Span(span)) => {
                let time = |number| (f64::from(number) / f64::from(self.args.track.fps)) as f32;
                (span.first..=span.last).map(|number| self.at(Some(number), Some(time(number)))).collect()
            }
        }
    }

    /// The moment by which light and exposure are chosen for all images: the first one; of frames by their numbers what is
    /// at 0 s, whichever of them are requested.
    pub fn first(&self) -> ShotFrame {
        match self.args.track.frames {
            Some(Frames::Span(_)) => self.at(None, Some(0.0)),
            _ => self.frames().swap_remove(0),
        }
    }

    /// What the motion of a frame is compared with: the moment a frame's time before it, whichever other frames are requested. None where
    /// nothing says when the frame is.
    pub fn before(&self, frame: &ShotFrame) -> Option<ShotFrame> {
        let apart = match (self.args.track.frames, &self.track) {
            (Some(Frames::Count(count)), Some(track)) => track.moment(1, count.max(2)) - track.first(),
            _ => 1.0 / self.args.track.fps,
        };
        frame.time.map(|time| self.at(None, Some(time - apart)))
    }

    /// One view an image.
    pub fn views(&self) -> Vec<ViewArgs> {
        self.frames().into_iter().map(|frame| frame.view).collect()
    }

    /// When a single image is. An animation that is requested starts at 0 s.
    fn time(&self) -> Option<f32> {
        let when = &self.args.track;
        let start = || when.animation.as_ref().map(|_| 0.0);
        when.time.or_else(|| self.track.as_ref().map(|track| track.first())).or_else(start)
    }

    fn at(&self, number: Option<u32>, time: Option<f32>) -> ShotFrame {
        let view = &self.args.view;
        let Some((track, time_on_track)) = self.track.as_ref().zip(time) else {
            return ShotFrame { number, time, view: view.clone() };
        };
        let moment = track.at(time_on_track);
        let is_free = view.view.is_none();
        let view = ViewArgs {
            eye: view.eye.or(moment.eye.filter(|_| is_free)),
            target: view.target.or(moment.target.filter(|_| is_free)),
            fov_y: view.fov_y.or(moment.fov_y),
            ..view.clone()
        };
        ShotFrame { number, time, view }
    }
}
