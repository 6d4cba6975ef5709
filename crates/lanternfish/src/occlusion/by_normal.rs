//! Environment light at each pixel, for ambient visibility without directions.

use super::DECLARED;
use lanternfish_gpu::{ComputeKernel, Frame};

use super::AmbientVisibility;
use crate::{context::ViewContext, error::RenderError, prepass::Surface};

/// Environment irradiance by the normal alone, times the scalar ambient visibility.
#[derive(Debug)]
pub struct LightByNormal {
    kernel: ComputeKernel,
}

impl LightByNormal {
    /// Compiles the pass.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let shader = DECLARED.link("occlusion/by_normal", &[])?;
        Ok(Self { kernel: ComputeKernel::new(device, &shader, "by_normal", "occlusion/by_normal") })
    }

    /// Fills `environment_irradiance` of the ambient visibility.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer, .. }: &ViewContext<'_>,
        surface: &Surface,
        ambient_visibility: &AmbientVisibility,
    ) {
        let [width, height, _] = self.kernel.workgroup_size();
        let groups = [surface.size.x.div_ceil(width), surface.size.y.div_ceil(height), 1];
        let light_bindings = scene.environment_light().bindings();
        let bindings = buffer.bindings().with(&surface.bindings()).with(&light_bindings);
        let bindings = bindings
            .texture("occlusion_texture", &ambient_visibility.texture)
            .texture("environment_irradiance_target", &ambient_visibility.environment_irradiance);
        frame.dispatch(&self.kernel, &bindings, groups);
    }
}
