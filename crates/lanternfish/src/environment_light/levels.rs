//! A cube map of the environment whose mip levels are prefiltered by rising roughness [Karis2013].

use super::DECLARED;
use lanternfish_gpu::{Bindings, ComputeKernel, Frame, Profiler, gpu_struct};

use super::EnvironmentImage;
use crate::error::RenderError;

/// Texels along a face's edge at the last level, of roughness 1, whose lobe is wider than a texel.
const LAST_FACE: u32 = 8;

gpu_struct! {
    /// Parameters of a pass that makes one level of the cube.
    pub struct LevelParameters {
        /// Texels along a face's edge.
        size: u32,
        /// Sample points of the image along a texel's edge.
        points: u32,
        /// Perceptual roughness of the surface that reflects the environment as this level.
        perceptual_roughness: f32,
        /// Texels along a face's edge of the source cube.
        source_size: u32,
    }
}

/// Texels along a face's edge for an image of this width: about its own resolution, clamped to 128, so that there are several levels, and
/// 512.
pub(super) fn face_size(width: usize) -> u32 {
    (width / 4).next_power_of_two().clamp(128, 512) as u32
}

/// A trilinear sampler, seamless across faces.
pub(super) fn sampler(device: &wgpu::Device) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("environment_light"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    })
}

fn cube(device: &wgpu::Device, label: &str, size: u32, levels: u32, usage: wgpu::TextureUsages) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size, height: size, depth_or_array_layers: 6 },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | usage,
        view_formats: &[],
    })
}

fn as_cube(texture: &wgpu::Texture) -> wgpu::TextureView {
    let dimension = Some(wgpu::TextureViewDimension::Cube);
    texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() })
}

/// The six faces of one level.
fn level(texture: &wgpu::Texture, level: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        base_mip_level: level,
        mip_level_count: Some(1),
        ..Default::default()
    })
}

/// A black cube with one texel per face.
pub(super) fn black(device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::TextureView {
    let texture = cube(device, "environment_light/black", 1, 1, wgpu::TextureUsages::COPY_DST);
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(8), rows_per_image: Some(1) };
    queue.write_texture(texture.as_image_copy(), &[0; 48], layout, texture.size());
    as_cube(&texture)
}

fn record(
    frame: &mut Frame<'_>,
    kernel: &ComputeKernel,
    parameters: LevelParameters,
    target: &wgpu::TextureView,
    read: Bindings<'_>,
) {
    let uniform = frame.uniform(&parameters);
    let [width, height, _] = kernel.workgroup_size();
    let groups = [parameters.size.div_ceil(width), parameters.size.div_ceil(height), 6];
    frame.dispatch(kernel, &read.part("level", &uniform).texture("level_target", target), groups);
}

/// The image as a prefiltered cube with faces of `size` texels, a power of two from [`LAST_FACE`] on.
///
/// 1. A cube of the image, each texel its mean, and a mip chain of means down to one texel.
/// 2. Level i of n + 1 has perceptual roughness i / n; level 0 is the image itself.
pub(super) fn make(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    sampler: &wgpu::Sampler,
    image: &EnvironmentImage,
    size: u32,
) -> Result<wgpu::TextureView, RenderError> {
    let shader = DECLARED.link("environment_light/levels", &[])?;
    let kernel = |entry: &str| ComputeKernel::new(device, &shader, entry, &format!("environment_light/{entry}"));
    let [fill, halve, filter] = ["fill", "halve", "filter_level"].map(kernel);
    let storage = wgpu::TextureUsages::STORAGE_BINDING;
    let means = cube(device, "environment_light/means", size, size.ilog2() + 1, storage);
    let level_count = size.ilog2() - LAST_FACE.ilog2() + 1;
    let levels = cube(device, "environment_light/levels", size, level_count, storage);

    let mut profiler = Profiler::new(device, queue);
    let mut frame = Frame::new(device, queue, &mut profiler);
    // Two sample points per pixel of the image, and at least two per texel.
    let points = (image.width().div_ceil(4 * size) * 2).max(2);
    let full = LevelParameters { size, points, ..Default::default() };
    for target in [level(&means, 0), level(&levels, 0)] {
        record(&mut frame, &fill, full, &target, image.bindings());
    }
    for i in 1..means.mip_level_count() {
        let finer = level(&means, i - 1);
        let read = Bindings::new().texture("finer_level", &finer);
        let parameters = LevelParameters { size: size >> i, ..Default::default() };
        record(&mut frame, &halve, parameters, &level(&means, i), read);
    }
    let source = as_cube(&means);
    for i in 1..level_count {
        let perceptual_roughness = i as f32 / (level_count - 1) as f32;
        let parameters = LevelParameters { size: size >> i, source_size: size, perceptual_roughness, points: 0 };
        let read = Bindings::new().texture("means", &source).sampler("means_sampler", sampler);
        record(&mut frame, &filter, parameters, &level(&levels, i), read);
    }
    frame.submit();
    Ok(as_cube(&levels))
}
