//! Converts a shot's text to words of the command line. Every error has a line and a column.

use std::{
    ffi::{OsStr, OsString},
    ops::Range,
    path::Path,
};

use lanternfish::settings::Settings;
use lanternfish_scene::nearest;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    camera_path::{CameraPath, RecordedPath},
    keys::{Key, Kind},
    track::{Interpolation, Moment, Track},
};
use crate::{
    error::CliError,
    mistakes, parse,
    recording::{self, Recorded},
    scene::SceneName,
};

/// The contents of a shot.
#[derive(Debug)]
pub struct File {
    /// A file, relative to the current folder, or `demo:NAME`.
    pub scene: SceneName,
    /// Its keys as flags: id and value, accepted by the flag's parser.
    pub words: Vec<(String, OsString)>,
    pub path: Option<CameraPath>,
}

type Entry<'t> = (&'t str, Range<usize>, &'t Spanned<DeValue<'t>>);

/// Reads the shot at `path`.
pub fn file(path: &Path, text: &str, keys: &[Key]) -> Result<File, CliError> {
    Reader { path, text, keys }.file()
}

struct Reader<'r> {
    path: &'r Path,
    text: &'r str,
    keys: &'r [Key],
}

impl Reader<'_> {
    fn file(&self) -> Result<File, CliError> {
        let root = DeTable::parse(self.text).map_err(|error| {
            let place = error.span().map_or(self.text.len(), |span| span.start);
            self.error(place, error.message(), "the file is TOML: name = value, and [table]")
        })?;
        if recording::is_recording(root.get_ref()) {
            return self.recording(root.get_ref());
        }
        let mut file = File { scene: "".into(), words: Vec::new(), path: None };
        let mut scene = None;
        for (name, place, value) in entries(root.get_ref()) {
            let table = value.get_ref();
            match name {
                "scene" => scene = Some(self.scene(value)?),
                _ if !self.keys.iter().any(|key| key.table == name) => {
                    let tables = self.keys.iter().map(|key| key.table.as_str()).chain(["scene"]);
                    return Err(self.unknown(place.start, name, None, tables));
                }
                _ => {
                    let DeValue::Table(table) = table else {
                        return Err(self.error(
                            place.start,
                            &format!("`{name}` is a table"),
                            format!("write [{name}]"),
                        ));
                    };
                    self.table(name, table, &mut file)?;
                }
            }
        }
        file.scene = scene.ok_or_else(|| self.error(0, "no scene", "start with scene = \"FILE\""))?;
        Ok(file)
    }

    /// A recording of camera input as a shot.
    fn recording(&self, root: &DeTable<'_>) -> Result<File, CliError> {
        let failed = |what: String, hint: String| CliError::new(format_args!("{}: {what}", self.path.display()), hint);
        let Recorded { scene, flags, recording } = Recorded::parse(root)
            .map_err(|what| failed(what, "`lanternfish view --record FILE` writes such files".to_owned()))?;
        let mut words = Vec::new();
        for (name, value) in flags {
            let Some(key) = self.keys.iter().find(|key| key.is_called(&name)) else {
                let nearest = nearest(&name, &self.keys.iter().map(|key| key.name.as_str()).collect::<Vec<_>>());
                return Err(failed(
                    format!("the recording's flag {name:?}: there is none"),
                    format!("it may be {nearest:?}"),
                ));
            };
            let value = OsString::from(value);
            if let Some((_, reason)) = key.refused(std::slice::from_ref(&value)) {
                let what = format!("the recording's flag {name:?}: {reason}");
                return Err(failed(what, "correct the file, or record it again".to_owned()));
            }
            words.push((key.id.clone(), value));
        }
        Ok(File { scene, words, path: Some(CameraPath::Recorded(RecordedPath::new(&recording))) })
    }

    fn scene(&self, value: &Spanned<DeValue<'_>>) -> Result<SceneName, CliError> {
        let DeValue::String(scene) = value.get_ref() else {
            return Err(self.wrong("scene", value, "expected a string, \"FILE\" or \"demo:NAME\""));
        };
        let named = SceneName::from(scene.as_ref());
        if scene.is_empty() || super::is_shot(&named) {
            return Err(self.wrong("scene", value, "expected a scene, not nothing and not a shot"));
        }
        Ok(if named.demo().is_some() { named } else { self.beside(scene).into() })
    }

    fn table(&self, table: &str, content: &DeTable<'_>, file: &mut File) -> Result<(), CliError> {
        let (mut interpolation, mut keyframes) = (Interpolation::default(), None);
        for (name, place, value) in entries(content) {
            if let Some(key) = self.keys.iter().find(|key| key.table == table && key.is_called(name)) {
                for word in self.words(key, value)? {
                    file.words.push((key.id.clone(), word));
                }
                continue;
            }
            if let (DeValue::Table(parameters), Some(kind)) = (value.get_ref(), self.kind(table, name)) {
                self.technique(kind, name, parameters, file)?;
                continue;
            }
            match (table, name) {
                ("track", "interpolation") => interpolation = self.interpolation(value)?,
                ("track", "keyframes") => keyframes = Some(self.keyframes(value)?),
                _ => {
                    let here = self.keys.iter().filter(|key| key.table == table).map(|key| key.name.as_str());
                    let more: &[&str] = if table == "track" { &["interpolation", "keyframes"] } else { &[] };
                    return Err(self.unknown(place.start, name, Some(table), here.chain(more.iter().copied())));
                }
            }
        }
        if let Some(keyframes) = keyframes {
            file.path = Some(CameraPath::Keyframes(Track { interpolation, keyframes }));
        }
        Ok(())
    }

    /// The key that chooses a technique of this name.
    fn kind(&self, table: &str, technique: &str) -> Option<&Key> {
        let is_kind = |key: &&Key| key.table == table && key.chooses(technique);
        self.keys.iter().find(is_kind)
    }

    /// A technique with a table of its parameters: [indirect.sampled]. The library's data declares which it has.
    fn technique(&self, kind: &Key, name: &str, content: &DeTable<'_>, file: &mut File) -> Result<(), CliError> {
        file.words.push((kind.id.clone(), name.into()));
        for (parameter, place, value) in entries(content) {
            let key = self.keys.iter().find(|key| key.setting.is_some() && key.is_called(parameter));
            let words = key.map(|key| self.words(key, value)).transpose()?.unwrap_or_default();
            let text = words.first().map(|word| word.to_string_lossy()).unwrap_or_default();
            let data = serde_json::json!({ &kind.name: { name: { parameter: text } } });
            serde_json::from_value::<Settings>(data).map_err(|error| {
                self.error(place.start, &error.to_string(), "`lanternfish help render --all` lists parameters")
            })?;
            file.words.extend(key.into_iter().flat_map(|key| words.iter().map(|word| (key.id.clone(), word.clone()))));
        }
        Ok(())
    }

    /// The values of a key as words of the command line.
    fn words(&self, key: &Key, value: &Spanned<DeValue<'_>>) -> Result<Vec<OsString>, CliError> {
        let values: Vec<&Spanned<DeValue<'_>>> = match value.get_ref() {
            DeValue::Array(list) if key.repeats => list.iter().collect(),
            _ if key.repeats => {
                return Err(self.wrong(&key.name, value, &format!("expected {}", key.expected())));
            }
            _ => vec![value],
        };
        let word = |value: &&Spanned<DeValue<'_>>| {
            let expected = || self.wrong(&key.name, value, &format!("expected {}", key.expected()));
            self.word(key.kind, value.get_ref()).ok_or_else(expected)
        };
        let words: Vec<_> = values.iter().map(word).collect::<Result<_, _>>()?;
        match key.refused(&words) {
            Some((index, reason)) => Err(self.wrong(&key.name, values[index], &reason)),
            None => Ok(words),
        }
    }

    fn word(&self, kind: Kind, value: &DeValue<'_>) -> Option<OsString> {
        Some(match (kind, value) {
            (Kind::Flag, DeValue::Boolean(on)) => on.to_string().into(),
            (Kind::Switch, DeValue::Boolean(on)) => if *on { "on" } else { "off" }.into(),
            (Kind::Path, DeValue::String(path)) if path.is_empty() => OsString::new(),
            (Kind::Path, DeValue::String(path)) => self.beside(path).into_os_string(),
            (Kind::Switch | Kind::Text | Kind::NumberOrWord | Kind::Numbers | Kind::Size, DeValue::String(text)) => {
                OsStr::new(text.as_ref()).to_owned()
            }
            (Kind::Number | Kind::NumberOrWord, number) => digits(number)?.into(),
            (Kind::Numbers | Kind::Size, DeValue::Array(list)) => {
                let numbers: Option<Vec<_>> = list.iter().map(|number| digits(number.get_ref())).collect();
                numbers?.join(if kind == Kind::Size { "x" } else { "," }).into()
            }
            _ => return None,
        })
    }

    fn interpolation(&self, value: &Spanned<DeValue<'_>>) -> Result<Interpolation, CliError> {
        let name = if let DeValue::String(name) = value.get_ref() { name } else { "" };
        Interpolation::NAMES.iter().find(|(other, _)| *other == name).map(|(_, value)| *value).ok_or_else(|| {
            let names = Interpolation::NAMES.map(|(name, _)| name).join(", ");
            self.wrong("interpolation", value, &format!("expected one of {names}"))
        })
    }

    fn keyframes(&self, value: &Spanned<DeValue<'_>>) -> Result<Vec<Moment>, CliError> {
        let expected = "expected a list of { time, eye, target, fov-y }, with at least one";
        let DeValue::Array(list) = value.get_ref() else { return Err(self.wrong("keyframes", value, expected)) };
        let mut frames: Vec<Moment> = Vec::new();
        for entry in list {
            let DeValue::Table(table) = entry.get_ref() else {
                return Err(self.wrong("keyframes", entry, expected));
            };
            let frame = self.keyframe(entry.span().start, table)?;
            let place = entry.span().start;
            if let Some(before) = frames.last() {
                if frame.time <= before.time {
                    let what = format!("keyframe at {} s after one at {} s", frame.time, before.time);
                    return Err(self.error(place, &what, "put keyframes in order of time, at different times"));
                }
                let keys = |frame: &Moment| [frame.eye.is_some(), frame.target.is_some(), frame.fov_y.is_some()];
                if keys(&frame) != keys(before) {
                    let what = "this keyframe has other keys than the previous one";
                    return Err(self.error(place, what, "give eye, target and fov-y in every keyframe or in none"));
                }
            }
            frames.push(frame);
        }
        if frames.is_empty() {
            return Err(self.wrong("keyframes", value, expected));
        }
        Ok(frames)
    }

    fn keyframe(&self, place: usize, table: &DeTable<'_>) -> Result<Moment, CliError> {
        let mut frame = Moment::default();
        let mut time = None;
        for (name, place, value) in entries(table) {
            let kind = if matches!(name, "eye" | "target") { Kind::Numbers } else { Kind::Number };
            let word = self.word(kind, value.get_ref()).and_then(|word| word.into_string().ok());
            let word = word.as_deref().unwrap_or_default();
            let wrong = |reason: String| self.wrong(name, value, &reason);
            match name {
                "time" => time = Some(parse::time(word).map_err(wrong)?),
                "eye" => frame.eye = Some(parse::position(word).map_err(wrong)?),
                "target" => frame.target = Some(parse::position(word).map_err(wrong)?),
                "fov-y" => frame.fov_y = Some(parse::fov_y(word).map_err(wrong)?),
                _ => {
                    let names = ["time", "eye", "target", "fov-y"];
                    return Err(self.unknown(place.start, name, Some("keyframes"), names.into_iter()));
                }
            }
        }
        frame.time = time.ok_or_else(|| self.error(place, "a keyframe without a time", "add time = SECONDS"))?;
        if frame.eye.is_none() && frame.target.is_none() && frame.fov_y.is_none() {
            return Err(self.error(place, "a keyframe without a camera", "add eye, target or fov-y"));
        }
        Ok(frame)
    }

    /// Resolves a path of the shot relative to the current folder.
    fn beside(&self, path: &str) -> std::path::PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(path)
    }

    /// The error for an unknown key or table.
    fn unknown<'k>(
        &self,
        place: usize,
        name: &str,
        table: Option<&str>,
        known: impl Iterator<Item = &'k str>,
    ) -> CliError {
        let what = match table {
            Some(table) => format!("unknown key `{name}` in [{table}]"),
            None => format!("unknown key `{name}`"),
        };
        let elsewhere = self.keys.iter().find(|key| key.name == name).map(|key| key.table.as_str());
        let hint = match (elsewhere, mistakes::tip(&format!("--{name}"))) {
            (Some(other), _) => format!("`{name}` belongs in [{other}]"),
            (None, Some(tip)) => tip.to_owned(),
            (None, None) => format!("did you mean `{}`?", nearest(name, &known.collect::<Vec<_>>())),
        };
        self.error(place, &what, hint)
    }

    /// The error for an invalid value.
    fn wrong(&self, name: &str, value: &Spanned<DeValue<'_>>, expected: &str) -> CliError {
        let text: String = self.text[value.span()].split_whitespace().collect::<Vec<_>>().join(" ");
        let text = match text.char_indices().nth(60) {
            Some((end, _)) => format!("{} …", &text[..end]),
            None => text,
        };
        self.error(value.span().start, &format!("{name} = {text}: not possible"), expected)
    }

    /// An error at a byte offset of the file.
    fn error(&self, place: usize, what: &str, hint: impl Into<String>) -> CliError {
        let before = &self.text[..self.text.floor_char_boundary(place)];
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        CliError::new(format!("{}:{line}:{column}: {what}", self.path.display()), hint)
    }
}

/// The entries of a table in file order, so that the first mistake is reported.
fn entries<'t>(table: &'t DeTable<'t>) -> Vec<Entry<'t>> {
    let mut entries: Vec<Entry<'t>> =
        table.iter().map(|(name, value)| (name.get_ref().as_ref(), name.span(), value)).collect();
    entries.sort_by_key(|(_, span, _)| span.start);
    entries
}

/// A number in the command line's spelling.
fn digits(value: &DeValue<'_>) -> Option<String> {
    match value {
        DeValue::Float(number) => Some(number.as_str().to_owned()),
        DeValue::Integer(number) if number.radix() == 10 => Some(number.as_str().to_owned()),
        DeValue::Integer(number) => {
            i64::from_str_radix(number.as_str(), number.radix()).ok().map(|number| number.to_string())
        }
        _ => None,
    }
}
