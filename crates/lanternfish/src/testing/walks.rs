//! Images along a walk, and their errors.

use glam::{Vec3, Vec4};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{Camera, Scene};

use super::looking;
use crate::{RenderedImage, Renderer, Settings};

/// Size of the images, pixels.
pub const SIZE: (u32, u32) = (64, 48);

/// A renderer on the shared engine of the tests.
pub fn renderer(gpu: &Gpu, settings: Settings) -> Renderer {
    Renderer::with_engine(&testing::engine(gpu), settings).unwrap()
}

/// Radiance, nits.
pub fn pixels(rendering: &RenderedImage) -> Vec<Vec3> {
    rendering.radiance.iter().map(|pixel| Vec4::from(*pixel).truncate()).collect()
}

/// The last of the images along a walk.
pub fn walked(gpu: &Gpu, settings: Settings, scene: &Scene, cameras: &[Camera]) -> Vec<Vec3> {
    let mut renderer = renderer(gpu, settings);
    let uploaded = renderer.upload(scene).unwrap();
    let mut last = Vec::new();
    for camera in cameras {
        last = pixels(&renderer.render(&uploaded, camera, SIZE.into()).unwrap());
    }
    last
}

/// Mean of the channels' sums.
pub fn mean(rendering: &[Vec3]) -> f32 {
    rendering.iter().map(|pixel| pixel.element_sum()).sum::<f32>() / rendering.len() as f32
}

/// Mean absolute error over the mean of the ground truth.
pub fn off(rendering: &[Vec3], ground_truth: &[Vec3]) -> f32 {
    let apart: f32 = rendering.iter().zip(ground_truth).map(|(a, b)| (*a - *b).abs().element_sum()).sum();
    apart / (mean(ground_truth) * ground_truth.len() as f32)
}

/// A short walk into the Cornell box.
pub fn steps(count: u32) -> Vec<Camera> {
    let at = |step: u32| looking([0.01 * step as f32, 1.0, 2.6 - 0.005 * step as f32], [0.0, 0.8, 0.0]);
    (0..count).map(at).collect()
}
