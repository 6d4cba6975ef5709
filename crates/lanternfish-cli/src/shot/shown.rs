//! Converts the state of a window to the shot that renders it: every setting as a flag, the camera, and the added
//! lights.
//!
//! Settings or a camera that flags cannot express give an error.

use std::ffi::OsString;

use glam::Vec3;
use lanternfish::settings::{GivenSettings, Settings};
use lanternfish_scene::{
    Camera, Eyes, Light, Projection, Scene,
    generate::Rain,
    motion::Moment,
    rig::{self, LightRig},
};

use super::{Shot, given::Given, write};
use crate::{
    args::{RenderArgs, flags::Flags as _, keys::keys},
    camera,
    error::CliError,
    parse::{self, Size},
};

/// Ids of flags of things that a window does not show. They are dropped.
const LEFT_BEHIND: [&[&str]; 3] = [
    &["paper", "quality", "timings", "report", "progress", "quiet"],
    &["output", "outputs", "classes", "legend", "open", "stereo_layout"],
    &["time", "frames", "orbit", "fps", "animation", "skip_existing"],
];
/// Ids of flags of the camera.
const OF_CAMERA: [&str; 9] =
    ["eye", "target", "fov_y", "view", "azimuth", "elevation", "pose", "pose_convention", "intrinsics"];
/// Ids of flags whose values the window has.
const OF_WINDOW: [&str; 7] = ["size", "stereo", "points", "disks", "rectangles", "sun", "light_rig"];
/// Cameras farther apart than this are different: m, and as a fraction of the scene's size.
const SAME_PLACE: f32 = 1e-4;

/// The scene that a window opened.
#[derive(Debug)]
pub struct Opened {
    /// Its shot.
    pub shot: Shot,
    /// Lights of the file and generated lights, at 0 s. The shot's time determines their motion.
    fixed: Vec<Light>,
    /// The falling lights among them.
    rain: Option<Rain>,
    /// The lights of the rig, if it is the studio.
    of_studio: Vec<Light>,
    is_studio: bool,
}

/// The state of a window.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// Renderer settings.
    pub settings: &'a Settings,
    /// The scene, with its present lights.
    pub scene: &'a Scene,
    /// The camera.
    pub camera: &'a Camera,
    /// The two eyes; `None` in mono.
    pub eyes: Option<Eyes>,
    /// Width and height of one eye's image, pixels.
    pub size: [u32; 2],
    /// Animation and time; `None` if nothing was played.
    pub moment: Option<Moment>,
}

impl Opened {
    /// Creates the state from `scene`, lit by the shot's flags at 0 s, and its first `camera`. The last `by_rig` lights
    /// belong to a rig, and those of `rain` fall.
    pub fn new(shot: Shot, scene: &Scene, camera: &Camera, by_rig: usize, rain: Option<Rain>) -> Self {
        let flags = &shot.args.lights;
        let added = flags.points.len() + flags.disks.len() + flags.rectangles.len() + usize::from(flags.sun.is_some());
        let (before, of_rig) = scene.lights.split_at(scene.lights.len() - by_rig);
        let is_studio = flags.environment.is_none() && scene.environment == Some(rig::studio(camera));
        let of_studio = if is_studio { of_rig.to_vec() } else { Vec::new() };
        Self { fixed: before[..before.len() - added].to_vec(), rain, of_studio, is_studio, shot }
    }

    /// The shot of the window's state, and its camera, which equals the window's except for rounding.
    pub fn shown(&self, shown: &Shown<'_>) -> Result<(Shot, Camera), CliError> {
        let aspect = shown.size[0] as f32 / shown.size[1] as f32;
        let choose = |view| camera::choose(shown.scene, view, aspect);
        let stands = self.shot.path.is_none() && choose(&self.shot.args.view)? == *shown.camera;
        let stays = |id: &&String| {
            let is_one_of = |ids: &[&str]| ids.contains(&id.as_str());
            !(is_one_of(&LEFT_BEHIND.concat()) || is_one_of(&OF_WINDOW) || (is_one_of(&OF_CAMERA) && !stands))
        };
        let mut given = Given { settings: GivenSettings::of(shown.settings), ..Given::default() };
        for id in self.shot.ids.iter().filter(stays) {
            given.put(id, |args| args.copy(id, &self.shot.args));
        }
        let [width, height] = shown.size;
        given.put("size", |args| args.output.size = Size { width, height });
        if shown.eyes.is_some() {
            given.put("stereo", |args| args.stereo.stereo = shown.eyes);
        }
        if let Some(Moment { animation, time }) = shown.moment {
            if let Some(animation) = animation {
                given.put("animation", |args| args.track.animation = Some(animation.to_string()));
            } else if !shown.scene.motion.animations.is_empty() {
                let what = "flags cannot express falling rain without the file's animations";
                return Err(CliError::new(what, "choose an animation below the image"));
            }
            given.put("time", |args| args.track.time = Some(time));
        }
        if !stands {
            let eye = shown.camera.eye();
            let forward = shown.camera.world_from_camera.transform_vector3(Vec3::NEG_Z);
            given.put("eye", |args| args.view.eye = Some(eye));
            // Place the target as far away as the eye is from the origin, so that both have the same rounding error.
            given.put("target", |args| args.view.target = Some(eye + eye.length().max(1.0) * forward));
            if let Projection::Perspective { fov_y, .. } = shown.camera.projection {
                // The angle of a number of degrees.
                given.put("fov_y", |args| args.view.fov_y = Some(fov_y.to_degrees().to_radians()));
            }
        }
        self.lights(shown, &mut given)?;

        let shot = given.shot(self.shot.args.scene.clone(), None);
        let settings = shot.args.settings();
        if settings != *shown.settings {
            let what = differing(&settings, shown.settings);
            return Err(CliError::new(format!("flags cannot express these settings: {what}"), "choose others"));
        }
        let camera = choose(&shot.args.view)?;
        if !is_alike(&camera, shown.camera, shown.scene) {
            let what = "flags cannot express this camera: it is rolled, or its projection is neither a plain perspective nor its file's";
            return Err(CliError::new(what, "make it upright: drag to look around"));
        }
        Ok((shot, camera))
    }

