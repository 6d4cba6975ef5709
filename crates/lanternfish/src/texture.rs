//! Render targets.

use glam::UVec2;
use lanternfish_gpu::{Frame, texture_of};

/// Linear radiance, nits. Half floats: the widest format that every adapter can blend.
pub const RADIANCE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// The image so far: linear, scene-referred.
#[derive(Clone, Debug)]
pub struct Radiance {
    /// RGB: nits; A: 1 where a surface is. One sample a pixel: the mean, where more are drawn.
    pub target: wgpu::TextureView,
    /// What is drawn to, where that is not the target itself.
    pub(crate) drawn: Option<wgpu::TextureView>,
}

impl Radiance {
    /// As an attachment; what is drawn is averaged into the target after each pass.
    pub(crate) fn color(&self, load: wgpu::LoadOp<wgpu::Color>) -> wgpu::RenderPassColorAttachment<'_> {
        wgpu::RenderPassColorAttachment {
            view: self.drawn.as_ref().unwrap_or(&self.target),
            depth_slice: None,
            resolve_target: self.drawn.as_ref().map(|_| &self.target),
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        }
    }
}

/// A texture that is drawn to and read by later passes.
pub fn target(
    device: &wgpu::Device,
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
    more: wgpu::TextureUsages,
) -> wgpu::TextureView {
    texture_of(device, &described(label, size, format, more, 1))
}

/// The same for the frame in hand alone, with so many samples a pixel. It holds anything at first.
pub fn frame_target(
    frame: &mut Frame<'_>,
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
    more: wgpu::TextureUsages,
    samples: u32,
) -> wgpu::TextureView {
    frame.texture(&described(label, size, format, more, samples))
}

/// Several layers that compute passes of the frame in hand write and later ones read. They hold anything at first.
pub(crate) fn frame_layers(
    frame: &mut Frame<'_>,
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
    layers: u32,
) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
    let flat = described(label, size, format, wgpu::TextureUsages::empty(), 1);
    let size = wgpu::Extent3d { depth_or_array_layers: layers, ..flat.size };
    frame.texture(&wgpu::TextureDescriptor { size, usage, ..flat })
}

/// What a texture that is drawn to has to be.
pub(crate) fn described(
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
    more: wgpu::TextureUsages,
    samples: u32,
) -> wgpu::TextureDescriptor<'_> {
    wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: samples,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING | more,
        view_formats: &[],
    }
}
