//! The command line of Lanternfish: the program `lanternfish`, and the code that `lanternfish-bench` shares with it.

#![cfg_attr(
    not(all(feature = "papers", feature = "window")),
    allow(dead_code, unused_imports, reason = "windows and the sheet of papers use the rest")
)]

#[cfg(all(test, not(all(feature = "papers", feature = "window"))))]
compile_error!("the tests need the default features");

#[cfg(test)]
#[macro_use]
extern crate lanternfish_gpu_test;

// Public for the project's other crates alone: no part of the interface, without promises.
#[doc(hidden)]
pub mod args;
#[doc(hidden)]
pub mod camera;
#[doc(hidden)]
pub mod choices;
#[doc(hidden)]
pub mod document;
#[doc(hidden)]
pub mod error;
#[doc(hidden)]
pub mod flags;
#[doc(hidden)]
pub mod help;
#[doc(hidden)]
pub mod images;
#[doc(hidden)]
pub mod light_rig;
#[doc(hidden)]
pub mod opened;
#[doc(hidden)]
pub mod output;
#[cfg_attr(not(feature = "papers"), path = "no_papers.rs")]
#[doc(hidden)]
pub mod paper;
#[doc(hidden)]
pub mod parse;
#[doc(hidden)]
pub mod pass_costs;
#[doc(hidden)]
pub mod plot;
#[doc(hidden)]
pub mod program;
#[doc(hidden)]
pub mod progress;
#[doc(hidden)]
pub mod replay;
#[doc(hidden)]
pub mod report;
#[doc(hidden)]
pub mod scene;
#[doc(hidden)]
pub mod shot;
#[doc(hidden)]
pub mod table;
#[doc(hidden)]
pub mod timed;
#[doc(hidden)]
pub mod times;

mod cli;
mod compare;
mod doctor;
mod ending;
mod frames;
mod info;
mod legend;
mod mistakes;
mod motion;
mod outputs;
#[cfg(feature = "papers")]
mod papers;
mod recording;
mod reference;
mod render;
mod shaders;
mod sheet;
mod signals;
mod stage;
mod stereo;
#[cfg(test)]
mod testing;
mod warm;
#[cfg(feature = "window")]
mod window;

pub use cli::main;
#[doc(hidden)]
pub use cli::main_of;
#[doc(hidden)]
pub use reference::fingerprint;
#[doc(hidden)]
pub use render::{apply_lights, scene_with_lights};
