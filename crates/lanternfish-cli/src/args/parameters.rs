//! The flags of each kind of technique: one flag that chooses the technique, and one for each parameter.

use std::marker::PhantomData;

use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, builder::TypedValueParser as _, value_parser};
use lanternfish::technique::{Choice, Kind, ParameterInfo, Range};

use crate::{choices::names, flags::as_flags, parse};

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
        let choice = name
            .map_or_else(K::default_choice, |name| Choice::named(name).expect("clap lets only known names through"));
        Ok(Self { choice, is_given: name.is_some() })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// The flags of the parameters of a kind's techniques: values by parameter name.
#[derive(Clone, Debug)]
pub struct ParameterFlags<K: ?Sized> {
    said: Vec<(&'static str, String)>,
    kind: PhantomData<fn() -> Box<K>>,
}

impl<K: Kind + ?Sized> ParameterFlags<K> {
    /// Sets the given parameters of a technique. Ignores those of other techniques.
    pub fn turned(&self, mut choice: Choice<K>) -> Choice<K> {
        if let Some(technique) = choice.technique_mut() {
            for (name, text) in &self.said {
                technique.set(name, text).expect("the flag's parser has let it through");
            }
        }
        choice
    }
}

/// A technique, one of its parameters, and the names of the parameter's values.
type ParameterOf<K> = (Choice<K>, ParameterInfo, Vec<(&'static str, &'static str)>);

/// Every parameter of a kind's techniques, without duplicates.
fn parameters<K: Kind + ?Sized>() -> Vec<ParameterOf<K>> {
    let mut all: Vec<ParameterOf<K>> = Vec::new();
    for choice in Choice::<K>::all() {
        for (words, known) in choice.technique().map(|technique| technique.parameters()).unwrap_or_default() {
            if all.iter().all(|(_, other, _)| other.name != words.name) {
                all.push((choice.clone(), words, known));
            }
        }
    }
    all
}

impl<K: Kind + ?Sized> Args for ParameterFlags<K> {
    fn augment_args(command: Command) -> Command {
        command.args(parameters::<K>().into_iter().map(|(choice, words, known)| {
            let default =
                choice.technique().and_then(|technique| technique.get(words.name)).filter(|_| words.shows_default);
            let flag = Arg::new(words.name).long(words.name).value_name(words.value).hide_short_help(true);
            let flag = match words.range {
                Range::Count(least, most) => {
                    let range = value_parser!(u32).range(i64::from(least)..=i64::from(most));
                    flag.value_parser(range).allow_hyphen_values(true)
                }
                Range::Positive => flag.value_parser(parse::positive).allow_hyphen_values(true),
                Range::Names => flag.value_parser(names(known)),
                Range::Numbers => {
                    flag.value_parser(names(known).map(|name| name.parse::<u32>().expect("these names are numbers")))
                }
                Range::Switch(on, off) => flag.value_parser(names([("on", on), ("off", off)]).map(|name| name == "on")),
                Range::Text => flag.value_parser(move |text: &str| {
                    let mut tried = choice.clone();
                    let technique = tried.technique_mut().expect("a technique has the parameter");
                    technique.set(words.name, text).map(|()| text.to_owned())
                }),
            };
            let renamed = RENAMED.into_iter().filter(|(_, new)| *new == words.name);
            let flag = renamed.fold(flag, |flag, (old, _)| flag.alias(old));
            // The parser holds the text for its lifetime; leaking the few texts is acceptable.
            let flag = default.into_iter().fold(flag, |flag, text| flag.default_value(&*text.leak()));
            with_help(flag, words.help)
        }))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<K: Kind + ?Sized> FromArgMatches for ParameterFlags<K> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let last = |name: &str| Some(matches.get_raw(name)?.next_back()?.to_string_lossy().into_owned());
        let said = parameters::<K>().iter().filter_map(|(_, words, _)| Some((words.name, last(words.name)?))).collect();
        Ok(Self { said, kind: PhantomData })
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
