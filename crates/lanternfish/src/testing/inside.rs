//! Internal state of a renderer.

use glam::{UVec2, Vec3};
use lanternfish_gpu::{Frame, Gpu, Growth, Profiler, read_texture};
use lanternfish_scene::Camera;

use crate::{GpuScene, RenderError, Renderer, context::FrameContext, rays::Tracer, view::View};

/// Number of builds of the first acceleration structure; none if there is none.
pub fn structure_builds(renderer: &Renderer) -> Option<u64> {
    renderer.passes.structures.first().map(|(_, structure)| structure.builds())
}

/// Number of acceleration structures in a frame.
pub fn structures(renderer: &Renderer) -> usize {
    renderer.passes.structures.len()
}

/// Size of the state that is stored between frames, bytes.
pub fn kept_bytes(renderer: &mut Renderer) -> u64 {
    renderer.pool.get_mut().unwrap().bytes()
}

/// The growth policy of lists.
pub fn growth(renderer: &mut Renderer) -> Growth {
    renderer.pool.get_mut().unwrap().growth()
}

/// Runs a frame that ends in an error.
pub fn fail(renderer: &mut Renderer) {
    let failed = renderer.checked_work::<()>(|_| Err(RenderError::NoFrames));
    assert!(matches!(failed, Err(RenderError::NoFrames)));
}

/// Ambient visibility of each pixel; rows from the top.
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

/// Returns an error if this driver does not support the tracer for shadows.
pub fn check_shadow_driver(tracer: Tracer, adapter: &wgpu::AdapterInfo) -> Result<(), RenderError> {
    crate::shadows::check_driver(tracer, adapter)
}

/// The integrals tabulated in `environment_light/brdf_fractions.rs`.
pub fn brdf_fractions(n_dot_v: f64, perceptual_roughness: f64) -> [f64; 2] {
    crate::environment_light::brdf_fractions::fractions(n_dot_v, perceptual_roughness)
}

/// Sets, for this thread, the maximum number of samples that are traced together, and the initial capacity of a radiance cache, entries.
pub fn limit_samples_and_first_entries(samples: u64, first_entries: u32) {
    crate::indirect::sampled::MOST_SAMPLES_IN_TESTS.set(samples);
    crate::indirect::radiance_cache::FIRST_ENTRIES_IN_TESTS.set(first_entries);
}
