//! Images on a real adapter by every technique, the library's and this crate's: against each other, from run to run, while scenes change.
//!
//! Every test that needs an adapter is called `gpu_…`.

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
#[path = "renderings/passes.rs"]
mod passes;
#[path = "../../lanternfish/tests/renderings/support.rs"]
#[allow(dead_code, reason = "the library's own images have it too")]
mod support;

/// The adapter, once the techniques are registered; none where the test is left out.
fn gpu(test: &str) -> Option<&'static lanternfish_gpu::Gpu> {
    lanternfish_papers::register();
    lanternfish_gpu::testing::gpu(test)
}
