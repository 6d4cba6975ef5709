//! Images on a real adapter by every technique of the library and of this crate: against each other, between runs, and
//! with changing scenes.
//!
//! Every test that needs an adapter is called `gpu_…`.

#[macro_use]
extern crate lanternfish_gpu_test;

#[path = "renderings/animation.rs"]
mod animation;
#[path = "renderings/area_lights.rs"]
mod area_lights;
#[path = "renderings/changes.rs"]
mod changes;
#[path = "renderings/corners.rs"]
mod corners;
#[path = "renderings/identical.rs"]
mod identical;
#[path = "renderings/normals.rs"]
mod normals;
#[path = "renderings/passes.rs"]
mod passes;
#[path = "../../../crates/lanternfish/tests/renderings/support.rs"]
#[allow(dead_code, reason = "the library's own images have it too")]
mod support;

/// The adapter, after the techniques are registered; none if the test is skipped.
fn gpu(test: &str) -> Option<&'static lanternfish_gpu::Gpu> {
    lanternfish_papers::register();
    lanternfish_gpu::testing::gpu(test)
}
