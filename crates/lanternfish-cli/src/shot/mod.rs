//! Shots: TOML files that define an image or a sequence completely. A recording of camera input is read as a shot.
//!
//! `lanternfish help shot` has an example.
//!
//! A key is the long name of a flag, and a table is the flag's heading in `lanternfish help render --all`. Both come
//! from the flags themselves, so a new flag is a new key. The library reads settings, as it declares them, into values
//! of their own types; the flags' own parsers read the rest. Only `scene`, and `interpolation` and `keyframes` of
//! `[track]`, have no flag. A technique with its parameters may be a table: `[indirect.sampled]`. Paths are relative to
//! the shot's folder. A flag on the command line overrides the shot's key; `--point`, `--disk` and `--rectangle` add to
//! the shot's.

mod camera_path;
mod frames;
mod keys;
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

use clap::{ArgMatches, parser::ValueSource};
use lanternfish::settings::GivenSettings;
use lanternfish_scene::nearest;

use crate::{
    args::{RenderArgs, settings},
    ending::has_ending,
    error::CliError,
    output, paper,
    scene::SceneName,
};
use camera_path::{CameraPath, RecordedPath};
use keys::{Key, Kind, of_id};

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
    /// The given flags of the command itself, as in [`Given`].
    flags: Vec<(String, OsString)>,
}

/// What a command line or the keys of a shot give.
#[derive(Clone, Debug, Default)]
pub(crate) struct Given {
    /// Flags of the command itself, by id, as they are spelled: so they are written to a shot again. A shot's come
    /// first.
    flags: Vec<(String, OsString)>,
    /// Settings.
    settings: GivenSettings,
}

impl Given {
    /// The flags on the command line of a command with some or all flags of `render`, under the same ids.
    fn of(matches: &ArgMatches) -> Self {
        let mut flags = Vec::new();
        let is_flag = |key: &Key| key.setting.is_none() && matches.ids().any(|id| id.as_str() == key.id);
        for key in keys::keys().into_iter().filter(is_flag) {
            if matches.value_source(&key.id) == Some(ValueSource::CommandLine) {
                let values = matches.get_raw(&key.id).into_iter().flatten();
                flags.extend(values.map(|value| (key.id.clone(), value.to_owned())));
            }
        }
        Self { flags, settings: settings::given(matches) }
    }

    /// Flags by name and value. An error is the name, what is wrong, and a hint.
    fn named(flags: &[(String, String)]) -> Result<Self, [String; 3]> {
        let (keys, mut given) = (keys::keys(), Self::default());
        for (name, value) in flags {
            let Some(key) = keys.iter().find(|key| key.is_called(name)) else {
                let nearest = nearest(name, &keys.iter().map(|key| key.name.as_str()).collect::<Vec<_>>());
                return Err([name.clone(), "there is none".to_owned(), format!("it may be {nearest:?}")]);
            };
            match &key.setting {
                Some(setting) => {
                    let value = setting.read(value).map_err(|what| [name.clone(), what, String::new()])?;
                    given.settings.give(setting.info.name, value);
                }
                None => given.flags.push((key.id.clone(), value.into())),
            }
        }
        match keys::refused(&keys, &given.flags) {
            Some((index, what)) => Err([of_id(&keys, &given.flags[index].0).name.clone(), what, String::new()]),
            None => Ok(given),
        }
    }

    /// With the settings of `--as PAPER` below the others.
    fn with_paper(self) -> Self {
        let named = self.flags.iter().rev().find(|(id, _)| id == paper::ID);
        let settings = paper::given(named.map(|(_, name)| name.as_os_str()));
        Self { settings: self.settings.above(settings), ..self }
    }
}

/// Resolves the arguments of a command: its `scene`, or the shot that it names, with its flags. For every command with
/// some or all flags of `render`, under the same ids.
pub(crate) fn resolve(scene: &SceneName, matches: &ArgMatches) -> Result<Shot, CliError> {
    let given = Given::of(matches).with_paper();
    let shot = match is_shot(scene) {
        true => read_with(scene.path(), given)?,
        false => Shot { args: parsed_or_exit(scene, &given), path: None, flags: given.flags },
    };
    shot.check()?;
    Ok(shot)
}

/// A scene without flags.
pub(crate) fn plain(scene: &SceneName) -> Shot {
    Shot { args: parsed_or_exit(scene, &Given::default()), path: None, flags: Vec::new() }
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
    let given =
        Given::named(flags).map_err(|[name, what, hint]| CliError::new(format!("{name}: {what}"), hint))?.with_paper();
    let shot = match text {
        Some(text) => of_text(scene.path(), text, given)?,
        None => {
            let args = parsed(scene, &given).map_err(|error| refused(scene, &error))?;
            Shot { args, path: None, flags: given.flags }
        }
    };
    shot.check()?;
    Ok(shot)
}