    fn lights(&self, shown: &Shown<'_>, given: &mut Given) -> Result<(), CliError> {
        let hint = "added lights may have any position; render this from a program, or restore these lights";
        let (scene, mut fixed) = (shown.scene, self.fixed.clone());
        if let Some(Moment { animation, time }) = shown.moment {
            if let Some(animation) = animation.filter(|animation| *animation < scene.motion.animations.len()) {
                scene.motion.lights_at(&mut fixed, animation, time);
            }
            if let Some(rain) = &self.rain {
                rain.fall(&mut fixed, time);
            }
        }
        let Some(more) = scene.lights.strip_prefix(&fixed[..]) else {
            return Err(CliError::new(
                "lights of the file, or of --lights, were changed or deleted, which flags cannot express",
                hint,
            ));
        };
        let mut suns = 0;
        for light in more.iter().filter(|light| !self.of_studio.contains(light)) {
            let (id, text) = parse::light_text(light).map_err(|what| CliError::new(what, hint))?;
            suns += usize::from(id == "sun");
            if suns > 1 {
                return Err(CliError::new("there is more than one sun, which flags cannot express", hint));
            }
            let read = given.put(id, |args| args.read(id, text.as_ref()));
            read.map_err(|what| CliError::new(format_args!("flags cannot express a light, {text}: {what}"), hint))?;
        }
        let sky = self.shot.args.lights.sky.unwrap_or_default();
        if scene.environment.is_none() && scene.sky != sky {
            given.put("sky", |args| args.lights.sky = Some(scene.sky));
        }
        // Name the rig explicitly, so that `render` adds no other one. The studio is an environment that only the rig
        // creates.
        let rig = if self.is_studio { LightRig::Studio } else { LightRig::None };
        given.put("light_rig", |args| args.lights.light_rig = Some(rig));
        Ok(())
    }

    /// True if the shot's light follows its camera.
    pub fn is_studio(&self) -> bool {
        self.is_studio
    }
}

/// The text of the shot's file.
pub fn text(shot: &Shot) -> Result<String, CliError> {
    write::text(shot, None)
}

/// The shot as a command line for a shell, without flags that have no effect.
pub fn command_line(shot: &Shot) -> String {
    let (keys, settings, mut given) = (keys(), shot.args.settings(), shot.args.given());
    for key in keys.iter().rev().filter(|key| key.setting.is_some()) {
        let without = given.only(|name| name != key.name);
        if shot.args.settings_with(&without, without.frames()) == settings {
            given = without;
        }
    }
    let (texts, usual): (Vec<_>, _) = (given.texts().collect(), RenderArgs::default());
    let words = keys.iter().flat_map(|key| {
        let setting = texts.iter().filter(|(name, _)| *name == key.name).map(|(_, text)| text.into());
        let own = if shot.ids.contains(&key.id) { shot.args.texts(&key.id) } else { Vec::new() };
        let own = if own == usual.texts(&key.id) { Vec::new() } else { own };
        own.into_iter().chain(setting).filter_map(|text: OsString| key.word(&text)).collect::<Vec<_>>()
    });
    let scene = shot.args.scene.spelling().to_owned();
    let line = ["lanternfish".into(), "render".into(), scene].into_iter().chain(words);
    line.map(|word| quoted(&word.to_string_lossy())).collect::<Vec<_>>().join(" ")
}

/// Quotes a word for a shell.
pub(crate) fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=+@%".contains(c);
    match word.chars().all(is_plain) && !word.is_empty() {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

/// True if two cameras give the same image, except for rounding.
fn is_alike(a: &Camera, b: &Camera, scene: &Scene) -> bool {
    let (x, y) = (a.world_from_camera, b.world_from_camera);
    let near = SAME_PLACE * scene.bounds().size().length().max(1.0);
    let projects = match (a.projection, b.projection) {
        // The near plane may be nearer, which clips nothing that was visible.
        (Projection::Perspective { fov_y: a, .. }, Projection::Perspective { fov_y: b, .. }) => (a - b).abs() < 1e-5,
        (a, b) => a == b,
    };
    projects && a.eye().distance(b.eye()) <= near && x.matrix3.abs_diff_eq(y.matrix3, SAME_PLACE)
}

/// The flags that differ between two settings, for an error.
fn differing(a: &Settings, b: &Settings) -> String {
    let mut names: Vec<_> = keys().into_iter().map(|key| key.name).collect();
    names.retain(|name| a.get(name) != b.get(name));
    if names.is_empty() { "settings without a flag".to_owned() } else { names.join(", ") }
}

#[cfg(test)]
mod tests;
