//! The flags of the library's settings: choices of techniques, their parameters, and settings of their own.

use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, builder::TypedValueParser as _, value_parser};
use lanternfish::{
    settings::{AnyParameter, Settings},
    technique::Range,
};

use crate::{choices::names, flags::as_flags};

/// Names before version 0.2, kept as hidden aliases: old name, new name.
const RENAMED: [(&str, &str); 1] = [("cache-cells", "cache-entries")];

/// Names of settings, and of kinds of technique, which stand for all flags of the kind: by table, in the order of help.
const TABLES: [&[&str]; 4] = [
    &[
        "attenuation",
        "attenuation-near-radius",
        "attenuation-coefficients",
        "range-threshold",
        "light-radius",
        "sun-diameter",
    ],
    &["materials", "exposure", "tone-map", "background", "anisotropy", "debug-view"],
    &[
        "direct",
        "shadows",
        "ray-culling",
        "ray-range-culling",
        "shadow-rays",
        "history",
        "antialiasing",
        "culling",
        "samples",
        "accumulate",
        "textures",
    ],
    &["indirect", "occlusion", "structure"],
];

/// Flags of settings: the given values, and defaults, by name.
#[derive(Clone, Debug)]
pub struct SettingFlags<const TABLE: usize>(Vec<(&'static str, String)>);

/// Flags of the lights' falloff and size.
pub type LightFlags = SettingFlags<0>;
/// Flags of how radiance is displayed.
pub type LookArgs = SettingFlags<1>;
/// Flags of direct light, light culling, shadows and samples.
pub type TechniqueArgs = SettingFlags<2>;
/// Flags of indirect light and ambient visibility.
pub type IndirectArgs = SettingFlags<3>;

/// The settings of a table, in the order of help.
fn parameters(table: usize) -> impl Iterator<Item = AnyParameter> {
    let all = Settings::parameters();
    let of = move |name: &&str| {
        let of: Vec<_> = all.iter().filter(|entry| entry.info.name == *name || entry.kind == *name).cloned().collect();
        of
    };
    TABLES[table].iter().flat_map(of)
}

impl<const TABLE: usize> SettingFlags<TABLE> {
    /// Name and value of each, in the order of help.
    pub fn values(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.0.iter().map(|(name, text)| (*name, text.as_str()))
    }

    /// Sets the given settings.
    pub fn set(&self, settings: &mut Settings) {
        for (name, text) in self.values() {
            settings.set(name, text).expect("the flag's parser has let it through");
        }
    }

    /// Gives those of this table other values.
    pub fn give(&mut self, values: &[(&str, String)]) {
        let value = |name: &'static str| {
            let given = values.iter().rev().find(|(other, _)| *other == name).map(|(_, text)| text);
            let before = || self.0.iter().find(|(other, _)| *other == name).map(|(_, text)| text);
            Some((name, given.or_else(before)?.clone()))
        };
        self.0 = parameters(TABLE).filter_map(|entry| value(entry.info.name)).collect();
    }
}

impl<const TABLE: usize> Args for SettingFlags<TABLE> {
    fn augment_args(command: Command) -> Command {
        command.args(parameters(TABLE).map(|AnyParameter { info, names: known, default, .. }| {
            let name = info.name;
            let number = move |text: &str| {
                Settings::check(name, text).and_then(|()| text.trim().parse::<f32>().map_err(|why| why.to_string()))
            };
            let words = move |text: &str| Settings::check(name, text).map(|()| text.to_owned());
            let flag = Arg::new(name).long(name).value_name(info.value).hide_short_help(!info.is_everyday);
            let flag = match info.range {
                Range::Count(least, most) => {
                    let range = value_parser!(u32).range(i64::from(least)..=i64::from(most));
                    flag.value_parser(range).allow_hyphen_values(true)
                }
                Range::Positive | Range::Number(..) => flag.value_parser(number).allow_hyphen_values(true),
                Range::Names => flag.value_parser(names(known)),
                Range::Numbers => {
                    flag.value_parser(names(known).map(|name| name.parse::<u32>().expect("these names are numbers")))
                }
                Range::Switch(on, off) => flag.value_parser(names([("on", on), ("off", off)]).map(|name| name == "on")),
                Range::Text => flag.value_parser(words).allow_hyphen_values(true),
            };
            let renamed = RENAMED.into_iter().filter(|(_, new)| *new == name);
            let flag = renamed.fold(flag, |flag, (old, _)| flag.alias(old));
            // The parser holds the text for its lifetime; leaking the few texts is acceptable.
            let default = default.filter(|_| info.shows_default);
            let flag = default.into_iter().fold(flag, |flag, text| flag.default_value(&*text.leak()));
            with_help(flag, info.help)
        }))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<const TABLE: usize> FromArgMatches for SettingFlags<TABLE> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let last = |name: &str| Some(matches.get_raw(name)?.next_back()?.to_string_lossy().into_owned());
        let value = |entry: AnyParameter| Some((entry.info.name, last(entry.info.name)?));
        Ok(Self(parameters(TABLE).filter_map(value).collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Splits help text as clap does for a comment: the first paragraph is the short help.
fn with_help(flag: Arg, text: &str) -> Arg {
    let text = as_flags(text);
    match text.split_once("\n\n") {
        None => flag.help(text.trim_end_matches('.').to_owned()),
        Some((short, _)) => flag.help(short.trim_end_matches('.').to_owned()).long_help(text),
    }
}

#[cfg(test)]
#[test]
fn every_setting_is_in_one_table() {
    lanternfish_papers::register();
    let mut named: Vec<_> = (0..TABLES.len()).flat_map(parameters).map(|entry| entry.info.name).collect();
    let mut all: Vec<_> = Settings::parameters().iter().map(|entry| entry.info.name).collect();
    named.sort();
    all.sort();
    assert_eq!(named, all);
    all.dedup();
    assert_eq!(named, all, "names are unique");
}
