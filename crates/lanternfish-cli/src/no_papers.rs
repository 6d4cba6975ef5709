//! Stands for `paper.rs` in a program without the feature `papers`: no techniques, and a `--as` that is an error.

use std::ffi::{OsStr, OsString};

use lanternfish::{
    rays::Structure,
    settings::{GivenSettings, Quality, Settings},
};

use crate::{args::spelling::Spelling, mistakes::NO_PAPERS};

/// A paper: there is none.
#[derive(Clone, Copy, Debug)]
pub enum Paper {}

/// Registers no technique.
pub fn register() {}

/// Refuses the name of any paper.
impl Spelling for Paper {
    type Value = Self;

    fn read(_: &OsStr) -> Result<Self, String> {
        Err(NO_PAPERS.to_owned())
    }

    fn text(paper: &Self) -> OsString {
        match *paper {}
    }
}

/// No structure.
pub(crate) fn structure(_quality: Quality) -> Structure {
    Structure::NONE
}

/// No settings.
pub(crate) fn given(_paper: Option<Paper>) -> GivenSettings {
    GivenSettings::default()
}

/// The same settings.
pub(crate) fn for_moving(_paper: Option<Paper>, _settings: &mut Settings) {}

/// The table of no paper.
pub(crate) fn table(paper: Paper, _settings: &Settings) -> String {
    match paper {}
}
