//! The four layers of light that denoising makes, and that shading reads.

use glam::UVec2;
use lanternfish_gpu::Frame;

use crate::texture::frame_layers;

/// Layers of [`DemodulatedIrradiance`](crate::indirect::DemodulatedIrradiance): diffuse and glossy, each at normal and at grazing incidence.
pub(crate) const LAYERS: u32 = 4;

/// Creates a texture for the four layers, writable by compute passes: an array of four RGBA layers of 16-bit floats. The first two hold diffuse
/// light at normal and at grazing incidence (irradiance over π, nits), the others glossy light at both (radiance, nits).
pub fn layers_target(frame: &mut Frame<'_>, size: UVec2) -> wgpu::TextureView {
    frame_layers(frame, "indirect/layers", size, wgpu::TextureFormat::Rgba16Float, LAYERS)
}
