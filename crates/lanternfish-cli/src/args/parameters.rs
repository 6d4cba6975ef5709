//! The flags of what the library declares: one that chooses a technique, and one for each parameter and setting.

use std::{marker::PhantomData, sync::Arc};

use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, builder::TypedValueParser as _, value_parser};
use lanternfish::{
    settings::Settings,
    technique::{AnyTechnique, Choice, Kind, ParameterInfo, Range},
};
use lanternfish_papers::DeepImageSettings;

use crate::{choices::names, flags::as_flags};

/// Parameter names before version 0.2, kept as hidden aliases: old name, new name.
const RENAMED: [(&str, &str); 1] = [("cache-cells", "cache-entries")];

/// The flag that chooses a technique.
#[derive(Clone, Debug)]
pub struct TechniqueFlag<K: Kind + ?Sized> {
    /// The technique, with its default parameters.
    pub choice: Choice<K>,
    /// False: the default, which depends on other flags, may replace it.
    pub is_given: bool,
}

impl<K: Kind + ?Sized> Args for TechniqueFlag<K> {
    fn augment_args(command: Command) -> Command {
        let all = Choice::<K>::all();
        let techniques = all.iter().filter_map(|choice| Some((choice.name(), choice.technique()?.summary())));
        let known = names([(K::NONE_NAME, K::NONE_SUMMARY)].into_iter().chain(techniques));
        let flag = Arg::new(K::FLAG).long(K::FLAG).value_name("NAME").value_parser(known);
        let flag = flag.hide_short_help(!K::IS_EVERYDAY);
        let flag = if K::HAS_ONE_DEFAULT { flag.default_value(Choice::<K>::default().name()) } else { flag };
        command.arg(with_help(flag, K::HELP))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<K: Kind + ?Sized> FromArgMatches for TechniqueFlag<K> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let name = matches.get_one::<String>(K::FLAG);
        let choice =
            name.map_or_else(K::usual, |name| Choice::named(name).expect("clap lets only known names through"));
        Ok(Self { choice, is_given: name.is_some() })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Where the parameters of flags are declared.
pub trait Source {
    /// Every parameter, without duplicates, in the order of help.
    fn parameters() -> Vec<Declared>;
}

/// A parameter, the names of its values, its default, and the check of a value.
pub struct Declared {
    info: ParameterInfo,
    names: Vec<(&'static str, &'static str)>,
    default: Option<String>,
    check: Arc<dyn Fn(&str) -> Result<(), String> + Send + Sync>,
}

/// The parameters of a kind's techniques.
impl<K: Kind + ?Sized> Source for K {
    fn parameters() -> Vec<Declared> {
        let mut all: Vec<Declared> = Vec::new();
        for choice in Choice::<K>::all() {
            let Some(technique) = choice.technique() else { continue };
            for (info, names) in technique.parameters() {
                if all.iter().all(|other| other.info.name != info.name) {
                    let (default, choice) = (technique.get(info.name), choice.clone());
                    let check =
                        move |text: &str| choice.clone().technique_mut().map_or(Ok(()), |it| it.set(info.name, text));
                    all.push(Declared { info, names, default, check: Arc::new(check) });
                }
            }
        }
        all
    }
}

/// The parameters of deep images.
pub struct DeepImages;

impl Source for DeepImages {
    fn parameters() -> Vec<Declared> {
        let usual = DeepImageSettings::default();
        let declared = |(info, names): (ParameterInfo, _)| Declared {
            info,
            names,
            default: usual.get(info.name),
            check: Arc::new(move |text| DeepImageSettings::default().set(info.name, text)),
        };
        usual.parameters().into_iter().map(declared).collect()
    }
}

/// A table of settings that belong to no technique.
pub struct Table<const INDEX: usize>;

/// The names of settings, by table.
const TABLES: [&[&str]; 4] = [
    &["attenuation", "attenuation-near-radius", "attenuation-coefficients", "range-threshold", "light-radius"],
    &["materials", "exposure", "tone-map", "anisotropy", "debug-view"],
    &["shadows", "ray-culling", "ray-range-culling", "shadow-rays", "history", "antialiasing"],
    &["samples", "accumulate", "textures"],
];
/// Flags of the lights' falloff and size.
pub type LightFlags = ParameterFlags<Table<0>>;
/// Flags of how radiance is displayed.
pub type LookArgs = ParameterFlags<Table<1>>;
/// Flags of shadows, and of frames that depend on each other.
pub type ShadowFlags = ParameterFlags<Table<2>>;
/// Flags of samples, and of bindings.
pub type SampleFlags = ParameterFlags<Table<3>>;

impl<const INDEX: usize> Source for Table<INDEX> {
    fn parameters() -> Vec<Declared> {
        let mut usual = Settings::default();
        let declared = |name: &&str| {
            let parameter = Settings::PARAMETERS.iter().find(|parameter| parameter.info.name == *name)?;
            let info = parameter.info;
            Some(Declared {
                info,
                names: (parameter.of)(&mut usual).names(),
                default: usual.get(info.name),
                check: Arc::new(move |text| Settings::default().set(info.name, text)),
            })
        };
        TABLES[INDEX].iter().filter_map(declared).collect()
    }
}

/// Flags of parameters: values by parameter name.
#[derive(Clone)]
pub struct ParameterFlags<S: ?Sized> {
    said: Vec<(&'static str, String)>,
    source: PhantomData<fn() -> Box<S>>,
}

impl<S: ?Sized> std::fmt::Debug for ParameterFlags<S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.said.fmt(f)
    }
}

impl<S: ?Sized> ParameterFlags<S> {
    /// Sets what is given, by `set`.
    fn each(&self, mut set: impl FnMut(&'static str, &str) -> Result<(), String>) {
        for (name, text) in &self.said {
            set(name, text).expect("the flag's parser has let it through");
        }
    }
}

impl<K: Kind + ?Sized> ParameterFlags<K> {
    /// Sets the given parameters of a technique. Ignores those of other techniques.
    pub fn turned(&self, mut choice: Choice<K>) -> Choice<K> {
        if let Some(technique) = choice.technique_mut() {
            self.each(|name, text| technique.set(name, text));
        }
        choice
    }
}

impl ParameterFlags<DeepImages> {
    /// Sets the given parameters.
    pub fn set(&self, images: &mut DeepImageSettings) {
        self.each(|name, text| images.set(name, text));
    }
}

impl<const INDEX: usize> ParameterFlags<Table<INDEX>> {
    /// Sets the given settings.
    pub fn set(&self, settings: &mut Settings) {
        self.each(|name, text| settings.set(name, text));
    }
}

/// Text of a number, of several, or of a word.
#[derive(Clone)]
pub(crate) struct Words(#[expect(dead_code, reason = "flags are read as text")] String);

impl<S: Source + ?Sized> Args for ParameterFlags<S> {
    fn augment_args(command: Command) -> Command {
        command.args(S::parameters().into_iter().map(|Declared { info, names: known, default, check }| {
            let flag = Arg::new(info.name).long(info.name).value_name(info.value).hide_short_help(!info.is_everyday);
            let number = {
                let check = check.clone();
                move |text: &str| check(text).and_then(|()| text.trim().parse::<f32>().map_err(|why| why.to_string()))
            };
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
                Range::Text => flag
                    .value_parser(move |text: &str| check(text).map(|()| Words(text.to_owned())))
                    .allow_hyphen_values(true),
            };
            let renamed = RENAMED.into_iter().filter(|(_, new)| *new == info.name);
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

impl<S: Source + ?Sized> FromArgMatches for ParameterFlags<S> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let last = |name: &str| Some(matches.get_raw(name)?.next_back()?.to_string_lossy().into_owned());
        let names = S::parameters().into_iter().map(|declared| declared.info.name);
        Ok(Self { said: names.filter_map(|name| Some((name, last(name)?))).collect(), source: PhantomData })
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
    let mut named = TABLES.concat();
    let mut declared: Vec<_> = Settings::PARAMETERS.iter().map(|parameter| parameter.info.name).collect();
    named.sort();
    declared.sort();
    assert_eq!(named, declared);
}
