//! Indirect light from other surfaces and from the environment.
//!
//! Every technique writes one structure, which shaders read through `indirect_light.wesl`: four layers of the size of
//! the image. The library's own technique is [`sampled`].

pub(crate) mod radiance_cache;
pub mod sampled;
#[cfg(test)]
mod tests;

use std::fmt;

use lanternfish_gpu::{Bindings, Feature, Frame};
use lanternfish_scene::named_enum;

use self::radiance_cache::bounces::Bounces;
use crate::{
    context::ViewContext,
    denoise::counters::Counters,
    error::RenderError,
    gpu_scene::Parts,
    prepass::Surface,
    rays::{Structure, Tracer},
    settings::{Samples, Settings},
    technique::{AnyTechnique, Choice, Technique, clone_of},
};

pub use crate::denoise::layers::layers_target;

/// Shading adds indirect light.
pub(crate) const INDIRECT: Feature = Feature::new("indirect");

/// The technique that computes indirect light, or none.
pub type Indirect = Choice<dyn IndirectTechnique>;

impl<T: Technique + IndirectTechnique> From<T> for Indirect {
    fn from(technique: T) -> Self {
        Self::new(Box::new(technique), |technique| clone_of::<T>(technique))
    }
}

/// The technique that computes caustics, or none.
pub type Caustics = Choice<dyn CausticTechnique>;

impl<T: Technique + CausticTechnique> From<T> for Caustics {
    fn from(technique: T) -> Self {
        Self::new(Box::new(technique), |technique| clone_of::<T>(technique))
    }
}

/// A technique for light that mirrors and glass throw onto other surfaces, beside a technique that leaves it out
/// ([`IndirectTechnique::leaves_caustics`]).
pub trait CausticTechnique: AnyTechnique {
    /// Parts of a scene that it reads, beside those that are rasterized.
    fn parts(&self) -> Parts;

    /// Compiles its passes, which add its light to that of `indirect`. `tracer`: of shadow rays, if there are any.
    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
        indirect: Option<Box<dyn IndirectPasses>>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError>;
}

/// A technique for indirect light.
pub trait IndirectTechnique: AnyTechnique {
    /// Takes the parameters of a quality, if it has any.
    #[doc(hidden)]
    fn spend(&mut self, _quality: Quality) {}

    /// Parts of a scene that it reads, beside those that are rasterized.
    #[doc(hidden)]
    fn parts(&self) -> Parts {
        Parts::NONE
    }

    /// Bounces of a path tracer's light that it approximates; `None` if its light cannot be compared with one.
    fn bounces(&self) -> Option<Bounces> {
        None
    }

    /// Its tracers, beside that of shadow rays.
    fn tracers(&self) -> Vec<Tracer> {
        Vec::new()
    }

    /// The structures that they traverse. Usually the one that the settings choose for all.
    #[doc(hidden)]
    fn structures(&self, settings: &Settings) -> Vec<Structure> {
        self.tracers().into_iter().map(|tracer| tracer.structure(&settings.structure)).collect()
    }

    /// True if it includes light from the environment. Otherwise occlusion may add it.
    fn sees_environment(&self) -> bool {
        true
    }

    /// True if it includes light of emissive triangles at visible surfaces. Otherwise direct light may add it.
    fn brings_emission(&self) -> bool {
        true
    }

    /// For a technique that leaves a part of this emission to direct light that samples it (`parts_of_rays` of
    /// `indirect/emitter_point.wesl`): the perceptual roughness below which surfaces have glossy rays.
    #[doc(hidden)]
    fn shares_emission(&self) -> Option<f32> {
        None
    }

    /// True if it leaves caustics to their own technique, if there is one. Otherwise it has all of their light that it
    /// can find, and there are no others.
    #[doc(hidden)]
    fn leaves_caustics(&self) -> bool {
        false
    }

    /// Replaces an automatic tracer with the one chosen for the adapter.
    #[doc(hidden)]
    fn resolve_tracer(&mut self, _automatic: Tracer) {}

    /// Takes the parameters for the nearest transparent surfaces, which are smooth and have no deep images.
    fn for_transparent(&mut self) {}

    /// Takes the parameters for clear coats, which mirror light and scatter none.
    fn for_coats(&mut self) {
        self.for_transparent();
    }

    /// Takes the parameters for the other sides of surfaces that scatter light through, which mirror none.
    fn for_other_sides(&mut self) {
        self.for_transparent();
    }

    /// Compiles its passes. `tracer`: of shadow rays, if there are any.
    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError>;
}

