//! Flags whose values are names.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use lanternfish_scene::Named;

use crate::flags::as_flags;

/// Parses a value by name. Unknown names are refused with the list of valid ones.
pub fn choice<T: Named>() -> impl TypedValueParser<Value = T> {
    names(T::all().into_iter().map(|value| (value.name(), value.help()))).map(|name| {
        T::all().into_iter().find(|value| value.name() == name).expect("clap lets only known names through")
    })
}

/// Parses one of these names, each with a line of help.
pub(crate) fn names(known: impl IntoIterator<Item = (&'static str, &'static str)>) -> PossibleValuesParser {
    PossibleValuesParser::new(known.into_iter().map(|(name, meaning)| PossibleValue::new(name).help(as_flags(meaning))))
}
