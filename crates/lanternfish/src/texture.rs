//! Render targets.

use glam::UVec2;
use lanternfish_gpu::{Frame, GpuError, texture_of};

/// Format of linear radiance, nits. Half floats: the widest format that every adapter can blend.
pub const RADIANCE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// The rendered image: linear, scene-referred.
#[derive(Clone, Debug)]
pub struct Radiance {
    /// RGB: nits; A: 1 where there is a surface. One sample per pixel: the resolved mean of a multisampled image.
    pub target: wgpu::TextureView,
    /// The multisampled attachment, if it is not the target itself.
    pub(crate) drawn: Option<wgpu::TextureView>,
}

impl Radiance {
    /// The colour attachment; a multisampled image is resolved to the target after each pass.
    pub(crate) fn color(&self, load: wgpu::LoadOp<wgpu::Color>) -> wgpu::RenderPassColorAttachment<'_> {
        wgpu::RenderPassColorAttachment {
            view: self.drawn.as_ref().unwrap_or(&self.target),
            depth_slice: None,
            resolve_target: self.drawn.as_ref().map(|_| &self.target),
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        }
    }
}

/// Creates a texture that is a render target and an input of later passes.
pub fn target(
    device: &wgpu::Device,
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
    more: wgpu::TextureUsages,
) -> wgpu::TextureView {
    texture_of(device, &described(label, size, format, more, 1))
}

/// A transient render target of the current frame with this number of samples per pixel. Its initial content is undefined.
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

/// A transient layered texture that compute passes of the current frame write and later passes read. Its initial content is undefined.
pub(crate) fn frame_layers(
    frame: &mut Frame<'_>,
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
    layers: u32,
) -> wgpu::TextureView {
    frame.texture(&layered(label, size, format, layers))
}

/// Creates a layered texture that compute passes of one frame write and those of the next one read.
pub(crate) fn kept_layers(
    device: &wgpu::Device,
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
    layers: u32,
) -> wgpu::TextureView {
    texture_of(device, &layered(label, size, format, layers))
}

/// A layered texture that compute passes write and read.
fn layered(label: &str, size: UVec2, format: wgpu::TextureFormat, layers: u32) -> wgpu::TextureDescriptor<'_> {
    let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
    let flat = described(label, size, format, wgpu::TextureUsages::empty(), 1);
    let size = wgpu::Extent3d { depth_or_array_layers: layers, ..flat.size };
    wgpu::TextureDescriptor { size, usage, ..flat }
}

/// The size of a view of a texture's first level, pixels.
pub(crate) fn size_of_view(view: &wgpu::TextureView) -> UVec2 {
    let texture = view.texture();
    UVec2::new(texture.width(), texture.height())
}

/// The texture that a frame writes and the one that the frame before wrote. They swap each frame.
#[derive(Clone, Debug)]
pub(crate) struct PingPong {
    pub now: wgpu::TextureView,
    pub before: wgpu::TextureView,
}

impl PingPong {
    /// The pair of the next frame. `new` creates what is missing, or what is to be written and has another size; `bytes` are those of one texture.
    pub fn next(
        last: Option<Self>,
        frame: &mut Frame<'_>,
        size: UVec2,
        (label, bytes): (&str, u64),
        new: impl Fn(&wgpu::Device) -> wgpu::TextureView,
    ) -> Result<Self, GpuError> {
        let mut create = || {
            frame.take_memory(label, bytes)?;
            Ok::<_, GpuError>(new(frame.device))
        };
        let Some(Self { now: before, before: now }) = last else {
            return Ok(Self { now: create()?, before: create()? });
        };
        Ok(Self { now: if size_of_view(&now) == size { now } else { create()? }, before })
    }
}

/// The descriptor of a render target.
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
