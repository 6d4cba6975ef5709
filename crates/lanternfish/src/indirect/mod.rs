//! Light that arrives from other surfaces, and from the environment.
//!
//! Every technique ends in one structure, read through `indirect_light.wesl`: four layers of the size of the image. The library's own technique is
//! [`sampled`].

mod counters;
pub(crate) mod history;
pub(crate) mod radiance_cache;
pub mod sampled;
pub mod smoothing;
#[cfg(test)]
mod tests;

use std::fmt;

use glam::UVec2;
use lanternfish_gpu::{Bindings, Feature, Frame};
use lanternfish_scene::named_enum;

use crate::{
    context::ViewContext,
    error::RenderError,
    gpu_scene::Parts,
    prepass::Surface,
    rays::Tracer,
    settings::{Samples, Settings},
    technique::{AnyTechnique, Choice, Technique, clone_of},
    texture::frame_layers,
};

pub use self::counters::Counters;
pub use self::smoothing::{IndirectClamp, IndirectResolution};

/// Shading adds what arrives from other surfaces.
pub(crate) const INDIRECT: Feature = Feature::new("indirect");

/// Layers of [`DemodulatedIrradiance`]: diffuse and glossy, each at normal and at grazing incidence.
const LAYERS: u32 = 4;

/// How indirect light is found, or that it is not.
pub type Indirect = Choice<dyn IndirectTechnique>;

impl<T: Technique + IndirectTechnique> From<T> for Indirect {
    fn from(technique: T) -> Self {
        Self::new(Box::new(technique), |technique| clone_of::<T>(technique))
    }
}

/// What a technique of indirect light is asked.
pub trait IndirectTechnique: AnyTechnique {
    /// Takes the settings of a quality, where it has any.
    fn spend(&mut self, _quality: Quality) {}

    /// What it reads of a scene, beside what that looks like.
    fn parts(&self) -> Parts {
        Parts::NONE
    }

    /// Whether what it finds comes near the light of a path tracer, so that it can be judged by one: one bounce of it at least.
    fn is_physical(&self) -> bool {
        false
    }

    /// What it traces rays through, beside what shadows are traced through.
    fn tracers(&self) -> Vec<Tracer> {
        Vec::new()
    }

    /// Whether it finds the light of the environment too: if it does not, occlusion may.
    fn sees_environment(&self) -> bool {
        true
    }

    /// Replaces a tracer that is left to the adapter by the one that it takes.
    fn resolve_tracer(&mut self, _automatic: Tracer) {}

    /// Takes the settings of the nearest blended surfaces, which are smooth, and for which there are no deep images.
    fn for_transparent(&mut self) {}

    /// Compiles its passes. `tracer`: what shadows are traced through, if there are any.
    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError>;
}

named_enum! {
    /// What is spent on indirect light.
    #[derive(Default)]
    Quality {
        /// 4 and 1 rays from every fourth pixel, through the BVH.
        Draft = "draft": "4 and 1 rays from every fourth pixel, through the BVH",
        /// 8 and 4 rays from every pixel, through the BVH; 16 and 4 in an image's first frame where the radiance cache lights their ends.
        #[default]
        Good = "good": "8 and 4 rays from every pixel, 16 and 4 in an image's first frame, through the BVH",
        /// 64 and 16 rays from every pixel, through the BVH; 128 first samples of an entry of the radiance cache.
        Best = "best": "64 and 16 rays from every pixel, through the BVH, and 128 samples of an entry",
    }
}

impl Quality {
    /// Samples per pixel at triangle edges (MSAA): several, where they are a tenth of the frame; beside a draft's light they were a third of it.
    pub const fn samples(self) -> Samples {
        match self {
            Self::Draft => Samples::One,
            Self::Good | Self::Best => Samples::Four,
        }
    }
}

impl Indirect {
    /// The same technique with the parameters of a quality.
    pub fn of_quality(mut self, quality: Quality) -> Self {
        if let Some(technique) = self.technique_mut() {
            technique.spend(quality);
        }
        self
    }

    /// True if the technique finds the light of the environment.
    pub fn sees_environment(&self) -> bool {
        self.technique().is_some_and(|technique| technique.sees_environment())
    }

    /// Replaces a tracer that is left to the adapter by the one that it takes.
    pub(crate) fn resolve_tracer(&mut self, automatic: Tracer) {
        if let Some(technique) = self.technique_mut() {
            technique.resolve_tracer(automatic);
        }
    }

    /// What the technique traces rays through.
    pub(crate) fn tracers(&self) -> Vec<Tracer> {
        self.technique().map(|technique| technique.tracers()).unwrap_or_default()
    }

    /// What the technique reads of a scene.
    pub(crate) fn parts(&self) -> Parts {
        self.technique().map_or(Parts::NONE, |technique| technique.parts())
    }
}

/// The passes of a technique.
pub trait IndirectPasses: fmt::Debug {
    /// Forgets what is kept from frame to frame: the last one was not handed to the device, or the device refused it.
    fn forget(&mut self) {}

    /// Finds the indirect light of a surface that a view shows, one sample a pixel.
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<DemodulatedIrradiance, RenderError>;
}

/// Indirect light of one view.
#[derive(Clone, Debug)]
pub struct DemodulatedIrradiance {
    layers: wgpu::TextureView,
    /// What the technique counts: rays, or what else it took.
    pub(crate) counters: Vec<Counters>,
}

impl DemodulatedIrradiance {
    /// The four layers: those of [`layers_target`], written.
    pub fn new(layers: wgpu::TextureView) -> Self {
        Self { layers, counters: Vec::new() }
    }

    /// The same with what the technique counts.
    pub fn with_counters(self, counters: Vec<Counters>) -> Self {
        Self { counters, ..self }
    }

    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("indirect_irradiance", &self.layers)
    }
}

/// A texture for the four layers, for compute passes to write: RGBA, 16-bit floats, an array of four. Diffuse light at normal and at grazing
/// incidence (irradiance over π, nits), then glossy light at both (radiance, nits).
pub fn layers_target(frame: &mut Frame<'_>, size: UVec2) -> wgpu::TextureView {
    frame_layers(frame, "indirect/layers", size, wgpu::TextureFormat::Rgba16Float, LAYERS)
}

/// Compiles the passes that the settings need: none, where there is no indirect light. `tracer`: what shadows are traced through, if
/// there are any.
pub(crate) fn passes(
    device: &wgpu::Device,
    settings: &Settings,
    tracer: Option<Tracer>,
) -> Result<Option<Box<dyn IndirectPasses>>, RenderError> {
    settings.indirect.technique().map(|technique| technique.build(device, settings, tracer)).transpose()
}
