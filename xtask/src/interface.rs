//! `cargo xtask interface`: the public items of the product's crates, stored in `docs/interface.txt`.
//!
//! An item is a struct, union, enum, trait, function, constant, static, type alias or macro that a path from the
//! crate's root reaches, or a method, constant or type of an inherent `impl` or of a trait. It counts once, under the
//! shortest of its paths. Fields, variants, implementations of traits, modules, items of other crates and what is
//! `#[doc(hidden)]` do not count.
//!
//! The source is rustdoc's JSON, whose format changes with the compiler: another format than [`listing::FORMAT`] is
//! left out with a line. Warnings of rustdoc are errors, so this checks the documentation, too, that of hidden items
//! included.

mod listing;
#[cfg(test)]
mod tests;

use std::{
    env,
    process::{Command, ExitCode},
};

use serde_json::Value;

use crate::{
    command::{cargo, run as step, workspace},
    files::{at, read, write},
};
use listing::{FORMAT, Listing};

/// The crates whose public items are promised.
const CRATES: [&str; 9] = [
    "lanternfish",
    "lanternfish-build",
    "lanternfish-cli",
    "lanternfish-gpu",
    "lanternfish-limits",
    "lanternfish-metrics",
    "lanternfish-reference",
    "lanternfish-scene",
    "lanternfish-viewer",
];

/// Most items of `lanternfish`, and of all crates.
const MOST: [usize; 2] = [200, 450];

/// Set by this task for the rustdoc that cargo starts, which is this program: see [`as_rustdoc`].
const AS_RUSTDOC: &str = "LANTERNFISH_XTASK_AS_RUSTDOC";

/// Flags of rustdoc.
const FLAGS: &str = "-D warnings -Z unstable-options --output-format json --document-hidden-items";

/// Compares the interface with the stored one and fails if they differ; `--write` stores it.
pub fn run(words: &[String]) -> Result<(), String> {
    let is_stored = match words {
        [] => false,
        [flag] if flag == "--write" => true,
        _ => return Err(format!("interface takes --write, not {words:?}")),
    };
    let listings = match listings()? {
        Ok(listings) => listings,
        Err(reason) => {
            eprintln!("LEFT OUT (tool): interface: {reason}");
            return Ok(());
        }
    };
    let counts = [listings[0].count(), listings.iter().map(Listing::count).sum()];
    if counts.iter().zip(MOST).any(|(count, most)| *count > most) {
        return Err(format!(
            "{counts:?} public items in lanternfish and in all crates, of {MOST:?}: an item that no user needs should be `pub(crate)` \
             or `#[doc(hidden)]`"
        ));
    }
    let (path, new) = (workspace().join("docs/interface.txt"), listing::page(&listings));
    if is_stored {
        write(&path, new)?;
        println!("wrote {}", path.display());
        return Ok(());
    }
    match listing::differences(&read(&path)?, &new) {
        lines if lines.is_empty() => Ok(()),
        lines => Err(format!(
            "the public interface differs from docs/interface.txt:\n{}\nIf that is intended, run `cargo xtask interface --write` and \
             commit the file",
            lines.join("\n")
        )),
    }
}

/// The interface of each crate, or the reason why this compiler cannot tell.
fn listings() -> Result<Result<Vec<Listing>, String>, String> {
    let program = env::current_exe().map_err(|error| format!("this program's path: {error}"))?;
    // Without the program `lanternfish`, whose documentation has the path of the library's.
    let mut document = cargo(["doc", "--quiet", "--workspace", "--no-deps", "--lib", "--bin", "xtask"]);
    step(document.env("RUSTDOC", &program).env(AS_RUSTDOC, "1").env("RUSTDOCFLAGS", FLAGS))?;
    // Beside the folder of this program.
    let folder = program.ancestors().nth(2).expect("cargo has built it").join("doc");
    let mut listings = Vec::new();
    for name in CRATES {
        let path = folder.join(format!("{}.json", name.replace('-', "_")));
        let documentation: Value = at(&path, serde_json::from_str(&read(&path)?))?;
        let Some(listing) = Listing::of(name, &documentation) else {
            let format = &documentation["format_version"];
            return Ok(Err(format!("rustdoc's JSON has the format {format}, and only {FORMAT} is read")));
        };
        listings.push(listing);
    }
    Ok(Ok(listings))
}

/// Runs rustdoc with its unstable options, if cargo started this program as rustdoc. Only rustdoc sees the variable
/// that allows them: it would make cargo compile every dependency again whose build script reads it.
pub fn as_rustdoc() -> Option<ExitCode> {
    env::var_os(AS_RUSTDOC)?;
    let status = Command::new("rustdoc").args(env::args_os().skip(1)).env("RUSTC_BOOTSTRAP", "1").status();
    match status {
        Ok(status) if status.success() => Some(ExitCode::SUCCESS),
        Ok(_) => Some(ExitCode::FAILURE),
        Err(error) => {
            eprintln!("rustdoc: {error}");
            Some(ExitCode::FAILURE)
        }
    }
}