fn of_text(path: &Path, text: &str, over: Given) -> Result<Shot, CliError> {
    let read::File { scene, given, path: camera_path } = read::file(path, text)?;
    let Given { mut flags, settings } = given.with_paper();

    // A time or frames on the command line replace both keys of the shot. An orbit may have both.
    let chooses_when = |(id, _): &(String, OsString)| id == "time" || id == "frames";
    let is_orbit = flags.iter().chain(&over.flags).any(|(id, _)| id == "orbit");
    if !is_orbit && over.flags.iter().any(chooses_when) {
        flags.retain(|flag| !chooses_when(flag));
    }
    // Likewise, camera flags on the command line replace the shot's other way of placing the camera.
    let way = |id: &str| WAYS.iter().position(|way| way.contains(&id));
    let lens = |id: &str| LENSES.iter().position(|lens| *lens == id);
    for (id, _) in &over.flags {
        let replaces = |of: &dyn Fn(&str) -> Option<usize>, other: &str| {
            of(id).is_some_and(|of_id| of(other).is_some_and(|of_other| of_other != of_id))
        };
        flags.retain(|(other, _)| !replaces(&way, other) && !replaces(&lens, other));
    }
    flags.extend(over.flags);
    let given = Given { flags, settings: over.settings.above(settings) };
    let mut args = parsed(&scene, &given).map_err(|error| refused(&path.display(), &error))?;
    if args.output.output.is_none() {
        let mut name = path.file_stem().unwrap_or_default().to_owned();
        name.push(".png");
        args.output.output = Some(PathBuf::from(name));
    }
    Ok(Shot { args, path: camera_path, flags: given.flags })
}

/// The given flags as words of the command line.
pub(crate) fn words(matches: &ArgMatches) -> Vec<OsString> {
    let (keys, given) = (keys::keys(), Given::of(matches));
    let flags = given.flags.iter().filter_map(|(id, value)| of_id(&keys, id).word(value));
    flags.chain(given.settings.texts().map(|(name, text)| format!("--{name}={text}").into())).collect()
}

/// The arguments of `render` with these flags, which have been accepted individually.
fn parsed(scene: &SceneName, given: &Given) -> Result<RenderArgs, clap::Error> {
    let keys = keys::keys();
    let words = given.flags.iter().filter_map(|(id, value)| of_id(&keys, id).word(value));
    let mut args = RenderArgs::of(words.chain(["--".into(), scene.spelling().to_owned()]))?;
    args.give(&given.settings);
    Ok(args)
}

/// The same of the command line itself: a mistake ends the process.
fn parsed_or_exit(scene: &SceneName, given: &Given) -> RenderArgs {
    parsed(scene, given).unwrap_or_else(|error| error.exit())
}

/// The error for flags of `source` that do not go together.
fn refused(source: &dyn std::fmt::Display, error: &clap::Error) -> CliError {
    let text = error.to_string();
    let what = text.trim_start_matches("error: ").split("\n\n").next().unwrap_or_default();
    CliError::new(format!("{source}: {what}"), "leave one of them out")
}

/// Ways of placing the camera, of which one counts.
const WAYS: [&[&str]; 4] =
    [&["eye", "target", "camera"], &["view"], &["pose", "pose_convention"], &["azimuth", "elevation"]];
/// Flags of the field of view, of which one counts.
const LENSES: [&str; 2] = ["fov_y", "intrinsics"];

/// Flags of camera, time and output. A recording has its own camera and time.
const OF_IMAGES: [&str; 26] = [
    "adapter",
    "eye",
    "target",
    "azimuth",
    "elevation",
    "fov_y",
    "camera",
    "view",
    "time",
    "frames",
    "orbit",
    "fps",
    "pose",
    "pose_convention",
    "intrinsics",
    "output",
    "outputs",
    "classes",
    "legend",
    "open",
    "skip_existing",
    "accumulate",
    "timings",
    "report",
    "progress",
    "quiet",
];

impl Shot {
    /// The recorded cameras, if this is a recording.
    pub fn recorded(&self) -> Option<&RecordedPath> {
        match &self.path {
            Some(CameraPath::Recorded(path)) => Some(path),
            _ => None,
        }
    }

    /// The names of all given flags.
    pub fn names(&self) -> Vec<String> {
        let settings = self.args.given();
        let is_given = |key: &Key| settings.get(&key.name).is_some() || self.flags.iter().any(|(id, _)| *id == key.id);
        keys::keys().into_iter().filter(is_given).map(|key| key.name).collect()
    }

    /// The given flags of scene, light and technique, for a recording: name and value. Paths are absolute.
    pub fn flags_of_recording(&self) -> Result<Vec<(String, String)>, CliError> {
        let keys = keys::keys();
        let recorded = self.flags.iter().filter(|(id, _)| !OF_IMAGES.contains(&id.as_str()));
        let own = recorded.map(|(id, value)| {
            let key = of_id(&keys, id);
            let value = match key.kind {
                Kind::Path => std::path::absolute(value).unwrap_or_else(|_| value.into()).into_os_string(),
                _ => value.clone(),
            };
            let value = value.into_string().map_err(|value| {
                let what = format_args!("--{} {}: not UTF-8", key.name, value.display()).to_string();
                CliError::new(what, "a recording is text: give it another name")
            });
            Ok((key.name.clone(), value?))
        });
        let settings = self.args.given();
        let settings = settings.texts().filter(|(name, _)| !OF_IMAGES.contains(name));
        own.chain(settings.map(|(name, text)| Ok((name.to_owned(), text)))).collect()
    }
}

#[cfg(test)]
mod tests;
