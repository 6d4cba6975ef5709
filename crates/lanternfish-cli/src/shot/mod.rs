//! Shots: everything an image or a sequence is made from, in one TOML file.
//!
//! `lanternfish help shot` has an example.
//!
//! A key is a flag's long name, and a table is the flag's heading in `lanternfish help render --all`: both come from the
//! flags themselves, so a new flag is a new key. Values are read by the flags' own parsers. Only `scene`, and
//! `interpolation` and `keyframes` of `[track]`, are keys alone. Paths are relative to the shot's folder. A flag on the
//! command line goes before the shot's key; `--point`, `--disk` and `--rectangle` add to the shot's.

mod frames;
mod keys;
mod read;
pub(crate) mod shown;
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

use crate::{
    args::RenderArgs,
    error::CliError,
    output,
    parse::{self, Frames},
    scene::SceneName,
};
use keys::{Key, Kind};
use track::Track;

/// What `lanternfish help shot` ends with.
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

Keyframes have a time in seconds, and eye, target and fov-y, or some of them: the same in all.
What [view] or a flag says of the camera stays as it is said. Between keyframes the camera moves
"linear" or along a "catmull-rom" curve; before the first and after the last it stands. Without
frames, time picks the moment. frames = "1-48" with fps = 24 are frames by their numbers, of any
scene, with a track or without: see docs/sequences.md.
"#;

/// Most bytes of a shot: what is larger is something else.
const MOST_BYTES: u64 = 16 << 20;

/// What is rendered, and how.
#[derive(Debug)]
pub struct Shot {
    /// The shot's keys and the command line's flags.
    pub args: RenderArgs,
    track: Option<Track>,
    /// Every flag that was said, shot's first, in the command line's spelling.
    words: Vec<(String, OsString)>,
}

/// What the arguments of a command ask for, whose scene is `scene`: that, or the shot that it names, under its flags. For every
/// command that has flags of `render`, or some of them, by the same ids.
pub(crate) fn resolve(scene: &SceneName, matches: &ArgMatches) -> Result<Shot, CliError> {
    let flags = said(matches);
    let shot = match is_shot(scene) {
        true => read(scene.path(), flags)?,
        false => Shot { args: parsed(scene, &flags, &keys::keys()), track: None, words: flags },
    };
    shot.check()?;
    Ok(shot)
}

/// What a recording was made under, under a command's flags; and which of its frames these ask for.
pub(crate) fn of_recording(
    scene: &SceneName,
    recorded: &[(String, String)],
    matches: &ArgMatches,
) -> Result<(Shot, Option<Frames>), CliError> {
    let keys = keys::keys();
    let flags = said(matches);
    let mut words = Vec::new();
    for (name, value) in recorded {
        let known = keys.iter().find(|key| key.is_called(name)).ok_or_else(|| {
            let names = keys.iter().map(|key| key.name.as_str());
            let nearest = keys::nearest(name, names);
            CliError::new(
                format_args!("the recording's flag {name:?}: there is none"),
                format!("it may be {nearest:?}"),
            )
        })?;
        let value = OsString::from(value);
        if let Some((_, reason)) = known.refused(std::slice::from_ref(&value)) {
            let what = format_args!("the recording's flag {name:?}: {reason}").to_string();
            return Err(CliError::new(what, "mend the file, or record it again"));
        }
        words.push((known.id.clone(), value));
    }
    words.extend(flags);
    let is_frames = |(id, _): &(String, OsString)| id == "frames";
    let frames = words.iter().rfind(|word| is_frames(word)).and_then(|(_, value)| value.to_str());
    let frames = frames.and_then(|value| parse::frames(value).ok());
    words.retain(|word| !is_frames(word));
    let args = parsed(scene, &words, &keys);
    Ok((Shot { args, track: None, words }, frames))
}

/// A scene under no flags.
pub(crate) fn plain(scene: &SceneName) -> Shot {
    Shot { args: parsed(scene, &[], &keys::keys()), track: None, words: Vec::new() }
}

/// True if a source is a shot, not a scene.
pub fn is_shot(source: &SceneName) -> bool {
    source.demo().is_none() && output::has_ending(source.path(), "toml")
}

