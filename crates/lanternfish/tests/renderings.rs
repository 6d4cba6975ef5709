//! Images on a real adapter: compared with ground truth, with each other, and between runs.
//!
//! Every test that needs an adapter is named `gpu_…`.

#[macro_use]
extern crate lanternfish_gpu_test;

#[path = "renderings/conformance.rs"]
mod conformance;
#[path = "renderings/examples.rs"]
#[allow(clippy::duplicate_mod, reason = "the examples share a module")]
mod examples;
#[path = "renderings/ground_truth.rs"]
mod ground_truth;
#[path = "renderings/light_lists.rs"]
mod light_lists;
#[path = "renderings/moving.rs"]
mod moving;
#[path = "renderings/regressions.rs"]
mod regressions;
#[path = "renderings/sampled_lights.rs"]
mod sampled_lights;
#[path = "renderings/sky.rs"]
mod sky;
#[path = "renderings/support.rs"]
#[allow(dead_code, reason = "the tests of the papers' techniques use it too")]
mod support;
#[path = "renderings/surfaces.rs"]
mod surfaces;
