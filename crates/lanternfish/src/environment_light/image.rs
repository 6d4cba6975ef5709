//! The environment image on the device.

use lanternfish_gpu::{Bindings, GpuError, gpu_struct, uniform_buffer_of};
use lanternfish_scene::Environment;

/// Largest size of pending copies, bytes.
const BATCH_BYTES: usize = 64 << 20;

gpu_struct! {
    /// The rotation of the environment image.
    pub struct EnvironmentParameters {
        /// Revolutions about +y, counter-clockwise from above, −0.5..0.5.
        turn: f32,
    }
}

/// A scene's [`Environment`] on the device.
#[derive(Clone, Debug)]
pub struct EnvironmentImage {
    /// Size of its texels, bytes: 16 each, 32-bit floats.
    pub bytes: u64,
    texture: wgpu::TextureView,
    parameters: wgpu::Buffer,
}

impl EnvironmentImage {
    /// Uploads the image. Only the device's texture limit restricts its size.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, environment: &Environment) -> Result<Self, GpuError> {
        let limit = device.limits().max_texture_dimension_2d;
        let [width, height] = [environment.width, environment.height].map(|s| u32::try_from(s).unwrap_or(u32::MAX));
        if width.max(height) > limit {
            return Err(GpuError::TextureSize { name: "environment".to_owned(), width, height, limit });
        }
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("environment"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let rows = (BATCH_BYTES / (16 * environment.width)).max(1);
        for (i, pixels) in environment.pixels.chunks(rows * environment.width).enumerate() {
            let texels: Vec<[f32; 4]> = pixels.iter().map(|pixel| pixel.extend(1.0).to_array()).collect();
            let (first, count) = ((i * rows) as u32, (pixels.len() / environment.width) as u32);
            queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    origin: wgpu::Origin3d { x: 0, y: first, z: 0 },
                    ..texture.as_image_copy()
                },
                bytemuck::cast_slice(&texels),
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16 * width), rows_per_image: None },
                wgpu::Extent3d { width, height: count, depth_or_array_layers: 1 },
            );
            // Submit pending copies so that their staging memory is freed.
            queue.submit([]);
        }
        let turns = f64::from(environment.rotation) / std::f64::consts::TAU;
        let parameters = EnvironmentParameters { turn: (turns - turns.round()) as f32 };
        Ok(Self {
            bytes: 16 * u64::from(width) * u64::from(height),
            texture: texture.create_view(&Default::default()),
            parameters: uniform_buffer_of(device, "environment", &parameters),
        })
    }

    /// Width, pixels.
    pub fn width(&self) -> u32 {
        self.texture.texture().width()
    }

    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("environment_parameters", &self.parameters).texture("environment_texture", &self.texture)
    }
}
