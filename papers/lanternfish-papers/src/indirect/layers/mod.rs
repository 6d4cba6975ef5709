//! Sums of the light of two techniques.

use lanternfish::{
    DemodulatedIrradiance, RenderError, layers_target,
    prepass::Surface,
    shaders::{Root, Shaders},
};
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame};

/// Of the second technique, glossy light alone.
pub(crate) const GLOSSY_LAYERS: Feature = Feature::new("glossy_layers");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders =
    Shaders::of(&crate::shaders::SHADERS, &[Root::of("indirect/layers/sum", &[&[&[], &[GLOSSY_LAYERS]]])], &[]);

/// The pass.
#[derive(Debug)]
pub(crate) struct LayerSum(ComputeKernel);

impl LayerSum {
    /// Compiles the pass. `features`: none, or [`GLOSSY_LAYERS`].
    pub fn new(device: &wgpu::Device, features: &[Feature]) -> Result<Self, RenderError> {
        let shader = DECLARED.link("indirect/layers/sum", features)?;
        Ok(Self(ComputeKernel::new(device, &shader, "sum", "indirect/layers/sum")))
    }

    /// The light of both at a surface, with the counters of both.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        surface: &Surface,
        [first, second]: [DemodulatedIrradiance; 2],
    ) -> DemodulatedIrradiance {
        let sum = layers_target(frame, surface.size);
        let [(first, mut counters), (second, more)] = [first, second].map(DemodulatedIrradiance::into_parts);
        counters.extend(more);
        let adding = Bindings::new().texture("indirect_irradiance", &first).texture("added_irradiance", &second);
        let [width, height, _] = self.0.workgroup_size();
        let groups = [surface.size.x.div_ceil(width), surface.size.y.div_ceil(height), 1];
        frame.dispatch(&self.0, &adding.texture("summed_irradiance", &sum), groups);
        [first, second].iter().for_each(|layers| frame.release_texture(layers));
        DemodulatedIrradiance::new(sum).with_counters(counters)
    }
}
