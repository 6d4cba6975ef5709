//! A view after shading.

use crate::{
    direct_light::DirectLight, indirect::DemodulatedIrradiance, light_culling::LightLists,
    occlusion::AmbientVisibility, shadows::VisibilityPlan, texture::Radiance,
};

/// A view after shading.
#[derive(Debug)]
pub(crate) struct Shaded {
    pub radiance: Radiance,
    /// Demodulated indirect light, if the radiance is demodulated direct light.
    pub indirect_light: Option<wgpu::TextureView>,
    /// Mean radiance of this frame and the frames before it, if frames are averaged.
    pub mean: Option<wgpu::TextureView>,
    /// The radiance with temporal antialiasing, if there is any.
    pub antialiased: Option<wgpu::TextureView>,
    pub visibility: Option<VisibilityPlan>,
    pub ambient_visibility: Option<AmbientVisibility>,
    pub indirect: Option<DemodulatedIrradiance>,
    /// Indirect light at the nearest transparent surfaces.
    pub indirect_of_transparent: Option<DemodulatedIrradiance>,
    /// Direct light, if a technique samples it.
    pub direct: Option<DirectLight>,
    /// The light lists of opaque surfaces, unless direct light is sampled.
    pub lights: Option<LightLists>,
}

impl Shaded {
    /// A view with only radiance, and light lists if there are any.
    pub fn of_lights(radiance: Radiance, lights: Option<LightLists>) -> Self {
        Self {
            radiance,
            indirect_light: None,
            mean: None,
            antialiased: None,
            visibility: None,
            ambient_visibility: None,
            indirect: None,
            indirect_of_transparent: None,
            direct: None,
            lights,
        }
    }

    /// Linear radiance, nits.
    pub fn rendering(&self) -> &wgpu::TextureView {
        self.mean.as_ref().unwrap_or(self.single())
    }

    /// Linear radiance of this frame, nits.
    pub fn single(&self) -> &wgpu::TextureView {
        self.antialiased.as_ref().unwrap_or(&self.radiance.target)
    }
}
