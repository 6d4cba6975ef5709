//! Reads a shot's text into the fields that flags fill. Every error has a line and a column.

use std::{ffi::OsString, ops::Range, path::Path};

use lanternfish::{settings::Preset, technique::Range::Switch};
use lanternfish_scene::{Value, nearest};
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    camera_path::{CameraPath, RecordedPath},
    given::Given,
    track::{Interpolation, Moment, Track},
};
use crate::{
    args::{
        keys::{Key, keys},
        spelling::{Form, FovY, Position, Seconds, Spelling},
    },
    error::CliError,
    mistakes,
    recording::{self, Recorded},
    scene::SceneName,
};

/// The contents of a shot.
#[derive(Debug)]
pub(super) struct File {
    /// A file, relative to the current folder, or `demo:NAME`.
    pub scene: SceneName,
    /// Its keys.
    pub given: Given,
    pub path: Option<CameraPath>,
}

/// The tables of a shot.
#[derive(Default)]
struct Tables {
    given: Given,
    /// Where keys of flags of the command stand, by their names.
    places: Vec<(String, usize)>,
    path: Option<CameraPath>,
}

type Entry<'t> = (&'t str, Range<usize>, &'t Spanned<DeValue<'t>>);

/// Reads the shot at `path`.
pub(super) fn file(path: &Path, text: &str) -> Result<File, CliError> {
    Reader { path, text, keys: &keys() }.file()
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
        let (mut scene, mut tables) = (None, Tables::default());
        for (name, place, value) in entries(root.get_ref()) {
            let no_table = || self.error(place.start, &format!("`{name}` is a table"), format!("write [{name}]"));
            match name {
                "scene" => scene = Some(self.scene(value)?),
                _ if !self.keys.iter().any(|key| key.table == name) => {
                    let tables = self.keys.iter().map(|key| key.table.as_str()).chain(["scene"]);
                    return Err(self.unknown(place.start, name, None, tables));
                }
                _ => {
                    let DeValue::Table(table) = value.get_ref() else { return Err(no_table()) };
                    self.table(name, table, &mut tables)?;
                }
            }
        }
        let Tables { given, places, path } = tables;
        if let Some([first, second]) = given.conflict() {
            let place = places.iter().find(|(name, _)| *name == second).map_or(0, |(_, place)| *place);
            let what = format!("`{second}` cannot be used with `{first}`");
            return Err(self.error(place, &what, "leave one of them out"));
        }
        let scene = scene.ok_or_else(|| self.error(0, "no scene", "start with scene = \"FILE\""))?;
        Ok(File { scene, given, path })
    }

    /// A recording of camera input as a shot.
    fn recording(&self, root: &DeTable<'_>) -> Result<File, CliError> {
        let failed = |what: String, hint: &str| CliError::new(format_args!("{}: {what}", self.path.display()), hint);
        let Recorded { scene, flags, recording } =
            Recorded::parse(root).map_err(|what| failed(what, "`lanternfish view --record FILE` writes such files"))?;
        let given = Given::named(&flags).map_err(|[name, what, hint]| {
            let hint = if hint.is_empty() { "correct the file, or record it again" } else { &hint };
            failed(format!("the recording's flag {name:?}: {what}"), hint)
        })?;
        Ok(File { scene, given, path: Some(CameraPath::Recorded(RecordedPath::new(&recording))) })
    }

    fn scene(&self, value: &Spanned<DeValue<'_>>) -> Result<SceneName, CliError> {
        let DeValue::String(scene) = value.get_ref() else {
            return Err(self.wrong("scene", value.span(), "expected a string, \"FILE\" or \"demo:NAME\""));
        };
        let named = SceneName::from(scene.as_ref());
        if scene.is_empty() || super::is_shot(&named) {
            return Err(self.wrong("scene", value.span(), "expected a scene, not nothing and not a shot"));
        }
        Ok(if named.demo().is_some() { named } else { self.beside(scene).into() })
    }

    fn table(&self, table: &str, content: &DeTable<'_>, tables: &mut Tables) -> Result<(), CliError> {
        let (mut interpolation, mut keyframes) = (Interpolation::default(), None);
        for (name, place, value) in entries(content) {
            if let Some(key) = self.keys.iter().find(|key| key.table == table && key.is_called(name)) {
                tables.places.push((key.name.clone(), place.start));
                self.key(key, value, &mut tables.given)?;
                continue;
            }
            if let (DeValue::Table(parameters), Some(kind)) = (value.get_ref(), self.kind(table, name)) {
                self.technique(kind, name, parameters, &mut tables.given)?;
                continue;
            }
            match (table, name) {
                ("track", "interpolation") => interpolation = self.value::<Interpolation>(name, value)?,
                ("track", "keyframes") => keyframes = Some(self.keyframes(value)?),
                _ => {
                    let here = self.keys.iter().filter(|key| key.table == table).map(|key| key.name.as_str());
                    let more: &[&str] = if table == "track" { &["interpolation", "keyframes"] } else { &[] };
                    return Err(self.unknown(place.start, name, Some(table), here.chain(more.iter().copied())));
                }
            }
        }
        if let Some(keyframes) = keyframes {
            tables.path = Some(CameraPath::Keyframes(Track { interpolation, keyframes }));
        }
        Ok(())
    }

    /// The kind of the technique of this name, and the technique.
    fn kind(&self, table: &str, technique: &str) -> Option<(&'static str, Value)> {
        let settings = self.keys.iter().filter(|key| key.table == table).filter_map(|key| key.setting.as_ref());
        let mut kinds = settings.filter(|setting| setting.kind == setting.info.name);
        kinds.find_map(|kind| Some((kind.kind, kind.read(technique).ok()?)))
    }

    /// A technique with a table of its parameters: [indirect.sampled].
    fn technique(
        &self,
        (kind, technique): (&'static str, Value),
        name: &str,
        content: &DeTable<'_>,
        given: &mut Given,
    ) -> Result<(), CliError> {
        given.settings.give(kind, technique);
        let chosen = given.settings.over(Preset::default());
        let is_own = |key: &&Key| {
            key.setting.as_ref().is_some_and(|setting| setting.kind == kind && setting.info.name != kind)
                && chosen.value(&key.name).flatten().is_some()
        };
        for (parameter, place, value) in entries(content) {
            let Some(key) = self.keys.iter().filter(is_own).find(|key| key.is_called(parameter)) else {
                let known: Vec<_> = self.keys.iter().filter(is_own).map(|key| key.name.as_str()).collect();
                let near = nearest(parameter, &known);
                let what = format!("{name} has no parameter {parameter:?}; did you mean {near:?}?");
                return Err(self.error(place.start, &what, "`lanternfish help render --all` lists parameters"));
            };
            self.key(key, value, given)?;
        }
        Ok(())
    }

    /// The values of a key.
    fn key(&self, key: &Key, value: &Spanned<DeValue<'_>>, given: &mut Given) -> Result<(), CliError> {
        let wrong = |value: &Spanned<DeValue<'_>>, expected: &str| self.wrong(&key.name, value.span(), expected);
        let is_switch = key.setting.as_ref().is_some_and(|setting| matches!(setting.info.range, Switch(..)));
        // The library declares how a setting reads a text, from a value of any type.
        let form = if key.setting.is_some() { Form::Numbers(',') } else { key.form(&given.args) };
        let is_entry = |value: &DeValue<'_>| matches!(value, DeValue::Array(_) | DeValue::String(_));
        let values: Vec<&Spanned<DeValue<'_>>> = match value.get_ref() {
            DeValue::Array(list) if key.is_list() && list.iter().all(|entry| is_entry(entry.get_ref())) => {
                list.iter().collect()
            }
            _ if key.is_list() => return Err(wrong(value, &key.expected(form))),
            _ => vec![value],
        };
        for value in values {
            let read = match self.text(value.get_ref(), form) {
                None if key.setting.is_none() => Err(key.expected(form)),
                text => given.read(key, &text.unwrap_or_default()),
            };
            read.map_err(|what| wrong(value, if is_switch { "expected true or false" } else { &what }))?;
        }
        Ok(())
    }

    /// A value of this spelling.
    fn value<S: Spelling>(&self, name: &str, value: &Spanned<DeValue<'_>>) -> Result<S::Value, CliError> {
        let text = self.text(value.get_ref(), S::FORM).unwrap_or_default();
        S::read(&text).map_err(|what| self.wrong(name, value.span(), &what))
    }

    /// The text of a value, as the command line spells it; `None` for what has no such form.
    fn text(&self, value: &DeValue<'_>, form: Form) -> Option<OsString> {
        Some(match (value, form) {
            (DeValue::String(path), Form::Path) if !path.is_empty() => self.beside(path).into_os_string(),
            (DeValue::String(text), _) => text.as_ref().into(),
            (_, Form::Path | Form::Text) => return None,
            (DeValue::Boolean(on), _) => if *on { "on" } else { "off" }.into(),
            (DeValue::Array(list), Form::Numbers(separator)) => {
                let numbers: Option<Vec<_>> = list.iter().map(|number| digits(number.get_ref())).collect();
                numbers?.join(&separator.to_string()).into()
            }
            (number, _) => digits(number)?.into(),
        })
    }

    fn keyframes(&self, value: &Spanned<DeValue<'_>>) -> Result<Vec<Moment>, CliError> {
        let expected = "expected a list of { time, eye, target, fov-y }, with at least one";
        let DeValue::Array(list) = value.get_ref() else { return Err(self.wrong("keyframes", value.span(), expected)) };
        let mut frames: Vec<Moment> = Vec::new();
        for entry in list {
            let DeValue::Table(table) = entry.get_ref() else {
                return Err(self.wrong("keyframes", entry.span(), expected));
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
            return Err(self.wrong("keyframes", value.span(), expected));
        }
        Ok(frames)
    }

    fn keyframe(&self, place: usize, table: &DeTable<'_>) -> Result<Moment, CliError> {
        let (mut frame, mut time) = (Moment::default(), None);
        for (name, place, value) in entries(table) {
            match name {
                "time" => time = Some(self.value::<Seconds>(name, value)?),
                "eye" => frame.eye = Some(self.value::<Position>(name, value)?),
                "target" => frame.target = Some(self.value::<Position>(name, value)?),
                "fov-y" => frame.fov_y = Some(self.value::<FovY>(name, value)?),
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
    fn wrong(&self, name: &str, place: Range<usize>, expected: &str) -> CliError {
        let text: String = self.text[place.clone()].split_whitespace().collect::<Vec<_>>().join(" ");
        let text = match text.char_indices().nth(60) {
            Some((end, _)) => format!("{} …", &text[..end]),
            None => text,
        };
        let expected = mistakes::missing(text.trim_matches('"')).unwrap_or(expected);
        self.error(place.start, &format!("{name} = {text}: not possible"), expected)
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
