//! The flags that families of rooms declare: one that chooses a room, and one for each setting of any of its rooms.

use std::marker::PhantomData;

use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, builder::TypedValueParser as _, value_parser};
use lanternfish::technique::{Kind, ParameterInfo, Range};

use crate::{choices::names, flags::as_flags, parse};

/// The flag that chooses a room.
#[derive(Clone, Copy, Debug)]
pub struct RoomFlag<F>(pub F);

impl<F: Kind> Args for RoomFlag<F> {
    fn augment_args(command: Command) -> Command {
        let rooms = F::rooms().into_iter().filter_map(|family| Some((family.name(), family.room()?.words())));
        let known = names([(F::NONE_NAME, F::NONE_SUMMARY)].into_iter().chain(rooms));
        let flag = Arg::new(F::FLAG).long(F::FLAG).value_name("NAME").value_parser(known);
        let flag = flag.default_value(F::default().name()).hide_short_help(!F::IS_EVERYDAY);
        command.arg(with_help(flag, F::HELP))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<F: Kind> FromArgMatches for RoomFlag<F> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let name = matches.get_one::<String>(F::FLAG).expect("it has a default");
        Ok(Self(F::named(name).expect("clap lets only known names through")))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// The flags of a family's settings: what was said of them, by their names.
#[derive(Clone, Debug)]
pub struct KnobFlags<F> {
    said: Vec<(&'static str, String)>,
    family: PhantomData<F>,
}

impl<F: Kind> KnobFlags<F> {
    /// A room with what was said of its settings. What was said of another room's is left aside.
    pub fn turned(&self, mut family: F) -> F {
        if let Some(room) = family.room_mut() {
            for (name, text) in &self.said {
                room.set(name, text).expect("the flag's parser has let it through");
            }
        }
        family
    }
}

/// A room, what is said of one of its settings, and the names of the setting's values.
type KnobOf<F> = (F, ParameterInfo, Vec<(&'static str, &'static str)>);

/// Every setting of a family's rooms, once.
fn knobs<F: Kind>() -> Vec<KnobOf<F>> {
    let mut all: Vec<KnobOf<F>> = Vec::new();
    for family in F::rooms() {
        for (words, known) in family.room().map(|room| room.parameters()).unwrap_or_default() {
            if all.iter().all(|(_, other, _)| other.name != words.name) {
                all.push((family, words, known));
            }
        }
    }
    all
}

impl<F: Kind> Args for KnobFlags<F> {
    fn augment_args(command: Command) -> Command {
        command.args(knobs::<F>().into_iter().map(|(family, words, known)| {
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
                    let mut tried = family;
                    let room = tried.room_mut().expect("a room has the setting");
                    room.set(words.name, text).map(|()| text.to_owned())
                }),
            };
            let default = family.room().and_then(|room| room.get(words.name)).filter(|_| words.shows_default);
            // The parser keeps it as long as it lives, and there are few.
            let flag = default.into_iter().fold(flag, |flag, text| flag.default_value(&*text.leak()));
            with_help(flag, words.help)
        }))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<F: Kind> FromArgMatches for KnobFlags<F> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let last = |name: &str| Some(matches.get_raw(name)?.next_back()?.to_string_lossy().into_owned());
        let said = knobs::<F>().iter().filter_map(|(_, words, _)| Some((words.name, last(words.name)?))).collect();
        Ok(Self { said, family: PhantomData })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Help as clap derives it from a comment: the first paragraph is the short one.
fn with_help(flag: Arg, text: &str) -> Arg {
    let text = as_flags(text);
    match text.split_once("\n\n") {
        None => flag.help(text.trim_end_matches('.').to_owned()),
        Some((short, _)) => flag.help(short.trim_end_matches('.').to_owned()).long_help(text),
    }
}
