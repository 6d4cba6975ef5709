//! Parameters of indirect light by rays from every pixel.

use lanternfish_scene::named_enum;

use super::{DECLARED, SampledLight};
use crate::{
    denoise::{
        IndirectClamp, IndirectResolution,
        smoothing::{CLAMP, FILTER, RESOLUTION},
    },
    error::RenderError,
    gpu_scene::Parts,
    indirect::{IndirectPasses, IndirectTechnique, Quality, radiance_cache::Bounces},
    parameters,
    rays::{Tracer, TracerChoice},
    settings::{Materials, Settings},
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
};

/// Limits of the radiance cache's capacity, entries, and of the samples per entry in an image's first frame.
pub(super) const LEAST_ENTRIES: u32 = 64;
pub(super) const MOST_ENTRIES: u32 = 1 << 19;
pub(super) const MOST_SAMPLES: u32 = 128;
/// Largest factor by which an image's first frame has more rays.
pub(super) const MOST_FIRST_RAYS: u32 = 8;

parameters! {
    /// Indirect light by rays from every pixel.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct Sampled {
        /// Diffuse rays per pixel; in an image's first frame `first-rays` times as many. More: less noise, slower.
        diffuse_rays: u32 = 8, "indirect-rays" "N" Range::Count(1, 4096);
        /// Factor of diffuse rays in an image's first frame, which has no history, with `hit-light cached`. More: less
        /// noise, slower.
        first_rays: u32 = 2, "first-rays" "N" Range::Count(1, MOST_FIRST_RAYS);
        /// Glossy rays per pixel. More: less noise in reflections, slower. 0: no glossy indirect light.
        glossy_rays: u32 = 4, "glossy-rays" "N" Range::Count(0, 4096);
        /// Tracer of these rays.
        tracer: TracerChoice = TracerChoice::Auto, "indirect-tracer" "NAME" Range::Names;
        /// Pixels from which rays start.
        resolution: IndirectResolution = IndirectResolution::Full => RESOLUTION;
        /// Radius of the edge-stopping filter in an image of one frame, up to 64 pixels; 0: none. Over n frames the
        /// radius, and with it the bias, shrinks with the sixth root of n.
        filter_radius: u32 = 8 => FILTER;
        /// Firefly clamp. With a filter, light that few rays hit is redistributed over more pixels; without one, some
        /// of it is lost.
        clamp: IndirectClamp = IndirectClamp::On => CLAMP;
        /// Shading of ray hits.
        hit_light: HitLight = HitLight::Cached, "hit-light" "NAME" Range::Names;
        /// Maximum number of bounces, 1 to 8, or all (one if hits are shaded). 2 to 8: with `hit-light cached`.
        bounces: Bounces = Bounces::All, "bounces" "N|all" Range::Names;
        /// Largest capacity of the radiance cache, entries. More: fewer hits without an entry.
        ///
        /// It is rounded up to a power of two. The cache starts at 131,072 entries and grows. Memory per entry: about
        /// 300 bytes with one bounce, 790 with all, 1,000 with eight; after 128 frames, with a second table, 410, 1,400
        /// and 1,800.
        cache_entries: u32 = 1 << 18, "cache-entries" "N" Range::Count(LEAST_ENTRIES, MOST_ENTRIES);
        /// Most samples per cache entry in an image's first frame. More: less noise, slower.
        ///
        /// As many for entries that most rays of pixels hit, down to an eighth for others.
        cache_samples: u32 = 16, "cache-samples" "N" Range::Count(1, MOST_SAMPLES);
    }
}

named_enum! {
    /// Source of the radiance that a ray hit sends back along the ray.
    #[derive(Default)]
    HitLight {
        /// Each hit is shaded: its material is read, and a shadow ray to one chosen light is traced. One bounce.
        Shaded = "shaded": "Each hit is shaded, with a shadow ray to one chosen light. One bounce",
        /// A world-space radiance cache stores outgoing radiance at ray hits. Each frame updates a fraction of the
        /// entries; all of them for some frames after a change of the scene.
        #[default]
        Cached = "cached": "The radiance cache: every bounce",
    }
}

impl Sampled {
    /// The same number of rays in every frame, with shaded hits: one bounce.
    pub const fn one_bounce(self) -> Self {
        Self { first_rays: 1, hit_light: HitLight::Shaded, bounces: Bounces::ONE, ..self }
    }
}

impl Quality {
    /// Parameters of this quality.
    pub const fn sampled(self) -> Sampled {
        let good = Sampled::DEFAULT;
        match self {
            Self::Draft => {
                Sampled { diffuse_rays: 4, first_rays: 1, glossy_rays: 1, resolution: IndirectResolution::Half, ..good }
            }
            Self::Good => good,
            Self::Best => Sampled { diffuse_rays: 64, first_rays: 1, glossy_rays: 16, cache_samples: 128, ..good },
        }
    }
}

impl Technique for Sampled {
    const NAME: &'static str = "sampled";
    const SUMMARY: &'static str = "Rays from every pixel, lit by the radiance cache";
    const PARAMETERS: &'static [Parameter<Self>] = Self::ROWS;
    const SHADERS: Shaders = DECLARED;
}

impl IndirectTechnique for Sampled {
    fn bounces(&self) -> Option<Bounces> {
        Some(self.bounces)
    }

    fn spend(&mut self, quality: Quality) {
        *self = quality.sampled();
    }

    fn parts(&self) -> Parts {
        Parts::HITS
    }

    fn tracers(&self) -> Vec<Tracer> {
        vec![self.tracer.fixed()]
    }

    fn resolve_tracer(&mut self, automatic: Tracer) {
        self.tracer.resolve(automatic);
    }

    fn shares_emission(&self) -> Option<f32> {
        Some(if self.glossy_rays > 0 { f32::MAX } else { 0.0 })
    }

    fn for_transparent(&mut self) {
        self.tracer = self.tracer.fixed().exact().into();
        self.resolution = IndirectResolution::Full;
        self.glossy_rays = self.glossy_rays.max(1);
        self.hit_light = HitLight::Shaded;
        self.bounces = Bounces::ONE;
    }

    fn for_coats(&mut self) {
        self.for_transparent();
        (self.diffuse_rays, self.first_rays) = (1, 1);
    }

    fn for_other_sides(&mut self) {
        // Light goes through a shell many times: as many bounces as elsewhere.
        let (hit_light, bounces) = (self.hit_light, self.bounces);
        self.for_transparent();
        (self.glossy_rays, self.hit_light, self.bounces) = (0, hit_light, bounces);
    }

    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError> {
        // Lambertian surfaces have no glossy lobe.
        let glossy_rays = if settings.materials.model == Materials::Lambert { 0 } else { self.glossy_rays };
        let sampled = Self { glossy_rays, ..*self };
        Ok(Box::new(SampledLight::new(device, sampled, settings, tracer)?))
    }
}