named_enum! {
    /// Quality of indirect light: rays per pixel and samples per cache entry.
    #[derive(Default)]
    Quality {
        /// Screen probes: about one ray per pixel. In further frames of a mean, 4 diffuse and 1 glossy rays from every
        /// fourth pixel.
        Draft = "draft": "Screen probes: about one ray per pixel, through the BVH",
        /// 8 diffuse and 4 glossy rays per pixel, through the BVH; 16 and 4 in an image's first frame if the radiance
        /// cache lights their hits.
        #[default]
        Good = "good": "8 diffuse and 4 glossy rays per pixel, 16 and 4 in an image's first frame, through the BVH",
        /// 64 diffuse and 16 glossy rays per pixel, through the BVH; 128 first samples per entry of the radiance cache.
        Best = "best": "64 diffuse and 16 glossy rays per pixel, through the BVH, and 128 samples per cache entry",
    }
}

impl Quality {
    /// Samples per pixel at edges. On a software adapter several take a tenth of the frame time; beside draft indirect
    /// light they would take a third.
    #[doc(hidden)]
    pub const fn samples(self) -> Samples {
        match self {
            Self::Draft => Samples::One,
            Self::Good | Self::Best => Samples::Four,
        }
    }
}

impl Indirect {
    /// The same technique with the parameters of a quality.
    #[doc(hidden)]
    pub fn of_quality(mut self, quality: Quality) -> Self {
        if let Some(technique) = self.technique_mut() {
            technique.spend(quality);
        }
        self
    }

    /// True if the technique includes light from the environment.
    #[doc(hidden)]
    pub fn sees_environment(&self) -> bool {
        self.technique().is_some_and(|technique| technique.sees_environment())
    }

    /// True if the technique includes light of emissive triangles at visible surfaces.
    pub(crate) fn brings_emission(&self) -> bool {
        self.technique().is_some_and(|technique| technique.brings_emission())
    }

    /// [`IndirectTechnique::shares_emission`].
    pub(crate) fn shares_emission(&self) -> Option<f32> {
        self.technique().and_then(|technique| technique.shares_emission())
    }

    /// Replaces an automatic tracer with the one chosen for the adapter.
    pub(crate) fn resolve_tracer(&mut self, automatic: Tracer) {
        if let Some(technique) = self.technique_mut() {
            technique.resolve_tracer(automatic);
        }
    }

    /// The technique's tracers.
    pub(crate) fn tracers(&self) -> Vec<Tracer> {
        self.technique().map(|technique| technique.tracers()).unwrap_or_default()
    }

    /// The structures that they traverse.
    pub(crate) fn structures(&self, settings: &Settings) -> Vec<Structure> {
        self.technique().map(|technique| technique.structures(settings)).unwrap_or_default()
    }

    /// Parts of a scene that the technique reads.
    pub(crate) fn parts(&self) -> Parts {
        self.technique().map_or(Parts::NONE, |technique| technique.parts())
    }
}

/// The passes of a technique.
pub trait IndirectPasses: Send + fmt::Debug {
    /// Records the passes that compute the indirect light of a view's surface, one sample per pixel.
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
    /// Counters of the technique's work, such as rays.
    pub(crate) counters: Vec<Counters>,
}

impl DemodulatedIrradiance {
    /// Indirect light from four written layers, made by [`layers_target`].
    pub fn new(layers: wgpu::TextureView) -> Self {
        Self { layers, counters: Vec::new() }
    }

    /// The same light with more counters.
    #[doc(hidden)]
    pub fn with_counters(mut self, counters: Vec<Counters>) -> Self {
        self.counters.extend(counters);
        self
    }

    /// The layers, and the counters of the technique's work.
    #[doc(hidden)]
    pub fn into_parts(self) -> (wgpu::TextureView, Vec<Counters>) {
        (self.layers, self.counters)
    }

    /// Bindings under the names that the shaders use.
    #[doc(hidden)]
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("indirect_irradiance", &self.layers)
    }

    /// The same of clear coats.
    pub(crate) fn coat_bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("coat_irradiance", &self.layers)
    }
}

/// Compiles the passes that the settings need: none without indirect light and caustics. `tracer`: of shadow rays, if
/// there are any.
pub(crate) fn passes(
    device: &wgpu::Device,
    settings: &Settings,
    tracer: Option<Tracer>,
) -> Result<Option<Box<dyn IndirectPasses>>, RenderError> {
    let indirect =
        settings.indirect.technique().map(|technique| technique.build(device, settings, tracer)).transpose()?;
    match settings.caustics.technique().filter(|_| settings.finds_caustics()) {
        Some(caustics) => caustics.build(device, settings, tracer, indirect).map(Some),
        None => Ok(indirect),
    }
}
