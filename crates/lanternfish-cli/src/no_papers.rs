//! Stands for `paper.rs` in a program without the feature `papers`: no techniques, and a `--as` that is an error.

use std::ffi::OsStr;

use clap::builder::TypedValueParser;
use lanternfish::{
    rays::Structure,
    settings::{GivenSettings, Quality, Settings},
};

use crate::mistakes::NO_PAPERS;

/// The id of the flag.
pub(crate) const ID: &str = "paper";

/// A paper: there is none.
#[derive(Clone, Copy, Debug)]
pub enum Paper {}

/// Registers no technique.
pub fn register() {}

/// Refuses the name of any paper.
pub(crate) fn parser() -> impl TypedValueParser<Value = Paper> {
    |_: &str| Err::<Paper, _>(NO_PAPERS)
}

/// No structure.
pub(crate) fn structure(_quality: Quality) -> Structure {
    Structure::NONE
}

/// No settings.
pub(crate) fn given(_name: Option<&OsStr>) -> GivenSettings {
    GivenSettings::default()
}

/// The same settings.
pub(crate) fn for_moving(_paper: Option<Paper>, _settings: &mut Settings) {}

/// The table of no paper.
pub(crate) fn table(paper: Paper, _settings: &Settings) -> String {
    match paper {}
}
