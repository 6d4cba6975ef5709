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

/// Indirect light by rays from every pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampled {
    /// Diffuse (cosine-distributed) rays per pixel, 1 to 4096. More: less noise, slower.
    pub diffuse_rays: u32,
    /// Factor by which an image's first frame has more diffuse rays, 1 to 8, if the radiance cache lights hits: that frame has no history. More: less
    /// noise in an image of one frame, slower.
    pub first_rays: u32,
    /// Glossy (GGX) rays per pixel, 0 to 4096. More: less noise on glossy surfaces, slower; 0: no glossy indirect light.
    pub glossy_rays: u32,
    /// Tracer of the rays.
    pub tracer: TracerChoice,
    /// Pixels from which rays start.
    pub resolution: IndirectResolution,
    /// Radius of the edge-stopping filter in an image of one frame, up to 64 pixels; 0: none. More: less noise, softer detail.
    /// Over n frames the radius, and with it the bias, shrinks with the sixth root of n.
    pub filter_radius: u32,
    /// Firefly clamp. On: no fireflies. With a filter, light that few rays hit is redistributed over more pixels; without one, some of it is lost.
    pub clamp: IndirectClamp,
    /// Source of the radiance of ray hits.
    pub hit_light: HitLight,
    /// Largest number of reflections before light reaches the visible surface. All: every bounce with [`HitLight::Cached`], one with
    /// [`HitLight::Shaded`].
    pub bounces: Bounces,
    /// Largest capacity of the radiance cache, 64 to 524,288 entries, rounded up to a power of two. It starts at 131,072 and grows. More: fewer hits are
    /// shaded because the cache is full. Memory per entry: about 300 bytes with one bounce, 660 with all, 1,000 with eight; after 128 frames, with
    /// a second table, 410, 1,100 and 1,800.
    pub cache_entries: u32,
    /// Most samples per entry of the radiance cache in an image's first frame, at least 1: as many for entries that most rounds of pixels' rays hit, down
    /// to an eighth for others. More: less noise in an image of one frame, more complete bounces, slower.
    pub cache_samples: u32,
}

named_enum! {
    /// Source of the radiance that a ray hit sends back along the ray.
    #[derive(Default)]
    HitLight {
        /// Each hit is shaded: its material is read, and a shadow ray to one chosen light is traced. One bounce.
        Shaded = "shaded": "Each hit is shaded, with a shadow ray to one chosen light. One bounce",
        /// A world-space radiance cache stores outgoing radiance at ray hits. Each frame updates a fraction of the entries; all of them for some frames
        /// after a change of the scene.
        #[default]
        Cached = "cached": "The radiance cache: every bounce",
    }
}

impl Default for Sampled {
    fn default() -> Self {
        Quality::default().sampled()
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
        let good = Sampled {
            diffuse_rays: 8,
            first_rays: 2,
            glossy_rays: 4,
            tracer: TracerChoice::Auto,
            resolution: IndirectResolution::Full,
            filter_radius: 8,
            clamp: IndirectClamp::On,
            hit_light: HitLight::Cached,
            bounces: Bounces::All,
            cache_entries: 1 << 18,
            cache_samples: 16,
        };
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
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter::new(
            "indirect-rays",
            "N",
            Range::Count(1, 4096),
            "Diffuse rays per pixel; in an image's first frame `first-rays` times as many. More: less noise, slower",
            |sampled| &mut sampled.diffuse_rays,
        ),
        Parameter::new(
            "first-rays",
            "N",
            Range::Count(1, MOST_FIRST_RAYS),
            "Factor of diffuse rays in an image's first frame, with `hit-light cached`. More: less noise, slower",
            |sampled| &mut sampled.first_rays,
        ),
        Parameter::new(
            "glossy-rays",
            "N",
            Range::Count(0, 4096),
            "Glossy rays per pixel. More: less noise in reflections, slower",
            |sampled| &mut sampled.glossy_rays,
        ),
        Parameter::new("indirect-tracer", "NAME", Range::Names, "Tracer of these rays", |sampled| &mut sampled.tracer),
        Parameter { info: RESOLUTION, of: |sampled| &mut sampled.resolution },
        Parameter { info: FILTER, of: |sampled| &mut sampled.filter_radius },
        Parameter { info: CLAMP, of: |sampled| &mut sampled.clamp },
        Parameter::new("hit-light", "NAME", Range::Names, "Shading of ray hits", |sampled| &mut sampled.hit_light),
        Parameter::new(
            "bounces",
            "N|all",
            Range::Names,
            "Maximum number of bounces, 1 to 8, or all (one if hits are shaded). \
             2 to 8: with `hit-light cached`",
            |sampled| &mut sampled.bounces,
        ),
        Parameter::new(
            "cache-entries",
            "N",
            Range::Count(LEAST_ENTRIES, MOST_ENTRIES),
            "Largest capacity of the radiance cache, entries. More: fewer hits without an entry",
            |sampled| &mut sampled.cache_entries,
        ),
        Parameter::new(
            "cache-samples",
            "N",
            Range::Count(1, MOST_SAMPLES),
            "Most samples per cache entry in an image's first frame. More: less noise, slower",
            |sampled| &mut sampled.cache_samples,
        ),
    ];
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
