//! The flags that families of rooms declare: one that chooses a room, and one for each setting of any of its rooms.

use std::marker::PhantomData;

use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, value_parser};
use lanternfish::rooms::{Family, KnobWords, Range};

use crate::{choices::names, parse};

/// The flag that chooses a room.
#[derive(Clone, Copy, Debug)]
pub struct RoomFlag<F>(pub F);

impl<F: Family> Args for RoomFlag<F> {
    fn augment_args(command: Command) -> Command {
        let rooms = F::rooms().into_iter().filter_map(|family| Some((family.name(), family.room()?.words())));
        let known = names([("none", F::NONE_WORDS)].into_iter().chain(rooms));
        let flag = Arg::new(F::FLAG).long(F::FLAG).value_name("NAME").value_parser(known);
        let flag = flag.default_value(F::default().name()).hide_short_help(!F::IS_EVERYDAY);
        command.arg(with_help(flag, F::HELP))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<F: Family> FromArgMatches for RoomFlag<F> {
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

impl<F: Family> KnobFlags<F> {
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

/// Every setting of a family's rooms, once, with the names of its values.
fn knobs<F: Family>() -> Vec<(KnobWords, Vec<(&'static str, &'static str)>)> {
    let mut all: Vec<(KnobWords, Vec<_>)> = Vec::new();
    for knob in F::rooms().iter().filter_map(Family::room).flat_map(|room| room.knobs()) {
        if all.iter().all(|(known, _)| known.name != knob.0.name) {
            all.push(knob);
        }
    }
    all
}

impl<F: Family> Args for KnobFlags<F> {
    fn augment_args(command: Command) -> Command {
        command.args(knobs::<F>().into_iter().map(|(words, known)| {
            let flag = Arg::new(words.name).long(words.name).value_name(words.value).hide_short_help(true);
            let flag = match words.range {
                Range::Count(least, most) => {
                    let range = value_parser!(u32).range(i64::from(least)..=i64::from(most));
                    flag.value_parser(range).allow_hyphen_values(true)
                }
                Range::Positive => flag.value_parser(parse::positive).allow_hyphen_values(true),
                Range::Names => flag.value_parser(names(known)),
            };
            with_help(flag, words.help)
        }))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<F: Family> FromArgMatches for KnobFlags<F> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let last = |name: &str| Some(matches.get_raw(name)?.next_back()?.to_string_lossy().into_owned());
        let said = knobs::<F>().iter().filter_map(|(words, _)| Some((words.name, last(words.name)?))).collect();
        Ok(Self { said, family: PhantomData })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Help as clap derives it from a comment: the first paragraph is the short one.
fn with_help(flag: Arg, text: &'static str) -> Arg {
    match text.split_once("\n\n") {
        None => flag.help(text.trim_end_matches('.')),
        Some((short, _)) => flag.help(short.trim_end_matches('.')).long_help(text),
    }
}
