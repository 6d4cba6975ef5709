//! The keys of a shot, derived from the flags of `render`.

use std::{
    any::TypeId,
    error::Error,
    ffi::{OsStr, OsString},
    path::PathBuf,
};

use clap::{Arg, ArgAction, Args as _, Command, error::ContextKind, error::ContextValue};
use glam::Vec3;
use lanternfish::{
    settings::{AnyParameter, Settings},
    technique::Range,
};
use lanternfish_scene::{Light, nearest};

use crate::{
    args::{RenderArgs, render_command},
    parse::{Frames, Size},
};

/// A flag as a key.
#[derive(Debug)]
pub struct Key {
    /// Its table: the first word of the flag's heading, in lower case.
    pub table: String,
    /// Its name, that of the flag.
    pub name: String,
    /// True if it holds a list of values, because the flag is repeatable.
    pub repeats: bool,
    pub kind: Kind,
    /// What it sets, if the library declares it.
    pub setting: Option<AnyParameter>,
    /// The id of the flag in its parser.
    pub id: String,
    arg: Arg,
}

/// The type of a key's value in TOML.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `true` or `false`: the flag is given or not.
    Flag,
    /// `true` or `false`, or `"on"` or `"off"`.
    Switch,
    /// A number.
    Number,
    /// A number, or a string that replaces the number.
    NumberOrWord,
    /// A list of numbers, or a string of comma-separated numbers, as on the command line.
    Numbers,
    /// `"WxH"` or `[W, H]`.
    Size,
    /// A string that is a path.
    Path,
    /// Any other string.
    Text,
}

/// All flags of `render`, in the order of help.
pub fn keys() -> Vec<Key> {
    let command = RenderArgs::augment_args(Command::new("render"));
    let settings = Settings::parameters();
    let setting = |arg: &Arg| settings.iter().find(|entry| entry.info.name == arg.get_id().as_str()).cloned();
    command.get_arguments().filter_map(|arg| Key::new(arg, setting(arg))).collect()
}

/// The key of a flag's id.
pub fn of_id<'k>(keys: &'k [Key], id: &str) -> &'k Key {
    keys.iter().find(|key| key.id == id).expect("flags are made from keys")
}

/// The first of these flags, by id and value, that its parser refuses, and the reason. All are parsed at once: a shot
/// may have thousands of lights.
pub fn refused(keys: &[Key], flags: &[(String, OsString)]) -> Option<(usize, String)> {
    let words = flags.iter().filter_map(|(id, value)| of_id(keys, id).word(value));
    let words = ["render".into(), "scene".into()].into_iter().chain(words);
    let error = render_command().try_get_matches_from(words).err()?;
    let context = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    // Flags that exclude each other have no value, and may be overridden.
    let (flag, value) = (context(ContextKind::InvalidArg)?, context(ContextKind::InvalidValue)?);
    let is_it = |(id, own): &(String, OsString)| {
        flag.split(' ').next() == Some(&format!("--{}", of_id(keys, id).name)) && *own == *value
    };
    let index = flags.iter().position(is_it)?;
    let key = of_id(keys, &flags[index].0);
    let reason = match (error.source().map(ToString::to_string), error.get(ContextKind::ValidValue)) {
        (Some(reason), _) if reason.contains("expected") => reason,
        // The standard library's messages do not state the expected form.
        (Some(reason), _) => format!("expected {}: {reason}", key.expected()),
        (None, Some(ContextValue::Strings(names))) if !names.is_empty() => {
            let nearest = nearest(value, &names.iter().map(String::as_str).collect::<Vec<_>>());
            format!("expected one of {}; did you mean {nearest:?}?", names.join(", "))
        }
        _ => format!("expected {}", key.expected()),
    };
    Some((index, reason))
}

