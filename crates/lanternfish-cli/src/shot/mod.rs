//! Shots: TOML files that define an image or a sequence completely. A recording of camera input is read as a shot.
//!
//! `lanternfish help shot` has an example.
//!
//! A key is the long name of a flag, and a table is the flag's heading in `lanternfish help render --all`. Both come
//! from the flags themselves, so a new flag is a new key. A key is read into the field that its flag fills
//! ([`crate::args::flags`]), a setting into a value of its own type. Only `scene`, and `interpolation` and `keyframes`
//! of `[track]`, have no flag. A technique with its parameters may be a table: `[indirect.sampled]`. Paths are relative
//! to the shot's folder. A flag on the command line overrides the shot's key; `--point`, `--disk` and `--rectangle` add
//! to the shot's.

mod camera_path;
mod frames;
mod given;
mod read;
pub mod shown;
mod track;
mod write;

pub use frames::ShotFrame;
pub(crate) use write::{quoted, write};

use std::{
    ffi::OsString,
    fs,
    path::{Path, PathBuf},
};

use clap::ArgMatches;

use crate::{
    args::{
        RenderArgs,
        flags::Flags as _,
        keys::{is_given, keys},
        spelling::Form,
    },
    ending::has_ending,
    error::CliError,
    output,
    scene::SceneName,
};
use camera_path::{CameraPath, RecordedPath};
use given::Given;

/// Text after the help of `shot`.
pub(crate) const HELP: &str = r#"A shot is TOML. A key is the long name of a flag of `render`, in the table of the flag's heading:
`lanternfish help render --all` lists them, and `lanternfish shot SCENE` prints a shot with every key.
Paths are relative to the shot's folder. A flag on the command line goes before the shot's key;
--point, --disk and --rectangle add to the shot's lights.

  scene = "court.glb"

  [output]
  size = [1920, 1080]

  [lights]
  sun = [0.3, -1, 0.2, 3]
  point = [[0, 2.5, 0, 100], [3, 2, 1, 80, 0.6, 0.8, 1]]

  [track]
  frames = 48
  interpolation = "catmull-rom"
  keyframes = [
      { time = 0, eye = [6, 2, -1], target = [0, 2, 0], fov-y = 60 },
      { time = 2, eye = [0, 2, 8], target = [0, 2, 0], fov-y = 45 },
  ]

Keyframes have a time in seconds, and some or all of eye, target and fov-y: the same keys in all.
Camera values in [view] or in a flag override the track. Between keyframes the camera moves
"linear" or along a "catmull-rom" curve; before the first and after the last it is static. Without
frames, time selects one image. frames = "1-48" with fps = 24 are frames by number, of any
scene, with or without a track: see docs/sequences.md. A recording of `view --record` is read like a
shot.
"#;

/// Largest size of a shot or a recording, bytes. Larger files are neither.
const MOST_BYTES: u64 = 64 << 20;

/// A scene and its settings.
#[derive(Debug)]
pub struct Shot {
    /// The shot's keys and the command line's flags.
    pub args: RenderArgs,
    /// How the camera moves, if it does.
    path: Option<CameraPath>,
    /// The ids of the given flags of the command itself.
    ids: Vec<String>,
}

/// Resolves the arguments of a command: its `scene`, or the shot that it names, with its flags. For every command with
/// some or all flags of `render`, under the same ids.
pub(crate) fn resolve(scene: &SceneName, matches: &ArgMatches) -> Result<Shot, CliError> {
    let given = Given::of(matches);
    let shot = if is_shot(scene) { read_with(scene.path(), given)? } else { given.shot(scene.clone(), None) };
    shot.check()?;
    Ok(shot)
}

/// A scene without flags.
pub(crate) fn plain(scene: &SceneName) -> Shot {
    Given::default().shot(scene.clone(), None)
}

/// True if a source is a shot or a recording, not a scene.
pub fn is_shot(source: &SceneName) -> bool {
    source.demo().is_none() && has_ending(source.path(), "toml")
}

/// Reads a shot, or a recording as a shot.
pub fn read(path: &Path) -> Result<Shot, CliError> {
    read_with(path, Given::default())
}

