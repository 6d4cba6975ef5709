//! What can be chosen of indirect light by rays from every pixel.

use lanternfish_scene::named_enum;

use super::{DECLARED, SampledLight};
use crate::{
    error::RenderError,
    gpu_scene::Parts,
    indirect::{
        IndirectClamp, IndirectPasses, IndirectResolution, IndirectTechnique, Quality,
        radiance_cache::Bounces,
        smoothing::{CLAMP, FILTER, RESOLUTION},
    },
    rays::{Tracer, TracerChoice},
    settings::{Materials, Settings},
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
};

/// Entries that the radiance cache may have room for, and samples of each in an image's first frame.
pub(super) const LEAST_ENTRIES: u32 = 64;
pub(super) const MOST_ENTRIES: u32 = 1 << 19;
pub(super) const MOST_SAMPLES: u32 = 128;
/// How many times as many rays an image's first frame may have.
pub(super) const MOST_FIRST_RAYS: u32 = 8;

/// How rays of indirect light are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampled {
    /// Rays a pixel by the cosine, 1 to 128. More: less noise, slower.
    pub diffuse_rays: u32,
    /// How many times as many rays by the cosine an image's first frame has, 1 to 8, where the radiance cache lights their ends: that frame has
    /// nothing from before. More: less noise in an image of one frame, slower.
    pub first_rays: u32,
    /// Rays a pixel about the mirror direction. More: less noise on glossy surfaces, slower; 0: none shine.
    pub glossy_rays: u32,
    /// What rays are traced through.
    pub tracer: TracerChoice,
    /// Where rays start.
    pub resolution: IndirectResolution,
    /// Pixels to each side that the filter reaches in an image of one frame, up to 64; 0: none. More: less noise, softer detail.
    /// Over n frames it shrinks with the root of n, and with it what it leaves wrong.
    pub filter_radius: u32,
    /// Whether what a pixel's rays bring is bounded by what those of the pixels around it do. On: no bright spots, and where few rays find
    /// light, it is spread over more pixels, or less where there is no filter.
    pub clamp: IndirectClamp,
    /// Where the light comes from that the hit points send.
    pub hit_light: HitLight,
    /// How often light is reflected before it comes to the surface that is seen; all: as often as `hit_light` knows, once where ends are shaded.
    pub bounces: Bounces,
    /// Entries that the radiance cache has room for at most, 64 to 524,288, rounded up to a power of two; at first for 131,072, and it grows. More: fewer
    /// hit points are shaded because there is no room, and some 300 bytes for each that there is room for, with every bounce 660 and with eight 1,000;
    /// after 128 frames, with a second table, 410, 1,100 and 1,800.
    pub cache_entries: u32,
    /// Samples that an entry of the radiance cache gets in an image's first frame, at least 1; where rays of pixels do not end, down to a quarter. More:
    /// less noise in an image of one frame, and more of the bounces, slower.
    pub cache_samples: u32,
}

named_enum! {
    /// Where the light comes from that the hit point of a ray sends back along it.
    #[derive(Default)]
    HitLight {
        /// Each end is shaded: its material is read, and a light is chosen for it and looked for. One bounce.
        Shaded = "shaded": "One light and one shadow ray per hit. One bounce",
        /// From the radiance cache: entries in space keep what the surfaces in them send, and a share of them is brought up to date in each
        /// frame, and all of them for some frames after a change of the scene.
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
    /// The same rays in every frame, whose ends are shaded each: one bounce.
    pub const fn one_bounce(self) -> Self {
        Self { first_rays: 1, hit_light: HitLight::Shaded, bounces: Bounces::ONE, ..self }
    }
}

impl Quality {
    /// How rays are taken.
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
            "Samples per cache entry in an image's first frame. More: less noise, slower",
            |sampled| &mut sampled.cache_samples,
        ),
    ];
    const SHADERS: Shaders = DECLARED;
}

impl IndirectTechnique for Sampled {
    fn is_physical(&self) -> bool {
        true
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

    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError> {
        // Lambertian surfaces do not shine.
        let glossy_rays = if settings.materials == Materials::Lambert { 0 } else { self.glossy_rays };
        let sampled = Self { glossy_rays, ..*self };
        Ok(Box::new(SampledLight::new(device, sampled, settings, tracer)?))
    }
}
