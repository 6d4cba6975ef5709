//! The command line of Lanternfish: the program `lanternfish`, and the code that `lanternfish-bench` shares with it.

#![cfg_attr(
    not(feature = "unstable"),
    allow(dead_code, private_interfaces, unused_imports, reason = "the feature makes the rest public")
)]

#[cfg(test)]
#[macro_use]
extern crate lanternfish_gpu_test;

/// Modules of one of two lists. The name is one in which rustfmt looks for modules.
macro_rules! cfg_if {
    (if #[cfg($condition:meta)] { $($then:item)* } else { $($otherwise:item)* }) => {
        $(#[cfg($condition)] $then)*
        $(#[cfg(not($condition))] $otherwise)*
    };
}

// The modules are public for the project's other crates alone.
cfg_if! {
    if #[cfg(feature = "unstable")] {
        pub mod args;
        pub mod camera;
        pub mod choices;
        pub mod error;
        pub mod flags;
        pub mod help;
        pub mod images;
        pub mod light_rig;
        pub mod output;
        pub mod parse;
        pub mod pass_costs;
        pub mod plot;
        pub mod program;
        pub mod progress;
        pub mod repeat;
        pub mod replay;
        pub mod report;
        pub mod scene;
        pub mod shot;
        pub mod times;
    } else {
        mod args;
        mod camera;
        mod choices;
        mod error;
        mod flags;
        mod help;
        mod images;
        mod light_rig;
        mod output;
        mod parse;
        mod pass_costs;
        mod plot;
        mod program;
        mod progress;
        mod repeat;
        mod replay;
        mod report;
        mod scene;
        mod shot;
        mod times;
    }
}

mod cli;
mod compare;
mod deep_images;
mod doctor;
mod ending;
mod farm;
mod frames;
mod info;
mod legend;
mod mistakes;
mod motion;
mod paper;
mod papers;
mod recording;
mod reference;
mod render;
mod renderings;
mod sheet;
mod signals;
mod stage;
mod stereo;
mod warm;
mod window;

pub use cli::main;
#[cfg(feature = "unstable")]
pub use reference::fingerprint;
#[cfg(feature = "unstable")]
pub use render::apply_lights;
