//! The environment as the background.

#[cfg(test)]
mod tests;

use lanternfish_gpu::{Frame, RasterPipeline, RasterState};

use crate::{
    context::ViewContext,
    error::RenderError,
    prepass::DEPTH_FORMAT,
    shaders::{Root, Shaders},
    texture::{RADIANCE_FORMAT, Radiance},
};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(&[Root::new("sky/sky")], &[]);

/// The pass.
#[derive(Debug, Default)]
pub struct Sky {
    pipeline: Option<RasterPipeline>,
}

impl Sky {
    /// Compiles nothing; the first scene with an environment compiles the pass.
    pub fn new() -> Self {
        Self::default()
    }

    /// Draws the scene's environment where the prepass drew no surface. Without an environment there is no pass: shading clears the image
    /// to the sky's colour.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer, surface, .. }: &ViewContext<'_>,
        radiance: &Radiance,
    ) -> Result<(), RenderError> {
        let Some(environment) = &scene.environment else { return Ok(()) };
        let pipeline = match &mut self.pipeline {
            Some(pipeline) => pipeline,
            none => none.insert(pipeline(frame.device, surface.samples)?),
        };
        let color = radiance.color(wgpu::LoadOp::Load);
        let depth = surface.read_depth();
        let bindings = buffer.bindings().with(&environment.bindings());
        frame.render("sky", &[Some(color)], Some(depth), |groups, pass| {
            pipeline.set(pass);
            pipeline.bind(groups, pass, &bindings, 4);
            pass.draw(0..3, 0..1);
        });
        Ok(())
    }
}

fn pipeline(device: &wgpu::Device, samples: u32) -> Result<RasterPipeline, RenderError> {
    let shader = DECLARED.link("sky/sky", &[])?;
    // The triangle lies at depth 0, the depth of pixels without a surface.
    let depth = wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(false),
        depth_compare: Some(wgpu::CompareFunction::Equal),
        stencil: Default::default(),
        bias: Default::default(),
    };
    let state =
        RasterState { depth: Some(depth), targets: &[Some(RADIANCE_FORMAT.into())], samples, ..Default::default() };
    Ok(RasterPipeline::new(device, &shader, "vertex", "fragment", "sky", &state))
}
