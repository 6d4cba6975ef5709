//! Direct light: light that reaches visible surfaces from lights without another surface between.
//!
//! `all` (the baseline, no technique) lists the lights of each point ([`crate::light_culling`]), traces a shadow ray to
//! each ([`crate::shadows`]) and sums them while it shades. Every other technique writes demodulated light, which
//! shading reads through `layers.wesl`: [`sampled`].

pub mod reach;
pub mod sampled;

use std::fmt;

use lanternfish_gpu::{Bindings, Feature, Frame};

use crate::{
    context::ViewContext,
    denoise::counters::Counters,
    error::RenderError,
    gpu_scene::Parts,
    prepass::Surface,
    rays::Tracer,
    settings::Settings,
    technique::{AnyTechnique, Choice, Technique, clone_of},
};

/// Shaders trace shadow rays.
pub(crate) const SHADOW_RAYS: Feature = Feature::new("shadow_rays");
/// Direct light comes from a technique's layers.
pub(crate) const SAMPLED_LIGHTS: Feature = Feature::new("sampled_lights");

/// Technique of direct light; none: every listed light gets its shadow rays.
pub type Direct = Choice<dyn DirectTechnique>;

impl<T: Technique + DirectTechnique> From<T> for Direct {
    fn from(technique: T) -> Self {
        Self::new(Box::new(technique), |technique| clone_of::<T>(technique))
    }
}

/// A technique of direct light.
pub trait DirectTechnique: AnyTechnique {
    /// Parts of a scene that it reads, with these settings.
    fn parts(&self, settings: &Settings) -> Parts;

    /// True if it samples emissive triangles where indirect light leaves them a part of their light.
    #[doc(hidden)]
    fn samples_emission(&self) -> bool {
        false
    }

    /// Compiles its passes. `tracer`: of shadow rays, if there are any.
    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Box<dyn DirectPasses>, RenderError>;
}

/// The passes of a technique.
pub trait DirectPasses: Send + fmt::Debug {
    /// Records the passes that compute the direct light of a view's surface, one sample per pixel.
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<DirectLight, RenderError>;
}

/// Demodulated direct light of one view, in layers as of [`crate::indirect::DemodulatedIrradiance`]: the product of both.
#[derive(Clone, Debug)]
pub struct DirectLight {
    /// Light that would arrive if nothing were in the way.
    pub unshadowed: wgpu::TextureView,
    /// The part of it that does, linear, per channel: of diffuse light (layer 0) and of glossy light (layer 1).
    pub ratios: wgpu::TextureView,
    /// Counters of the technique's work, such as rays.
    pub(crate) counters: Counters,
}

impl DirectLight {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("unshadowed_direct", &self.unshadowed).texture("direct_ratios", &self.ratios)
    }
}
