//! Light at the surfaces of a view other than that of the listed lights.

use lanternfish_gpu::Bindings;

use crate::{
    direct_light::DirectLight, indirect::DemodulatedIrradiance, occlusion::AmbientVisibility, prepass::Surface,
};

/// Computed between culling and shading, for the surface at each pixel's centre.
#[derive(Clone, Debug)]
pub struct Arriving {
    /// The surface, with one sample per pixel.
    pub surface: Surface,
    /// The ambient visibility of the surface.
    pub ambient_visibility: Option<AmbientVisibility>,
    /// The irradiance from other surfaces.
    pub indirect: Option<DemodulatedIrradiance>,
    /// Direct light, if a technique samples it.
    pub direct: Option<DirectLight>,
    /// Light at the clear coats of these surfaces, if any has one.
    pub coat: Option<Box<Arriving>>,
    /// Direct light at the transparent surfaces behind these.
    pub second: Option<Box<Arriving>>,
}

impl Arriving {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        let bindings = self.surface.bindings();
        // Layered surfaces without a coat do not read what they bind.
        let coat = self.coat.as_deref().unwrap_or(self);
        let light = [
            self.ambient_visibility.as_ref().map(AmbientVisibility::bindings),
            self.indirect.as_ref().map(DemodulatedIrradiance::bindings),
            self.direct.as_ref().map(DirectLight::bindings),
            coat.indirect.as_ref().map(DemodulatedIrradiance::coat_bindings),
            coat.ambient_visibility.as_ref().map(AmbientVisibility::coat_bindings),
        ];
        let bindings = light.iter().flatten().fold(bindings, |bindings, more| bindings.with(more));
        let Some((second, direct)) = self.second.as_ref().and_then(|it| Some((it, it.direct.as_ref()?))) else {
            return bindings;
        };
        bindings
            .texture("second_depth", &second.surface.depth)
            .texture("second_unshadowed", &direct.unshadowed)
            .texture("second_ratios", &direct.ratios)
    }
}