/// The same with `given` over its keys.
fn read_with(path: &Path, given: Given) -> Result<Shot, CliError> {
    let failed = |what: &dyn std::fmt::Display, hint: &str| CliError::new(format!("{}: {what}", path.display()), hint);
    let size = fs::metadata(path).map_err(|error| failed(&error, "check the path"))?;
    if !size.is_file() || size.len() > MOST_BYTES {
        return Err(failed(&"this is no shot", "name a scene, or a shot: a .toml file"));
    }
    let text = fs::read_to_string(path).map_err(|error| failed(&error, "a shot is text in UTF-8"))?;
    let shot = of_text(path, &text, given)?;
    if shot.args.run.report.as_ref().is_some_and(|report| output::same_file(report, path)) {
        return Err(failed(&"both the shot and --report", "give them different names"));
    }
    Ok(shot)
}

/// The scene of this name, or the shot with this text, with flags by their names.
pub fn with_flags(scene: &SceneName, text: Option<&str>, flags: &[(String, String)]) -> Result<Shot, CliError> {
    let given = Given::named(flags).map_err(|[name, what, hint]| CliError::new(format!("{name}: {what}"), hint))?;
    let shot = match text {
        Some(text) => of_text(scene.path(), text, given)?,
        None => given.shot(scene.clone(), None),
    };
    shot.check()?;
    Ok(shot)
}

fn of_text(path: &Path, text: &str, over: Given) -> Result<Shot, CliError> {
    let read::File { scene, given, path: camera_path } = read::file(path, text)?;
    let mut shot = over.over(&given).shot(scene, camera_path);
    shot.args.output.output.get_or_insert_with(|| {
        let mut name = path.file_stem().unwrap_or_default().to_owned();
        name.push(".png");
        PathBuf::from(name)
    });
    Ok(shot)
}

/// The given flags as words of the command line.
pub(crate) fn words(matches: &ArgMatches) -> Vec<OsString> {
    let keys = keys();
    let given = keys.iter().filter(|key| is_given(matches, &key.id));
    given.flat_map(|key| matches.get_raw(&key.id).into_iter().flatten().filter_map(|value| key.word(value))).collect()
}

/// Flags of camera, time and output. A recording has its own camera and time.
const OF_IMAGES: [&[&str]; 4] = [
    &["adapter", "timings", "report", "progress", "quiet"],
    &["eye", "target", "azimuth", "elevation", "fov_y", "camera", "view", "pose", "pose_convention", "intrinsics"],
    &["time", "frames", "orbit", "fps", "skip_existing", "accumulate"],
    &["output", "outputs", "classes", "legend", "open"],
];

impl Shot {
    /// The recorded cameras, if this is a recording.
    pub fn recorded(&self) -> Option<&RecordedPath> {
        match &self.path {
            Some(CameraPath::Recorded(path)) => Some(path),
            _ => None,
        }
    }

    /// True if the flag of this id, or the setting of this name, is given.
    pub fn gives(&self, name: &str) -> bool {
        self.ids.iter().any(|id| id == name) || self.args.given().get(name).is_some()
    }

    /// The given flags of scene, light and technique, for a recording: name and value. Paths are absolute.
    pub fn flags_of_recording(&self) -> Result<Vec<(String, String)>, CliError> {
        let (keys, of_images, mut flags) = (keys(), OF_IMAGES.concat(), Vec::new());
        let given = keys.iter().filter(|key| self.ids.contains(&key.id));
        for key in given.filter(|key| !of_images.contains(&key.id.as_str())) {
            for value in self.args.texts(&key.id) {
                let is_path = key.form(&self.args) == Form::Path;
                let absolute = is_path.then(|| std::path::absolute(&value).ok()).flatten();
                let value = absolute.map_or(value, PathBuf::into_os_string).into_string().map_err(|value| {
                    let what = format_args!("--{} {}: not UTF-8", key.name, value.display()).to_string();
                    CliError::new(what, "a recording is text: give it another name")
                });
                flags.push((key.name.clone(), value?));
            }
        }
        let settings = self.args.given();
        let settings = settings.texts().filter(|(name, _)| !of_images.contains(name));
        flags.extend(settings.map(|(name, text)| (name.to_owned(), text)));
        Ok(flags)
    }
}

#[cfg(test)]
mod tests;
