//! Layers that are neither bounded nor filtered, but mixed with those of the frames before.

use lanternfish_gpu::{ComputeKernel, Frame};

use super::{Doubt, SmoothingParameters, history::Histories};
use crate::{context::ViewContext, error::RenderError, indirect::layers_target, prepass::Surface, shaders::SHADERS};

/// The passes, and what views keep.
#[derive(Debug)]
pub(crate) struct Steady {
    bound: ComputeKernel,
    histories: Histories,
}

impl Steady {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, doubt: Doubt) -> Result<Self, RenderError> {
        let shader = SHADERS.link("indirect/smoothing/bound", &[])?;
        let bound = ComputeKernel::new(device, &shader, "bound", "steady/bound");
        Ok(Self { bound, histories: Histories::new(device, doubt)? })
    }

    /// Forgets what views have kept.
    pub fn forget(&mut self) {
        self.histories.forget();
    }

    /// Four layers of a surface that a view shows, mixed with those of its frames before along its surfaces.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
        found: &wgpu::TextureView,
    ) -> wgpu::TextureView {
        let Some(motion) = &surface.motion else { return found.clone() };
        let [beside_mean, steady] = [(); 2].map(|()| layers_target(frame, surface.size));
        let uniform = frame.uniform(&SmoothingParameters { scale: 1, ..SmoothingParameters::default() });
        let bindings = view.buffer.bindings().with(&surface.bindings()).part("smoothing", &uniform);
        let [width, height, _] = self.bound.workgroup_size();
        let groups = [surface.size.x.div_ceil(width), surface.size.y.div_ceil(height), 1];
        let bindings = bindings.texture("filtered_sums", found).texture("filtered", &beside_mean);
        frame.dispatch(&self.bound, &bindings, groups);
        self.histories.record(frame, view, (surface, motion), [&beside_mean, &steady], [0.0; 2]);
        steady
    }
}
