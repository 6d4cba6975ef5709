//! Converts the state of a window to the shot that renders it: every setting as a flag, the camera, and the added
//! lights.
//!
//! The result is parsed again to verify it. Settings or a camera that flags cannot express give an error.

use std::ffi::OsString;

use glam::Vec3;
use lanternfish::settings::{GivenSettings, Settings};
use lanternfish_scene::{
    Camera, Eyes, Light, LightKind, Projection, Scene,
    generate::Rain,
    motion::Moment,
    rig::{self, LightRig},
};

use super::{
    Given, Shot,
    keys::{Key, keys, of_id},
    parsed, write,
};
use crate::{camera, error::CliError, stereo};

/// Flags of things that a window does not show. They are dropped.
const LEFT_BEHIND: [&str; 18] = [
    "as",
    "output",
    "outputs",
    "classes",
    "legend",
    "open",
    "quality",
    "stereo-layout",
    "time",
    "frames",
    "orbit",
    "fps",
    "animation",
    "skip-existing",
    "timings",
    "report",
    "progress",
    "quiet",
];
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
        let said = flags.points.len() + flags.disks.len() + flags.rectangles.len() + usize::from(flags.sun.is_some());
        let (before, of_rig) = scene.lights.split_at(scene.lights.len() - by_rig);
        let is_studio = flags.environment.is_none() && scene.environment == Some(rig::studio(camera));
        let of_studio = if is_studio { of_rig.to_vec() } else { Vec::new() };
        Self { fixed: before[..before.len() - said].to_vec(), rain, of_studio, is_studio, shot }
    }

    /// The shot of the window's state, and its camera, which equals the window's except for rounding.
    pub fn shown(&self, shown: &Shown<'_>) -> Result<(Shot, Camera), CliError> {
        let keys = keys();
        let is_camera = |name: &str| {
            matches!(
                name,
                "eye"
                    | "target"
                    | "fov-y"
                    | "view"
                    | "azimuth"
                    | "elevation"
                    | "pose"
                    | "pose-convention"
                    | "intrinsics"
            )
        };
        let aspect = shown.size[0] as f32 / shown.size[1] as f32;
        let choose = |view| camera::choose(shown.scene, view, aspect);
        let stands = self.shot.path.is_none() && choose(&self.shot.args.view)? == *shown.camera;
        // Unchanged eyes keep their spelling.
        let are_other_eyes = self.shot.args.stereo.stereo != shown.eyes;
        let stays = |(id, _): &&(String, OsString)| {
            let name = of_id(&keys, id).name.as_str();
            let is_light = matches!(name, "point" | "disk" | "rectangle" | "sun" | "light-rig" | "size");
            let is_other = name == "stereo" && are_other_eyes;
            !(LEFT_BEHIND.contains(&name) || is_other || is_light || (is_camera(name) && !stands))
        };
        let mut flags: Vec<_> = self.shot.flags.iter().filter(stays).cloned().collect();
        let mut say = |name: &str, text: String| {
            let key = keys.iter().find(|key| key.name == name).expect("a flag of render");
            flags.push((key.id.clone(), text.into()));
        };
        say("size", format!("{}x{}", shown.size[0], shown.size[1]));
        if let Some(eyes) = shown.eyes.filter(|_| are_other_eyes) {
            say("stereo", stereo::text(eyes));
        }
        if let Some(Moment { animation, time }) = shown.moment {
            match animation {
                Some(animation) => say("animation", animation.to_string()),
                None if shown.scene.motion.animations.is_empty() => {}
                None => {
                    let what = "flags cannot express falling rain without the file's animations";
                    return Err(CliError::new(what, "choose an animation below the image"));
                }
            }
            say("time", time.to_string());
        }
        if !stands {
            let eye = shown.camera.eye();
            let forward = shown.camera.world_from_camera.transform_vector3(Vec3::NEG_Z);
            // Place the target as far away as the eye is from the origin, so that both have the same rounding error.
            say("eye", numbers(&eye.to_array()));
            say("target", numbers(&(eye + eye.length().max(1.0) * forward).to_array()));
            if let Projection::Perspective { fov_y, .. } = shown.camera.projection {
                say("fov-y", fov_y.to_degrees().to_string());
            }
        }
        self.lights(shown, &mut say)?;
        flags.sort_by_key(|(id, _)| keys.iter().position(|key| key.id == *id));

        let scene = &self.shot.args.scene;
        let given = Given { flags, settings: GivenSettings::of(shown.settings) };
        let args = parsed(scene, &given).map_err(|error| super::refused(scene, &error))?;
        let shot = Shot { args, path: None, flags: given.flags };
        let said = shot.args.settings();
        if said != *shown.settings {
            let what = differing(&said, shown.settings);
            return Err(CliError::new(format!("flags cannot express these settings: {what}"), "choose others"));
        }
        let camera = choose(&shot.args.view)?;
        if !is_alike(&camera, shown.camera, shown.scene) {
            let what = "flags cannot express this camera: it is rolled, or its projection is neither a plain perspective nor its file's";
            return Err(CliError::new(what, "make it upright: drag to look around"));
        }
        Ok((shot, camera))
    }

    fn lights(&self, shown: &Shown<'_>, say: &mut impl FnMut(&str, String)) -> Result<(), CliError> {
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
            let (name, text) = said(light).map_err(|what| CliError::new(what, hint))?;
            suns += usize::from(name == "sun");
            if suns > 1 {
                return Err(CliError::new("there is more than one sun, which flags cannot express", hint));
            }
            say(name, text);
        }
        let sky = self.shot.args.lights.sky.unwrap_or_default();
        if scene.environment.is_none() && scene.sky != sky {
            say("sky", numbers(&scene.sky.to_array()));
        }
        // Name the rig explicitly, so that `render` adds no other one. The studio is an environment that only the rig
        // creates.
        say("light-rig", if self.is_studio { LightRig::Studio } else { LightRig::None }.to_string());
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
    let texts: Vec<_> = given.texts().collect();
    let words = keys.iter().flat_map(|key| {
        let is_other = |value: &&OsString| key.default() != Some(value.as_os_str());
        let own = shot.flags.iter().filter(|(id, _)| *id == key.id).map(|(_, value)| value).filter(is_other);
        let setting = texts.iter().filter(|(name, _)| *name == key.name);
        let setting = setting.map(|(name, text)| OsString::from(format!("--{name}={text}")));
        own.filter_map(|value| key.word(value)).chain(setting).collect::<Vec<_>>()
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

/// The flag that adds a light: name and value.
fn said(light: &Light) -> Result<(&'static str, String), String> {
    let Light { position, direction, intensity, range, .. } = light;
    let mut values = match light.kind {
        LightKind::Directional => direction.to_array().to_vec(),
        _ => position.to_array().to_vec(),
    };
    let name = match light.kind {
        LightKind::Point => "point",
        LightKind::Directional => "sun",
        LightKind::Disk { radius } => {
            values.extend(direction.to_array());
            values.push(radius);
            "disk"
        }
        LightKind::Rectangle { half_width, half_height, right } => {
            if right.y.abs() > 1e-3 && direction.y.abs() < 0.999 {
                return Err("no flag can express a rectangle whose width is not horizontal".to_owned());
            }
            values.extend(direction.to_array());
            values.extend([2.0 * half_width, 2.0 * half_height]);
            "rectangle"
        }
        LightKind::Spot { .. } => return Err("no flag can express a spot light".to_owned()),
    };
    if range.is_none() && intensity.x == intensity.y && intensity.x == intensity.z {
        values.push(intensity.x);
    } else {
        values.push(1.0);
        values.extend(intensity.to_array());
    }
    values.extend(range);
    Ok((name, numbers(&values)))
}

fn numbers(values: &[f32]) -> String {
    values.iter().map(f32::to_string).collect::<Vec<_>>().join(",")
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
    let mut names: Vec<_> = keys().into_iter().map(|key: Key| key.name).collect();
    names.retain(|name| a.get(name) != b.get(name));
    if names.is_empty() { "settings without a flag".to_owned() } else { names.join(", ") }
}

#[cfg(test)]
mod tests;
