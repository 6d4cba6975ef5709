//! The caller's G-buffer.

use super::DECLARED;
use glam::UVec2;
use lanternfish_gpu::{Bindings, Frame, RasterPipeline, RasterState};

use super::{DEPTH_FORMAT, SURFACE_FORMAT, Surface};
use crate::{error::RenderError, shaders::Root, texture::frame_target};

pub(super) const ROOT: Root = Root::new("prepass/given");

/// Converts the caller's G-buffer to the layout of the prepass's result. Compiled for the first one.
#[derive(Debug, Default)]
pub(crate) struct GivenSurfaces {
    pipeline: Option<RasterPipeline>,
}

impl GivenSurfaces {
    /// Compiles the pass unless it is compiled already.
    pub fn ready(&mut self, device: &wgpu::Device) -> Result<&RasterPipeline, RenderError> {
        Ok(match &mut self.pipeline {
            Some(pipeline) => pipeline,
            none => none.insert(pipeline(device)?),
        })
    }

    /// `depth`: reverse-Z, 0 where there is no surface; `normals`: world-space normal and perceptual roughness.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        depth: &wgpu::TextureView,
        normals: &wgpu::TextureView,
        size: UVec2,
    ) -> Result<Surface, RenderError> {
        let pipeline = self.ready(frame.device)?;
        let none = wgpu::TextureUsages::empty();
        let mut target = |label, format| frame_target(frame, label, size, format, none, 1);
        let (own_depth, own_target) = (target("depth", DEPTH_FORMAT), target("surface", SURFACE_FORMAT));
        let color = wgpu::RenderPassColorAttachment {
            view: &own_target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
        };
        let attached = wgpu::RenderPassDepthStencilAttachment {
            view: &own_depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        let bindings = Bindings::new().texture("given_depth", depth).texture("given_normals", normals);
        frame.render(LABEL, &[Some(color)], Some(attached), |groups, pass| {
            pipeline.set(pass);
            pipeline.bind(groups, pass, &bindings, 4);
            pass.draw(0..3, 0..1);
        });
        Ok(Surface { depth: own_depth, target: Some(own_target), motion: None, size, samples: 1 })
    }
}

const LABEL: &str = "prepass/given";

fn pipeline(device: &wgpu::Device) -> Result<RasterPipeline, RenderError> {
    let shader = DECLARED.link("prepass/given", &[])?;
    let depth = wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::Always),
        stencil: Default::default(),
        bias: Default::default(),
    };
    let state = RasterState { depth: Some(depth), targets: &[Some(SURFACE_FORMAT.into())], ..Default::default() };
    Ok(RasterPipeline::new(device, &shader, "vertex", "fragment", LABEL, &state))
}
