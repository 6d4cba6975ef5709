//! The flags of the library's settings: choices of techniques, their parameters, and settings of their own.

use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, builder::TypedValueParser as _};
use lanternfish::{
    settings::{AnyParameter, GivenSettings, Settings},
    technique::Range,
};
use lanternfish_scene::Value;

use super::keys::is_given;
use crate::{choices::names, flags::as_flags, paper};

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
    &["indirect", "caustics", "occlusion", "structure"],
];

/// Flags of settings: the given values.
#[derive(Clone, Debug, Default)]
pub struct SettingFlags<const TABLE: usize>(pub GivenSettings);

/// Flags of the lights' falloff and size.
pub type LightFlags = SettingFlags<0>;
/// Flags of how radiance is displayed.
pub type LookArgs = SettingFlags<1>;
/// Flags of direct light, light culling, shadows and samples.
pub type TechniqueArgs = SettingFlags<2>;
/// Flags of indirect light and ambient visibility.
pub type IndirectArgs = SettingFlags<3>;

/// The settings of a table, in the order of help. Every program makes its flags before it reads names or builds a
/// renderer, so that the techniques of the papers are known from then on.
fn parameters(table: usize) -> impl Iterator<Item = AnyParameter> {
    paper::register();
    let all = Settings::parameters();
    let of = move |name: &&str| {
        let of: Vec<_> = all.iter().filter(|entry| entry.info.name == *name || entry.kind == *name).cloned().collect();
        of
    };
    TABLES[table].iter().flat_map(of)
}

/// The settings that are given on the command line of a command, which may have only some of the flags.
pub(crate) fn given(matches: &ArgMatches) -> GivenSettings {
    let mut given = GivenSettings::default();
    for AnyParameter { info, .. } in Settings::parameters() {
        if is_given(matches, info.name)
            && let Some(value) = matches.get_one::<Value>(info.name)
        {
            given.give(info.name, value.clone());
        }
    }
    given
}

impl<const TABLE: usize> SettingFlags<TABLE> {
    /// Those of this table.
    pub(crate) fn of(given: &GivenSettings) -> Self {
        let names: Vec<_> = parameters(TABLE).map(|entry| entry.info.name).collect();
        Self(given.only(|name| names.contains(&name)))
    }
}

impl<const TABLE: usize> Args for SettingFlags<TABLE> {
    fn augment_args(command: Command) -> Command {
        command.args(parameters(TABLE).map(flag))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<const TABLE: usize> FromArgMatches for SettingFlags<TABLE> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self::of(&given(matches)))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// The flag of a setting. Its parser reads the setting's own type.
fn flag(parameter: AnyParameter) -> Arg {
    let info = parameter.info;
    let flag = Arg::new(info.name).long(info.name).value_name(info.value).hide_short_help(!info.is_everyday);
    let flag = RENAMED.into_iter().filter(|(_, new)| *new == info.name).fold(flag, |flag, (old, _)| flag.alias(old));
    // The parser holds the text for its lifetime; leaking the few texts is acceptable.
    let default = parameter.value.text().filter(|_| info.shows_default);
    let flag = default.into_iter().fold(flag, |flag, text| flag.default_value(&*text.leak()));
    let known = match info.range {
        Range::Names | Range::Numbers => parameter.names(),
        Range::Switch(on, off) => vec![("on", on), ("off", off)],
        _ => Vec::new(),
    };
    let read = move |text: &str| parameter.read(text);
    let flag = match known.is_empty() {
        true => flag.value_parser(read).allow_hyphen_values(true),
        false => flag.value_parser(names(known).try_map(move |name| read(&name))),
    };
    with_help(flag, &info.text())
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
    let mut named: Vec<_> = (0..TABLES.len()).flat_map(parameters).map(|entry| entry.info.name).collect();
    let mut all: Vec<_> = Settings::parameters().iter().map(|entry| entry.info.name).collect();
    named.sort();
    all.sort();
    assert_eq!(named, all);
    all.dedup();
    assert_eq!(named, all, "names are unique");
}

/// A flag's value serves every technique that has its parameter.
#[cfg(test)]
#[test]
fn techniques_agree_on_shared_parameters() {
    use lanternfish::{
        settings::{Culling, Direct, Indirect, Occlusion},
        technique::{AnyTechnique, Choice, ParameterInfo},
    };
    fn of<K: AnyTechnique + ?Sized>(all: &[Choice<K>]) -> Vec<ParameterInfo> {
        let parameters = all.iter().filter_map(Choice::technique).flat_map(AnyTechnique::parameters);
        parameters.map(|(info, _)| info).collect()
    }
    paper::register();
    for kind in [of(&Direct::all()), of(&Culling::all()), of(&Indirect::all()), of(&Occlusion::all())] {
        for (i, info) in kind.iter().enumerate() {
            for other in kind[i..].iter().filter(|other| other.name == info.name) {
                assert_eq!(format!("{:?}", other.range), format!("{:?}", info.range), "{}", info.name);
            }
        }
    }
}
