//! Render targets.

use glam::UVec2;

/// Linear radiance, nits. Half floats: the widest format that every adapter can blend.
pub const RADIANCE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// The picture so far: linear, scene-referred.
#[derive(Clone, Debug)]
pub struct Radiance {
    /// RGB: nits; A: 1 where a surface is. One sample a pixel: the mean, where more are drawn.
    pub target: wgpu::TextureView,
    /// What is drawn to, where that is not the target itself.
    pub(crate) drawn: Option<wgpu::TextureView>,
    pub(crate) size: UVec2,
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
pub(crate) fn target(
    device: &wgpu::Device,
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
    more: wgpu::TextureUsages,
) -> wgpu::TextureView {
    samples_target(device, label, size, format, more, 1)
}

/// The same with so many samples a pixel.
pub(crate) fn samples_target(
    device: &wgpu::Device,
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
    more: wgpu::TextureUsages,
    samples: u32,
) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: samples,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING | more,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}
