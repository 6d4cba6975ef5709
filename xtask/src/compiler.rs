//! A C++ compiler, where there is none: meshopt's decoder, which glTF files are compressed with, is written in it.

use std::env;

use crate::{
    apt::{self, NO_INSTALL},
    command::find_program,
};

/// Installs one on Debian and Ubuntu; elsewhere the build says what it misses.
pub fn ensure(may_install: bool) -> Result<(), String> {
    // What the build asks for, on Linux.
    let has_one = env::var_os("CXX").is_some() || find_program("c++").is_some();
    if has_one || !may_install || !apt::is_there() {
        return Ok(());
    }
    eprintln!("==> No C++ compiler: installing g++ ({NO_INSTALL} leaves the machine as it is)");
    apt::install(&[], &["g++"])
}
