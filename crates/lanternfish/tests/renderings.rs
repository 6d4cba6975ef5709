//! Images on a real adapter: against ground truth, against each other, from run to run.
//!
//! Every test that needs an adapter is called `gpu_…`.

#[path = "renderings/conformance.rs"]
mod conformance;
#[path = "renderings/examples.rs"]
#[allow(clippy::duplicate_mod, reason = "each example has the module that it shares with the others")]
mod examples;
#[path = "renderings/ground_truth.rs"]
mod ground_truth;
#[path = "renderings/normals.rs"]
mod normals;
#[path = "renderings/regressions.rs"]
mod regressions;
#[path = "renderings/sky.rs"]
mod sky;
#[path = "renderings/support.rs"]
#[allow(dead_code, reason = "images of the papers' techniques have it too")]
mod support;
#[path = "renderings/surfaces.rs"]
mod surfaces;
