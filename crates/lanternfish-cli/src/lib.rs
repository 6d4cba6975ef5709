//! The command line of Lanternfish: the program `lanternfish`, and the code that `lanternfish-bench` shares with it.

#[cfg(test)]
#[macro_use]
extern crate lanternfish_gpu_test;

pub mod args;
pub mod camera;
pub mod choices;
mod cli;
mod compare;
mod deep_images;
mod doctor;
pub mod error;
mod farm;
pub mod flags;
mod frames;
pub mod help;
pub mod images;
mod info;
mod legend;
pub mod light_rig;
mod mistakes;
mod motion;
pub mod output;
pub mod parse;
pub mod pass_costs;
pub mod plot;
pub mod program;
pub mod progress;
mod recording;
mod reference;
mod render;
mod renderings;
pub mod repeat;
pub mod replay;
pub mod report;
pub mod scene;
pub mod shot;
mod signals;
mod stereo;
pub mod times;
mod warm;
mod window;

pub use cli::main;
pub use reference::fingerprint;
pub use render::apply_lights;
