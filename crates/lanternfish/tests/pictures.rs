//! Pictures on a real adapter: against ground truth, against each other, from run to run.
//!
//! Every test that needs an adapter is called `gpu_…`.

#[path = "pictures/conformance.rs"]
mod conformance;
#[path = "pictures/examples.rs"]
#[allow(clippy::duplicate_mod, reason = "each example has the module that it shares with the others")]
mod examples;
#[path = "pictures/ground_truth.rs"]
mod ground_truth;
#[path = "pictures/normals.rs"]
mod normals;
#[path = "pictures/regressions.rs"]
mod regressions;
#[path = "pictures/sky.rs"]
mod sky;
#[path = "pictures/support.rs"]
#[allow(dead_code, reason = "pictures of the papers' techniques have it too")]
mod support;
#[path = "pictures/surfaces.rs"]
mod surfaces;
