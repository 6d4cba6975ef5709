//! Common parts of a wgpu program: a device, textures, and readback.

use std::error::Error;

pub type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// As in any wgpu program; a program with a device passes its own.
pub fn open() -> Result<(wgpu::Device, wgpu::Queue)> {
    pollster::block_on(async {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapter = instance.request_adapter(&wgpu::RequestAdapterOptions::default()).await?;
        Ok(adapter.request_device(&wgpu::DeviceDescriptor::default()).await?)
    })
}

/// A texture that is a render target, a shader input, and can be read back.
pub fn texture(device: &wgpu::Device, [width, height]: [u32; 2], format: wgpu::TextureFormat) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("of the program"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// Waits for the device and reads a texture of four bytes per pixel.
pub fn pixels(device: &wgpu::Device, queue: &wgpu::Queue, view: &wgpu::TextureView) -> Result<Vec<[u8; 4]>> {
    let texture = view.texture();
    let (size, row) = (texture.size(), (4 * texture.width()).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT));
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("pixels"),
        size: u64::from(row) * u64::from(size.height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut commands = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    commands.copy_texture_to_buffer(texture.as_image_copy(), to, size);
    queue.submit([commands.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| ());
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let bytes = buffer.get_mapped_range(..)?;
    let rows = bytes.chunks_exact(row as usize);
    Ok(rows.flat_map(|row| bytemuck::pod_collect_to_vec::<u8, [u8; 4]>(&row[..4 * size.width as usize])).collect())
}
