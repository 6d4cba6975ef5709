//! Light that mirrors throw onto diffuse surfaces, by photon differentials [Aalund2015, §3.4, §6].
//!
//! The photons are those of [`photon_splatting`](super::photon_splatting) without the split: each goes on along its
//! mirrored direction alone, and lights the surfaces that it hits from its first reflection on: paths L S⁺ D.

use lanternfish::{
    CausticTechnique, DemodulatedIrradiance, IndirectPasses, RenderError, ViewContext,
    gpu_scene::Parts,
    parameters,
    prepass::Surface,
    rays::Tracer,
    settings::Settings,
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
};
use lanternfish_gpu::Frame;

use super::{
    layers::{self, LayerSum},
    photon_splatting::{PhotonPasses, PhotonSplatting, Photons},
};

parameters! {
    /// Photons from the lights that mirrors reflect, splatted where they hit a diffuse surface.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct CausticPhotons {
        /// Photons emitted by all lights for caustics. More: finer, slower.
        count: u32 = 65536, "caustic-photons" "N" Range::Count(16, 262_144), with_default;
        /// Reflections of a photon by mirrors.
        reflections: u32 = 2, "caustic-reflections" "N" Range::Count(1, 16), with_default;
        /// Radius of a photon's footprint relative to its differentials' ellipse. Larger: smoother, more blurred.
        radius: f32 = 1.5, "caustic-radius" "FACTOR" Range::Positive, with_default;
    }
}

impl Technique for CausticPhotons {
    const NAME: &'static str = "photons";
    const SUMMARY: &'static str = "Photons from the lights, reflected by mirrors, splatted on diffuse surfaces";
    const PARAMETERS: &'static [Parameter<Self>] = Self::ROWS;
    const SHADERS: Shaders = layers::DECLARED;
}

impl CausticTechnique for CausticPhotons {
    fn parts(&self) -> Parts {
        Parts::HITS | Parts::BVH
    }

    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
        indirect: Option<Box<dyn IndirectPasses>>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError> {
        let photons = PhotonSplatting {
            count: self.count,
            tracer: tracer.unwrap_or(Tracer::BVH).exact().into(),
            bounces: self.reflections,
            radius: self.radius,
            filter_radius: 0,
            ..PhotonSplatting::default()
        };
        Ok(Box::new(CausticPasses {
            photons: PhotonPasses::new(device, photons, settings, tracer, Photons::Mirrored)?,
            beside: indirect
                .map(|indirect| Ok::<_, RenderError>((indirect, LayerSum::new(device, &[])?)))
                .transpose()?,
        }))
    }
}

/// The passes.
#[derive(Debug)]
struct CausticPasses {
    photons: PhotonPasses,
    /// Those of indirect light, and the pass that adds both.
    beside: Option<(Box<dyn IndirectPasses>, LayerSum)>,
}

impl IndirectPasses for CausticPasses {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<DemodulatedIrradiance, RenderError> {
        let Some((indirect, sum)) = &mut self.beside else { return self.photons.record(frame, view, surface) };
        let light = [indirect.record(frame, view, surface)?, self.photons.record(frame, view, surface)?];
        Ok(sum.record(frame, surface, light))
    }
}
