//! The display image: exposure, tone mapping, sRGB encoding.

mod cpu_reference;
pub mod display;
mod meter;
pub(crate) mod present;
#[cfg(test)]
mod tests;

use glam::{UVec2, Vec3};
use lanternfish_gpu::{
    Bindings, BufferPart, Frame, GpuError, RasterPipeline, RasterState, SharedStruct, gpu_struct, read_back,
    storage_buffer_of,
};

use self::meter::Meter;
use crate::{
    error::RenderError,
    settings::{Background, Exposure, ImageSettings},
    shaders::{Root, Shaders},
    texture::frame_target,
};

pub use cpu_reference::metered_exposure;

gpu_struct! {
    /// Parameters of the display image.
    pub struct OutputParameters {
        /// Index of the [`ToneMap`].
        curve: u32,
        /// Nits that are stored as 1.
        light_unit: f32,
        /// Largest radiance of a caller's texture, nits.
        most: f32,
        /// 0: the image is opaque; 1: it is over `background`; 2: it has alpha.
        opacity: u32,
        /// Display-linear colour.
        background: Vec3,
        _pad: f32,
    }
}

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[Root::new("output/meter"), Root::new("output/output"), present::ROOT],
    &[SharedStruct::of::<OutputParameters>()],
);

/// sRGB-encoded by the shader.
pub const DISPLAY_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// The pass.
#[derive(Debug)]
pub struct Output {
    pipeline: RasterPipeline,
    settings: ImageSettings,
    /// Compiled at the first automatic exposure.
    meter: Option<Meter>,
    /// The exposure of the display images, EV. Automatic exposure writes it on the device, and the host has no copy.
    level: wgpu::Buffer,
}

impl Output {
    /// Compiles the pass.
    pub fn new(device: &wgpu::Device, settings: &ImageSettings) -> Result<Self, RenderError> {
        let shader = DECLARED.link("output/output", &[])?;
        let state = RasterState { targets: &[Some(DISPLAY_FORMAT.into())], ..Default::default() };
        Ok(Self {
            pipeline: RasterPipeline::new(device, &shader, "vertex", "fragment", "output", &state),
            settings: settings.clone(),
            meter: None,
            level: level_of(device, settings.exposure)?,
        })
    }

    /// Sets the exposure from the next frame on.
    pub fn set_exposure(&mut self, device: &wgpu::Device, exposure: Exposure) -> Result<(), RenderError> {
        (self.settings.exposure, self.level) = (exposure, level_of(device, exposure)?);
        Ok(())
    }

    /// Computes the exposure of a frame's images, one for all of them, if it is automatic.
    pub fn meter(
        &mut self,
        frame: &mut Frame<'_>,
        renderings: &[&wgpu::TextureView],
        light_unit: f32,
    ) -> Result<(), RenderError> {
        if self.settings.exposure == Exposure::Auto {
            let parameters = self.parameters(frame, light_unit);
            let meter = match &self.meter {
                Some(meter) => meter,
                None => self.meter.insert(Meter::new(frame.device)?),
            };
            meter.record(frame, renderings, &parameters, &self.level)?;
        }
        Ok(())
    }

    /// Waits for the exposure of the last frame's images, EV.
    pub fn exposure(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<f32, GpuError> {
        match self.settings.exposure {
            Exposure::Ev(ev) => Ok(ev),
            // A negative value that is rounded to zero is -0.
            Exposure::Auto => Ok(read_back::<f32>(device, queue, &self.level, 1)?[0] + 0.0),
        }
    }

    /// Draws the display image of linear radiance, stored in `light_unit`, into a texture of [`DISPLAY_FORMAT`].
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        radiance: &wgpu::TextureView,
        light_unit: f32,
        display: &wgpu::TextureView,
    ) {
        let parameters = self.parameters(frame, light_unit);
        let bindings = Bindings::new()
            .part("output_parameters", &parameters)
            .buffer("exposure", &self.level)
            .texture("radiance_texture", radiance);
        show(frame, &self.pipeline, "output", &bindings, display);
    }

    fn parameters(&self, frame: &mut Frame<'_>, light_unit: f32) -> BufferPart {
        let curve = self.settings.tone_map as u32;
        let (opacity, background) = match self.settings.background {
            Background::Environment => (0, Vec3::ZERO),
            Background::Color(color) => (1, Vec3::from(color.map(display::linear_of))),
            Background::Transparent => (2, Vec3::ZERO),
        };
        frame.uniform(&OutputParameters { curve, light_unit, opacity, background, ..Default::default() })
    }
}

/// The exposure on the device, EV.
fn level_of(device: &wgpu::Device, exposure: Exposure) -> Result<wgpu::Buffer, RenderError> {
    let ev = match exposure {
        Exposure::Auto => 0.0,
        Exposure::Ev(ev) if ev.is_finite() => ev,
        Exposure::Ev(ev) => {
            let (got, needed) = (ev.to_string(), "a finite number of stops, or auto");
            return Err(RenderError::Value { setting: "`exposure`", got, needed });
        }
    };
    Ok(storage_buffer_of(device, "output/exposure", &[ev, 0.0, 0.0, 0.0], wgpu::BufferUsages::empty())?)
}

/// The display target of a view. Frames request their targets in the same order, and so get the same textures.
pub(crate) fn display_target(frame: &mut Frame<'_>, size: UVec2) -> wgpu::TextureView {
    frame_target(frame, "display", size, DISPLAY_FORMAT, wgpu::TextureUsages::COPY_SRC, 1)
}

/// Runs a full-screen pipeline over the display target. With deferred readback, an incomplete frame leaves the earlier
/// content.
pub(crate) fn show(
    frame: &mut Frame<'_>,
    pipeline: &RasterPipeline,
    label: &str,
    bindings: &Bindings<'_>,
    target: &wgpu::TextureView,
) {
    match frame.whole() {
        None => cover(frame, pipeline, label, bindings, target),
        Some(complete) => draw_over(frame, pipeline, label, bindings, target, wgpu::LoadOp::Load, Some(&complete)),
    }
}

/// Runs a full-screen pipeline over every pixel of a target.
pub(crate) fn cover(
    frame: &mut Frame<'_>,
    pipeline: &RasterPipeline,
    label: &str,
    bindings: &Bindings<'_>,
    target: &wgpu::TextureView,
) {
    draw_over(frame, pipeline, label, bindings, target, wgpu::LoadOp::Clear(wgpu::Color::BLACK), None);
}

/// Draws one triangle over a target, with the instance count of `times` if given.
fn draw_over(
    frame: &mut Frame<'_>,
    pipeline: &RasterPipeline,
    label: &str,
    bindings: &Bindings<'_>,
    target: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
    times: Option<&wgpu::Buffer>,
) {
    let color = wgpu::RenderPassColorAttachment {
        view: target,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
    };
    frame.render(label, &[Some(color)], None, |groups, pass| {
        pipeline.set(pass);
        pipeline.bind(groups, pass, bindings, 4);
        match times {
            None => pass.draw(0..3, 0..1),
            Some(times) => pass.draw_indirect(times, 0),
        }
    });
}
