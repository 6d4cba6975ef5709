//! What a renderer does not tell of its frames.

use glam::{UVec2, Vec3};
use lanternfish_gpu::{Frame, Gpu, Growth, Profiler, read_texture};
use lanternfish_scene::Camera;

use crate::{GpuScene, RenderError, Renderer, context::FrameContext, rays::Tracer, view::View};

/// How often the structure that rays go through has been built; none where there is none.
pub fn structure_builds(renderer: &Renderer) -> Option<u64> {
    renderer.passes.structure.as_ref().map(|structure| structure.builds())
}

/// Bytes that are kept from frame to frame.
pub fn kept_bytes(renderer: &mut Renderer) -> u64 {
    renderer.pool.get_mut().unwrap().bytes()
}

/// How frames get the room of their lists.
pub fn growth(renderer: &mut Renderer) -> Growth {
    renderer.pool.get_mut().unwrap().growth()
}

/// A frame that ends in an error.
pub fn fail(renderer: &mut Renderer) {
    let failed = renderer.checked_work::<()>(|_| Err(RenderError::NoFrames));
    assert!(matches!(failed, Err(RenderError::NoFrames)));
}

/// How open each pixel is; rows from the top.
pub fn ambient_visibility(
    gpu: &Gpu,
    renderer: &mut Renderer,
    scene: &GpuScene,
    camera: &Camera,
    size: UVec2,
) -> Vec<f32> {
    let views = [View::new(camera, size, Vec3::ZERO, &scene.bounds)];
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let context = FrameContext { scene, views: &views, is_averaged: false, requests: &[] };
    let result = renderer.passes.record(&mut frame, &context).unwrap().remove(0);
    frame.submit();
    read_texture(&gpu.device, &gpu.queue, result.shaded.ambient_visibility.unwrap().texture.texture()).unwrap()
}

/// An error where shadows cannot be traced so with this driver.
pub fn check_shadow_driver(tracer: Tracer, adapter: &wgpu::AdapterInfo) -> Result<(), RenderError> {
    crate::shadows::check_driver(tracer, adapter)
}

/// The integrals that `environment_light/brdf_fractions.rs` has tables of.
pub fn brdf_fractions(n_dot_v: f64, perceptual_roughness: f64) -> [f64; 2] {
    crate::environment_light::brdf_fractions::fractions(n_dot_v, perceptual_roughness)
}

/// From now on, in this thread: rounds of rays that are traced together, at most, and cells that a radiance cache has room for at first.
pub fn limit_samples_and_first_entries(rounds: u64, first_entries: u32) {
    crate::indirect::sampled::MOST_SAMPLES_IN_TESTS.set(rounds);
    crate::indirect::radiance_cache::FIRST_ENTRIES_IN_TESTS.set(first_entries);
}
