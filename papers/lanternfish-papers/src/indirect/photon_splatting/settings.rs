//! Settings of photon splatting.

use lanternfish::{
    RenderError,
    denoise::{
        IndirectClamp, IndirectResolution,
        smoothing::{CLAMP, FILTER, RESOLUTION},
    },
    gpu_scene::Parts,
    indirect::{IndirectPasses, IndirectTechnique, Quality},
    rays::{Tracer, TracerChoice},
    settings::Settings,
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
    techniques::Bounces,
};
use lanternfish_scene::named_enum;

use super::{DECLARED, passes::PhotonPasses};

named_enum! {
    /// Photon splatting method.
    Splat {
        /// Light culling makes lists of photons, and each pixel adds up those of its list.
        Gather = "gather": "Light culling makes lists of photons, and each pixel adds up those of its list",
        /// Each photon is rasterized with additive blending in 32-bit floats, as in the paper, if the adapter supports it.
        Raster = "raster": "Each photon is rasterized with additive blending, if the adapter can blend 32-bit floats",
    }
}

/// Photons from the lights, split at the first surface, and splatted at the next one [Aalund2015, §3.4, §4.2].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotonSplatting {
    /// Photons from all lights that are split at the first surface, 16 to 262,144. More: finer, slower.
    pub count: u32,
    /// Tracer of split photons. Deep images: along their axes; others: along the same directions.
    pub tracer: TracerChoice,
    /// Bounces of light between a light and the visible surface, 1 to 16.
    pub bounces: u32,
    /// Radius of a footprint relative to the ellipse in the parallelogram of its differentials, > 0. Larger: smoother, more blurred.
    pub radius: f32,
    /// Widens footprints by the solid angle of their direction: from a radius of 1 on those of one photon that
    /// was split cover what they light.
    pub widened: bool,
    /// Redistributes the flux of a footprint beyond the edges of surfaces over the rest of it; otherwise it is lost, as in the paper.
    pub conserved: bool,
    /// Photon splatting method.
    pub splat: Splat,
    /// Photons per chunk, 1024 to 4,194,304. The light is the same; fewer photons take less memory, 100 bytes each, and more passes.
    pub chunk: u32,
    /// Resolution of indirect light.
    pub resolution: IndirectResolution,
    /// Radius of the filter in an image of one frame, pixels, up to 64; 0: no filter.
    pub filter_radius: u32,
    /// True if what a pixel gets is bounded by what the pixels around it do.
    pub clamp: IndirectClamp,
}

impl Default for PhotonSplatting {
    fn default() -> Self {
        Self {
            count: 4096,
            tracer: TracerChoice::Auto,
            bounces: 1,
            radius: 0.125,
            widened: true,
            conserved: false,
            splat: Splat::Gather,
            chunk: 1 << 20,
            resolution: IndirectResolution::Full,
            filter_radius: 8,
            clamp: IndirectClamp::Off,
        }
    }
}

impl Technique for PhotonSplatting {
    const NAME: &'static str = "photon-splatting";
    const SUMMARY: &'static str =
        "Photons from the lights, split at the first surface, splatted at the next: any number of bounces";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter::new(
            "photon-count",
            "N",
            Range::Count(16, 262_144),
            "Photons emitted by all lights, split at their first surface. More: finer, slower. Default: 4096; with \
             `quality draft` 2048, best 16384",
            |room: &mut Self| &mut room.count,
        ),
        Parameter::new("photon-tracer", "NAME", Range::Names, "Tracer of split photons", |room: &mut Self| {
            &mut room.tracer
        })
        .with_default(),
        Parameter::new(
            "photon-bounces",
            "N",
            Range::Count(1, 16),
            "Bounces between light and visible surface",
            |room: &mut Self| &mut room.bounces,
        )
        .with_default(),
        Parameter::new(
            "photon-radius",
            "FACTOR",
            Range::Positive,
            "Radius of a photon's footprint relative to its differentials' ellipse. Larger: smoother, more blurred",
            |s: &mut Self| &mut s.radius,
        )
        .with_default(),
        Parameter::new(
            "photon-widened",
            "on|off",
            Range::Switch("By the cell of the direction, too", "As in the paper: by the light's differentials alone"),
            "Widens footprints by the solid angle of their direction",
            |room: &mut Self| &mut room.widened,
        )
        .with_default(),
        Parameter::new(
            "photon-conserve",
            "on|off",
            Range::Switch("No light is lost at edges", "As in the paper: it is"),
            "Redistributes the parts of footprints beyond surface edges",
            |room: &mut Self| &mut room.conserved,
        )
        .with_default(),
        Parameter::new("photon-splat", "NAME", Range::Names, "Photon splatting method", |room: &mut Self| {
            &mut room.splat
        })
        .with_default(),
        Parameter::new(
            "photon-chunk",
            "N",
            Range::Count(1024, 4_194_304),
            "Photons per chunk. The light is the same; fewer photons take less memory",
            |s: &mut Self| &mut s.chunk,
        )
        .with_default(),
        Parameter { info: RESOLUTION, of: |s| &mut s.resolution },
        Parameter { info: FILTER, of: |s| &mut s.filter_radius },
        Parameter { info: CLAMP, of: |s| &mut s.clamp },
    ];
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
        Ok(Box::new(PhotonPasses::new(device, *self, settings, tracer)?))
    }
}