impl Key {
    fn new(arg: &Arg, setting: Option<AnyParameter>) -> Option<Self> {
        let name = arg.get_long()?.to_owned();
        let heading = arg.get_help_heading().expect("every flag is under a heading");
        let table = heading.split_whitespace().next().expect("a word").to_lowercase();
        let value = arg.get_value_parser().type_id();
        let is = |ids: &[TypeId]| ids.iter().any(|id| value == *id);
        let kind = match setting.as_ref().map(|setting| setting.info.range) {
            Some(Range::Count(..) | Range::Positive | Range::Number(..) | Range::Numbers) => Kind::Number,
            Some(Range::Switch(..)) => Kind::Switch,
            Some(Range::Text) => Kind::NumberOrWord,
            None if matches!(arg.get_action(), ArgAction::SetTrue) => Kind::Flag,
            None if is(&[TypeId::of::<f32>(), TypeId::of::<u32>()]) => Kind::Number,
            None if is(&[TypeId::of::<Frames>()]) => Kind::NumberOrWord,
            None if is(&[TypeId::of::<Vec3>(), TypeId::of::<Light>(), TypeId::of::<[f32; 4]>()]) => Kind::Numbers,
            None if is(&[TypeId::of::<Size>()]) => Kind::Size,
            None if is(&[TypeId::of::<PathBuf>()]) => Kind::Path,
            _ => Kind::Text,
        };
        let repeats = matches!(arg.get_action(), ArgAction::Append);
        Some(Self { table, name, repeats, kind, setting, id: arg.get_id().to_string(), arg: arg.clone() })
    }

    /// True if this is the key's name or an old name of it.
    pub fn is_called(&self, name: &str) -> bool {
        self.name == name || self.arg.get_all_aliases().is_some_and(|old| old.contains(&name))
    }

    /// The word of the command line for this value; `None` for a flag that is off.
    pub fn word(&self, value: &OsStr) -> Option<OsString> {
        let mut word = OsString::from(format!("--{}", self.name));
        if self.kind == Kind::Flag {
            return (value == "true").then_some(word);
        }
        word.push("=");
        word.push(value);
        Some(word)
    }

    /// The expected value in an error message: `a list of numbers, [x,y,z]`.
    pub fn expected(&self) -> String {
        let kind = match self.kind {
            _ if self.repeats => "a list",
            Kind::Flag | Kind::Switch => return "true or false".to_owned(),
            Kind::Size => return "[W, H] in pixels, or \"WxH\"".to_owned(),
            Kind::Number => "a number",
            Kind::Numbers => "a list of numbers",
            Kind::NumberOrWord => "a number or a string",
            Kind::Path | Kind::Text => "a string",
        };
        format!("{kind}, {}", self.sample())
    }

    /// The placeholder of an unset key: `[x,y,z]`.
    pub fn sample(&self) -> String {
        let name = self.arg.get_value_names().and_then(|names| names.first()).map_or("", |name| name.as_str());
        let one = match self.kind {
            Kind::Flag | Kind::Switch => "true".to_owned(),
            Kind::Number => name.to_owned(),
            Kind::Numbers => format!("[{name}]"),
            Kind::NumberOrWord | Kind::Size | Kind::Path | Kind::Text => format!("\"{name}\""),
        };
        if self.repeats { format!("[{one}, …]") } else { one }
    }

    /// The flag's help, and its valid names.
    pub fn help(&self) -> String {
        // A help text of one paragraph has no final full stop.
        let short = || self.arg.get_help().map(|help| format!("{help}."));
        let mut help = self.arg.get_long_help().map(ToString::to_string).or_else(short).unwrap_or_default();
        let names: Vec<_> = self.arg.get_possible_values().iter().map(|value| value.get_name().to_owned()).collect();
        if !names.is_empty() && matches!(self.kind, Kind::Text | Kind::Number) {
            help += &format!(" One of: {}.", names.join(", "));
        }
        help
    }

    /// The flag's default value.
    pub fn default(&self) -> Option<&OsStr> {
        match self.kind {
            Kind::Flag => Some(OsStr::new("false")),
            _ => self.arg.get_default_values().first().map(AsRef::as_ref),
        }
    }
}
