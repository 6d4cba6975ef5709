//! Render targets.

use glam::UVec2;

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
