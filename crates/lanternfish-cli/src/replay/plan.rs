//! The plan of a replay: a lit scene, and a camera for every frame.

use lanternfish::settings::{Indirect, Occlusion, Settings};
use lanternfish_scene::{Bounds, Camera, Eyes, Scene, generate::Rain};

use crate::{
    args::ViewArgs,
    camera,
    error::CliError,
    light_rig::{self, Lighting},
    motion::Motion,
    paper,
    parse::Size,
    progress::Progress,
    render::lit_scene,
    shot::{Shot, ShotFrame},
    stereo,
};

/// One frame.
#[derive(Clone, Debug)]
struct Step {
    /// Time, seconds; `None` if not set.
    time: Option<f32>,
    /// Flags that chose the camera; `None` for a recorded camera.
    view: Option<ViewArgs>,
    camera: Camera,
}

/// The frames of a shot.
fn steps_of(scene: &Scene, shot: &Shot, progress: &Progress) -> Result<Vec<Step>, CliError> {
    let (frames, size) = (shot.frames(), shot.args.output.size);
    let views: Vec<_> = frames.iter().map(|frame| frame.view.clone()).collect();
    let (cameras, is_inside) = camera::choose_each(scene, &Bounds::EMPTY, &views, size.aspect())?;
    if is_inside {
        progress.note(camera::INSIDE);
    }
    let step = |(frame, camera): (ShotFrame, Camera)| Step { time: frame.time, view: Some(frame.view), camera };
    Ok(frames.into_iter().zip(cameras).map(step).collect())
}

/// A deterministic simulation.
#[derive(Debug)]
pub struct Plan {
    /// The scene as loaded, at 0 s; later in the state of the last frame.
    pub scene: Scene,
    /// Renderer settings.
    pub settings: Settings,
    /// Size of one eye's image.
    pub size: Size,
    /// The two eyes; `None` in mono.
    pub eyes: Option<Eyes>,
    motion: Option<Motion>,
    bounds: Bounds,
    steps: Vec<Step>,
    /// Number of frames that are replayed.
    most: usize,
}

impl Plan {
    /// Plans a shot's frames, or recorded cameras in its scene. Each frame is rendered once, even if the shot averages
    /// frames.
    pub fn of(shot: &Shot, recorded: Option<Vec<(f32, Camera)>>, progress: &mut Progress) -> Result<Self, CliError> {
        let (args, size) = (&shot.args, shot.args.output.size);
        let mut settings = args.settings_of(1);
        paper::for_moving(args.paper, &mut settings);
        let (mut scene, motion) = lit_scene(args, progress)?;
        let is_recorded = recorded.is_some();
        let steps = match recorded {
            Some(recorded) => {
                recorded.into_iter().map(|(time, camera)| Step { time: Some(time), view: None, camera }).collect()
            }
            None => steps_of(&scene, shot, progress)?,
        };
        if is_recorded && steps.is_empty() {
            return Err(CliError::new(
                "the recording has none of these frames",
                "choose other --frames, or record again",
            ));
        }
        let lights = Lighting {
            is_seen: settings.image.debug_view.is_none(),
            reaches_surfaces: settings.indirect != Indirect::NONE || settings.occlusion != Occlusion::NONE,
            takes_ground: false,
            catches_shadows: false,
            is_metered: false,
        };
        light_rig::light(&mut scene, &args.lights, &steps[0].camera, lights, |note| progress.note(note))?;
        let bounds = scene.bounds();
        Ok(Self { scene, settings, size, motion, bounds, eyes: args.stereo.stereo, most: steps.len(), steps })
    }

    /// Leaves light rain as the only light and the only motion. About the same number of lights reaches each point,
    /// whatever their count [VanGelderen2020, §6.1.4].
    pub fn rain_alone(&mut self, count: u32, seed: u32) {
        (self.scene.lights, self.scene.environment) = (Vec::new(), None);
        self.motion = Some(Motion::of_rain(Rain::add(&mut self.scene, count, None, seed)));
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.most.min(self.steps.len())
    }

    /// Limits the frames to the first so many.
    pub fn limit(&mut self, most: usize) {
        self.most = most.max(1);
    }

    /// True if a frame may differ from the previous one.
    pub fn moves(&self) -> bool {
        self.motion.is_some() || self.steps.windows(2).any(|pair| pair[0].camera != pair[1].camera)
    }

    /// Images per frame.
    pub fn eyes(&self) -> usize {
        if self.eyes.is_some() { 2 } else { 1 }
    }

    /// Time of each frame, seconds; 0 if not set.
    pub fn moments(&self) -> Vec<f32> {
        self.steps[..self.frames()].iter().map(|step| step.time.unwrap_or(0.0)).collect()
    }

    /// Moves the scene to a frame's time. Returns true if anything may have changed.
    pub fn go_to(&mut self, frame: usize) -> Result<bool, CliError> {
        match (&self.motion, self.steps[frame].time) {
            (Some(motion), Some(time)) => {
                motion.at_time(&mut self.scene, time)?;
                Ok(true)
            }
            _ => Ok(false),
        }
    }

    /// The cameras of the current frame, one per eye.
    pub fn cameras(&self, frame: usize) -> Result<Vec<Camera>, CliError> {
        let aspect = self.size.width as f32 / self.size.height as f32;
        let Step { time, view, camera } = &self.steps[frame];
        let camera = match (view, &self.motion, time) {
            (Some(view), Some(_), Some(_)) => camera::follow(&self.scene, &self.bounds, view, aspect, camera)?,
            _ => camera.clone(),
        };
        match self.eyes {
            Some(eyes) => Ok(stereo::cameras(eyes, &camera, aspect)?.into()),
            None => Ok(vec![camera]),
        }
    }
}

#[cfg(test)]
mod tests {
    use lanternfish::settings::Samples;

    use super::*;
    use crate::shot;

    /// The plan of a shot with this text.
    fn plan(text: &str) -> Plan {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("shot.toml");
        std::fs::write(&path, text).unwrap();
        Plan::of(&shot::read(&path).unwrap(), None, &mut Progress::hidden()).unwrap()
    }

    #[test]
    fn accumulated_frames_are_replayed_as_single_frames() {
        let settings = |accumulate: u32| {
            plan(&format!("scene = \"demo:cornell\"\n[technique]\naccumulate = {accumulate}\n")).settings
        };
        let single = settings(1);
        assert_eq!((single.image.accumulate, single.image.samples), (1, Samples::Four));
        assert_eq!(settings(16), single);
    }
}
