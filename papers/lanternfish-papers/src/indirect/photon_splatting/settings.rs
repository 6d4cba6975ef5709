//! Settings of photon splatting.

use lanternfish::{
    RenderError,
    denoise::{
        IndirectClamp, IndirectResolution,
        smoothing::{CLAMP, FILTER, RESOLUTION},
    },
    gpu_scene::Parts,
    indirect::{IndirectPasses, IndirectTechnique, Quality},
    parameters,
    rays::{Tracer, TracerChoice},
    settings::Settings,
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
    techniques::Bounces,
};
use lanternfish_scene::named_enum;

use super::{
    DECLARED,
    passes::{PhotonPasses, Photons},
};

named_enum! {
    /// Photon splatting method.
    Splat {
        /// Light culling makes lists of photons, and each pixel adds up those of its list.
        Gather = "gather": "Light culling makes lists of photons, and each pixel adds up those of its list",
        /// Each photon is rasterized with additive blending in 32-bit floats, as in the paper, if the adapter supports
        /// it.
        Raster = "raster": "Each photon is rasterized with additive blending, if the adapter can blend 32-bit floats",
    }
}

parameters! {
    /// Photons from the lights, split at the first surface, and splatted at the next one [Aalund2015, §3.4, §4.2].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PhotonSplatting {
        /// Photons emitted by all lights, split at their first surface. More: finer, slower. Default: 4096; with
        /// `quality draft` 2048, best 16384.
        count: u32 = 4096, "photon-count" "N" Range::Count(16, 262_144);
        /// Tracer of split photons. Deep images: along their axes; others: along the same directions.
        tracer: TracerChoice = TracerChoice::Auto, "photon-tracer" "NAME" Range::Names, with_default;
        /// Bounces between light and visible surface.
        bounces: u32 = 1, "photon-bounces" "N" Range::Count(1, 16), with_default;
        /// Radius of a photon's footprint relative to its differentials' ellipse. Larger: smoother, more blurred.
        radius: f32 = 0.125, "photon-radius" "FACTOR" Range::Positive, with_default;
        /// Widens footprints by the solid angle of their direction: from a radius of 1 on those of one photon that was
        /// split cover what they light.
        widened: bool = true, "photon-widened" "on|off" Range::Switch(
            "By the cell of the direction, too",
            "As in the paper: by the light's differentials alone",
        ), with_default;
        /// Redistributes the parts of footprints beyond surface edges.
        conserved: bool = false, "photon-conserve" "on|off"
            Range::Switch("No light is lost at edges", "As in the paper: it is"), with_default;
        /// Photon splatting method.
        splat: Splat = Splat::Gather, "photon-splat" "NAME" Range::Names, with_default;
        /// Photons per chunk. The light is the same; fewer photons take less memory, 100 bytes each, and more passes.
        chunk: u32 = 1 << 20, "photon-chunk" "N" Range::Count(1024, 4_194_304), with_default;
        /// Resolution of indirect light.
        resolution: IndirectResolution = IndirectResolution::Full => RESOLUTION;
        /// Radius of the filter in an image of one frame, pixels, up to 64; 0: no filter.
        filter_radius: u32 = 8 => FILTER;
        /// True if what a pixel gets is bounded by what the pixels around it do.
        clamp: IndirectClamp = IndirectClamp::Off => CLAMP;
    }
}

impl Technique for PhotonSplatting {
    const NAME: &'static str = "photon-splatting";
    const SUMMARY: &'static str =
        "Photons from the lights, split at the first surface, splatted at the next: any number of bounces";
    const PARAMETERS: &'static [Parameter<Self>] = Self::ROWS;
    const SHADERS: Shaders = DECLARED;
}

impl IndirectTechnique for PhotonSplatting {
    fn bounces(&self) -> Option<Bounces> {
        Some(Bounces::UpTo(self.bounces))
    }

    fn spend(&mut self, quality: Quality) {
        (self.count, self.resolution) = match quality {
            Quality::Draft => (2048, IndirectResolution::Half),
            Quality::Good => (4096, IndirectResolution::Full),
            Quality::Best => (16384, IndirectResolution::Full),
        };
    }

    fn parts(&self) -> Parts {
        Parts::HITS | Parts::BVH
    }

    fn tracers(&self) -> Vec<Tracer> {
        vec![self.tracer.fixed()]
    }

    fn sees_environment(&self) -> bool {
        false
    }

    fn resolve_tracer(&mut self, automatic: Tracer) {
        self.tracer.resolve(automatic);
    }

    fn for_transparent(&mut self) {
        self.tracer = self.tracer.fixed().exact().into();
        self.resolution = IndirectResolution::Full;
    }

    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError> {
        Ok(Box::new(PhotonPasses::new(device, *self, settings, tracer, Photons::Split)?))
    }
}
