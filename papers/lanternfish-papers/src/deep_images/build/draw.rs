//! Passes that draw triangles without color output.

use glam::UVec2;
use lanternfish::{RenderError, texture::frame_target};
use lanternfish_gpu::{Bindings, Feature, Frame, RasterPipeline, RasterState};

use super::super::shaders::{DECLARED, DeepGrid};

/// Never written: a pass needs an attachment.
const NO_TARGET: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// Compiles a pass that draws triangles without color output.
pub fn raster(
    device: &wgpu::Device,
    module: &str,
    features: &[Feature],
    label: &str,
) -> Result<RasterPipeline, RenderError> {
    let nothing = wgpu::ColorTargetState { format: NO_TARGET, blend: None, write_mask: wgpu::ColorWrites::empty() };
    let targets = [Some(nothing)];
    let state = RasterState { targets: &targets, ..Default::default() };
    let shader = DECLARED.link(module, features)?;
    Ok(RasterPipeline::new(device, &shader, "vertex", "fragment", label, &state))
}

/// Draws all triangles, fetched by index, without color output.
pub fn draw(
    frame: &mut Frame<'_>,
    pipeline: &RasterPipeline,
    label: &str,
    size: UVec2,
    grid: &DeepGrid,
    instances: u32,
    bindings: &Bindings<'_>,
) {
    let nothing = frame_target(frame, label, size, NO_TARGET, wgpu::TextureUsages::empty(), 1);
    let color = wgpu::RenderPassColorAttachment {
        view: &nothing,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Discard },
    };
    frame.render(label, &[Some(color)], None, |groups, pass| {
        pipeline.set(pass);
        pipeline.bind(groups, pass, bindings, 4);
        pass.draw(0..3 * grid.triangle_count, 0..instances);
    });
}
