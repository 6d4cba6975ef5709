//! From radiance to what a display shows: exposure, tone map, sRGB encoding.

use glam::UVec2;
use lanternfish_gpu::{Bindings, Frame, RasterPipeline, RasterState, gpu_struct, uniform_buffer_of};

use crate::{error::RenderError, settings::ToneMap, shaders::SHADERS, texture::target, view::ViewBuffer};

gpu_struct! {
    /// How the picture is shown.
    pub struct OutputParameters {
        /// Index of the [`ToneMap`].
        curve: u32,
    }
}

/// sRGB-encoded by the shader.
pub const DISPLAY_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// The pass.
#[derive(Debug)]
pub struct Output {
    pipeline: RasterPipeline,
    parameters: wgpu::Buffer,
}

impl Output {
    /// Compiles the pass.
    pub fn new(device: &wgpu::Device, tone_map: ToneMap) -> Result<Self, RenderError> {
        let shader = SHADERS.link("output/output", &[])?;
        let state = RasterState { targets: &[Some(DISPLAY_FORMAT.into())], ..Default::default() };
        Ok(Self {
            pipeline: RasterPipeline::new(device, &shader, "vertex", "fragment", "output", &state),
            parameters: uniform_buffer_of(device, "output", &OutputParameters { curve: tone_map as u32 }),
        })
    }

    /// Makes the picture as a display shows it, of linear radiance (nits).
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &ViewBuffer,
        radiance: &wgpu::TextureView,
        size: UVec2,
    ) -> wgpu::TextureView {
        let bindings = view
            .bindings()
            .with(&Bindings::new().buffer("output_parameters", &self.parameters))
            .with(&Bindings::new().texture("radiance_texture", radiance));
        fullscreen(frame, &self.pipeline, "output", &bindings, size)
    }
}

/// Runs a pipeline over a new display target of `size`.
pub(crate) fn fullscreen(
    frame: &mut Frame<'_>,
    pipeline: &RasterPipeline,
    label: &str,
    bindings: &Bindings<'_>,
    size: UVec2,
) -> wgpu::TextureView {
    let display = target(frame.device, "display", size, DISPLAY_FORMAT, wgpu::TextureUsages::COPY_SRC);
    cover(frame, pipeline, label, bindings, &display);
    display
}

/// Runs a pipeline over every pixel of a target.
pub(crate) fn cover(
    frame: &mut Frame<'_>,
    pipeline: &RasterPipeline,
    label: &str,
    bindings: &Bindings<'_>,
    target: &wgpu::TextureView,
) {
    let color = wgpu::RenderPassColorAttachment {
        view: target,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
    };
    frame.render(label, &[Some(color)], None, |device, pass| {
        pipeline.set(pass);
        pipeline.bind(device, pass, bindings, 4);
        pass.draw(0..3, 0..1);
    });
}
