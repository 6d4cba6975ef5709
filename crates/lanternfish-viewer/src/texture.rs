//! Textures of the window's images.

use glam::UVec2;

/// Format of images. The texels are already display-encoded, so the format is not sRGB.
pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Creates a texture for an image of `size` pixels.
pub fn texture(device: &wgpu::Device, size: UVec2) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
        | wgpu::TextureUsages::TEXTURE_BINDING
        | wgpu::TextureUsages::COPY_SRC
        | wgpu::TextureUsages::COPY_DST;
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("viewer/rendering"),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// Writes RGBA bytes, rows from the top, to a texture of the same size.
pub fn write(queue: &wgpu::Queue, texture: &wgpu::TextureView, bytes: &[u8]) {
    let texture = texture.texture();
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * texture.width()), rows_per_image: None };
    queue.write_texture(texture.as_image_copy(), bytes, layout, texture.size());
}
