//! The flags of `render` as keys of a shot.

use std::ffi::{OsStr, OsString};

use clap::{Arg, ArgAction, ArgMatches, Args as _, Command, parser::ValueSource};
use lanternfish::{
    settings::{AnyParameter, Settings},
    technique::Range,
};

use super::{RenderArgs, flags::Flags as _, spelling::Form};

/// A flag as a key.
#[derive(Debug)]
pub(crate) struct Key {
    /// Its table: the first word of the flag's heading, in lower case.
    pub table: String,
    /// Its name, that of the flag.
    pub name: String,
    /// The id of the flag.
    pub id: String,
    /// What it sets, if the library declares it.
    pub setting: Option<AnyParameter>,
    arg: Arg,
}

/// All flags of `render`, in the order of help.
pub(crate) fn keys() -> Vec<Key> {
    let command = RenderArgs::augment_args(Command::new("render"));
    let settings = Settings::parameters();
    let key = |arg: &Arg| {
        let heading = arg.get_help_heading().unwrap_or_default();
        Some(Key {
            table: heading.split(' ').next().unwrap_or_default().to_lowercase(),
            name: arg.get_long()?.to_owned(),
            id: arg.get_id().to_string(),
            setting: settings.iter().find(|entry| entry.info.name == arg.get_id().as_str()).cloned(),
            arg: arg.clone(),
        })
    };
    command.get_arguments().filter_map(key).collect()
}

/// True if a flag stands on a command line, which need not know it.
pub(crate) fn is_given(matches: &ArgMatches, id: &str) -> bool {
    matches.ids().any(|other| other == id) && matches.value_source(id) == Some(ValueSource::CommandLine)
}

impl Key {
    /// True if this is the key's name or an old name of it.
    pub fn is_called(&self, name: &str) -> bool {
        self.name == name || self.arg.get_all_aliases().is_some_and(|old| old.contains(&name))
    }

    /// True if it holds a list of values.
    pub fn is_list(&self) -> bool {
        matches!(self.arg.get_action(), ArgAction::Append)
    }

    /// How a shot states a value.
    pub fn form(&self, args: &RenderArgs) -> Form {
        match &self.setting {
            Some(setting) if matches!(setting.info.range, Range::Names) => Form::Text,
            Some(_) => Form::Numbers(','),
            None => args.form(&self.id).expect("a flag of a setting, or of the command"),
        }
    }

    /// The word of the command line for this value; `None` for a switch that is off.
    pub fn word(&self, value: &OsStr) -> Option<OsString> {
        let mut word = OsString::from(format!("--{}", self.name));
        if matches!(self.arg.get_action(), ArgAction::SetTrue) {
            return (value == "true").then_some(word);
        }
        word.push("=");
        word.push(value);
        Some(word)
    }

    /// What a shot states: `a string, "FILE"`.
    pub fn expected(&self, form: Form) -> String {
        let kind = match form {
            _ if self.is_list() => "a list, ",
            Form::Numbers(_) => "",
            Form::Text | Form::Path => "a string, ",
        };
        format!("expected {kind}{}", self.sample(form))
    }

    /// A placeholder for its value: `[x,y,z]`.
    pub fn sample(&self, form: Form) -> String {
        let name = self.arg.get_value_names().and_then(|names| names.first()).map_or("true", |name| name.as_str());
        let one = match form {
            Form::Numbers(',') if name.contains(',') => format!("[{name}]"),
            Form::Numbers('x') => format!("[{}]", name.replace('x', ", ")),
            Form::Numbers(_) if !name.contains('|') => name.to_owned(),
            _ => format!("\"{name}\""),
        };
        if self.is_list() { format!("[{one}, …]") } else { one }
    }

    /// The flag's help, and its valid names.
    pub fn help(&self) -> String {
        // A help text of one paragraph has no final full stop.
        let short = || self.arg.get_help().map(|help| format!("{help}."));
        let mut help = self.arg.get_long_help().map(ToString::to_string).or_else(short).unwrap_or_default();
        let names: Vec<_> = self.arg.get_possible_values().iter().map(|value| value.get_name().to_owned()).collect();
        let is_switch = match &self.setting {
            Some(setting) => matches!(setting.info.range, Range::Switch(..)),
            None => matches!(self.arg.get_action(), ArgAction::SetTrue),
        };
        if !names.is_empty() && !is_switch {
            help += &format!(" One of: {}.", names.join(", "));
        }
        help
    }
}
