//! What arrives at the surfaces of a view, but for the light of the listed lights.

use lanternfish_gpu::Bindings;

use crate::{indirect::DemodulatedIrradiance, occlusion::AmbientVisibility, prepass::Surface};

/// Found between culling and shading, for the surface that is seen through the middle of each pixel.
#[derive(Clone, Debug)]
pub struct Arriving {
    /// That surface: one sample a pixel.
    pub surface: Surface,
    /// How much of the environment it sees.
    pub ambient_visibility: Option<AmbientVisibility>,
    /// What it gets from other surfaces.
    pub indirect: Option<DemodulatedIrradiance>,
}

impl Arriving {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        let bindings = self.surface.bindings();
        let found = [
            self.ambient_visibility.as_ref().map(AmbientVisibility::bindings),
            self.indirect.as_ref().map(DemodulatedIrradiance::bindings),
        ];
        found.iter().flatten().fold(bindings, |bindings, more| bindings.with(more))
    }
}
