//! Installs a C++ compiler if there is none. The decoder of meshoptimizer, for compressed glTF files, is written in C++.

use std::env;

use crate::{
    apt::{self, NO_INSTALL},
    command::find_program,
};

/// Installs one on Debian and Ubuntu; elsewhere the build reports what is missing.
pub fn ensure(may_install: bool) -> Result<(), String> {
    // The compilers that the build looks for on Linux.
    let has_one = env::var_os("CXX").is_some() || find_program("c++").is_some();
    if has_one || !may_install || !apt::is_there() {
        return Ok(());
    }
    eprintln!("==> No C++ compiler: installing g++ ({NO_INSTALL} leaves the machine as it is)");
    apt::install(&[], &["g++"])
}