/// Reads a shot; `flags` (id and value) go before its keys.
pub fn read(path: &Path, flags: Vec<(String, OsString)>) -> Result<Shot, CliError> {
    let keys = keys::keys();
    let failed = |what: &dyn std::fmt::Display, hint: &str| CliError::new(format!("{}: {what}", path.display()), hint);
    let size = fs::metadata(path).map_err(|error| failed(&error, "check the path"))?;
    if !size.is_file() || size.len() > MOST_BYTES {
        return Err(failed(&"this is no shot", "name a scene, or a shot: a .toml file"));
    }
    let text = fs::read_to_string(path).map_err(|error| failed(&error, "a shot is text in UTF-8"))?;
    let read::File { scene, mut words, track } = read::file(path, &text, &keys)?;

    // One moment or the whole track: what the command line says takes both keys' place.
    let chooses_when = |(id, _): &(String, OsString)| id == "time" || id == "frames";
    if flags.iter().any(chooses_when) {
        words.retain(|word| !chooses_when(word));
    }
    // One way of saying where the camera is, likewise.
    let places = |(id, _): &(String, OsString)| matches!(id.as_str(), "eye" | "target" | "camera");
    let sides = |(id, _): &(String, OsString)| id == "view";
    if flags.iter().any(places) {
        words.retain(|word| !sides(word));
    }
    if flags.iter().any(sides) {
        words.retain(|word| !places(word));
    }
    words.extend(flags);
    let mut args = parsed(&scene, &words, &keys);
    if args.output.output.is_none() {
        let mut name = path.file_stem().unwrap_or_default().to_owned();
        name.push(".png");
        args.output.output = Some(PathBuf::from(name));
    }
    if args.run.report.as_ref().is_some_and(|report| output::same_file(report, path)) {
        return Err(failed(&"both the shot and --report", "give them different names"));
    }
    Ok(Shot { args, track, words })
}

/// The flags that were said, in the order of help, by id and value.
fn said(matches: &ArgMatches) -> Vec<(String, OsString)> {
    let mut words = Vec::new();
    // A subcommand that has but some of the flags does not know the ids of others.
    let known = |key: &Key| matches.ids().any(|id| id.as_str() == key.id);
    for key in keys::keys().into_iter().filter(known) {
        if matches.value_source(&key.id) == Some(ValueSource::CommandLine) {
            let values = matches.get_raw(&key.id).into_iter().flatten();
            words.extend(values.map(|value| (key.id.clone(), value.to_owned())));
        }
    }
    words
}

/// The arguments of `render` for words that were each let through before.
fn parsed(scene: &SceneName, words: &[(String, OsString)], keys: &[Key]) -> RenderArgs {
    let mut line: Vec<OsString> = Vec::new();
    for (id, value) in words {
        let key = keys.iter().find(|key| key.id == *id).expect("words are made from keys");
        line.extend(key.word(value));
    }
    line.extend(["--".into(), scene.spelling().to_owned()]);
    RenderArgs::of(line).unwrap_or_else(|error| error.exit())
}

/// Flags that say where the camera is, when, and where results go: a recording says the first two itself.
const OF_IMAGES: [&str; 17] = [
    "adapter",
    "eye",
    "target",
    "fov_y",
    "camera",
    "view",
    "time",
    "frames",
    "fps",
    "output",
    "open",
    "skip_existing",
    "accumulate",
    "timings",
    "report",
    "progress",
    "quiet",
];

impl Shot {
    /// The names of all flags that were said.
    pub fn names(&self) -> Vec<String> {
        let name = |key: Key| self.words.iter().any(|(id, _)| *id == key.id).then_some(key.name);
        keys::keys().into_iter().filter_map(name).collect()
    }

    /// The flags that were said of scene, light and technique, by name and value. Paths are absolute.
    pub fn said(&self) -> Result<Vec<(String, String)>, CliError> {
        let keys = keys::keys();
        let kept = self.words.iter().filter(|(id, _)| !OF_IMAGES.contains(&id.as_str()));
        let said = kept.map(|(id, value)| {
            let key = keys.iter().find(|key| key.id == *id).expect("words are made from keys");
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
        said.collect()
    }
}

#[cfg(test)]
mod tests;
