//! What can be chosen of indirect light by rays from every pixel.

use super::{DECLARED, SampledLight};
use crate::{
    error::RenderError,
    gpu_scene::Parts,
    indirect::{
        IndirectClamp, IndirectPasses, IndirectResolution, IndirectRoom, Quality,
        smoothing::{CLAMP, FILTER, RESOLUTION},
    },
    rays::Tracer,
    rooms::{Knob, Range, Room},
    settings::{Materials, Settings},
    shaders::Shaders,
};

/// How rays of indirect light are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampled {
    /// Rays a pixel by the cosine, at least 1. More: less noise, slower.
    pub diffuse_rays: u32,
    /// Rays a pixel about the mirror direction. More: less noise on glossy surfaces, slower; 0: none shine.
    pub glossy_rays: u32,
    /// What rays are traced through.
    pub tracer: Tracer,
    /// Where rays start.
    pub resolution: IndirectResolution,
    /// Pixels to each side that the filter reaches in a picture of one frame, up to 64; 0: none. More: less noise, softer detail.
    /// Over n frames it shrinks with the root of n, and with it what it leaves wrong.
    pub filter_radius: u32,
    /// Whether what a pixel's rays bring is bounded by what those of the pixels around it do. On: no bright spots, and less light
    /// where few rays find it.
    pub clamp: IndirectClamp,
}

impl Default for Sampled {
    fn default() -> Self {
        Quality::default().sampled()
    }
}

impl Quality {
    /// How rays are taken.
    pub const fn sampled(self) -> Sampled {
        let good = Sampled {
            diffuse_rays: 8,
            glossy_rays: 4,
            tracer: Tracer::Bvh,
            resolution: IndirectResolution::Full,
            filter_radius: 8,
            clamp: IndirectClamp::On,
        };
        match self {
            Self::Draft => Sampled { diffuse_rays: 4, glossy_rays: 1, resolution: IndirectResolution::Half, ..good },
            Self::Good => good,
            Self::Best => {
                Sampled { diffuse_rays: 32, glossy_rays: 16, filter_radius: 4, clamp: IndirectClamp::Off, ..good }
            }
        }
    }
}

impl Room for Sampled {
    const NAME: &'static str = "sampled";
    const WORDS: &'static str = "Rays from every pixel, whose ends are lit by the scene's lights: one bounce";
    const KNOBS: &'static [Knob<Self>] = &[
        Knob::new(
            "indirect-rays",
            "N",
            Range::Count(1, 4096),
            "Diffuse rays a pixel. More: less noise, slower",
            |sampled| &mut sampled.diffuse_rays,
        ),
        Knob::new(
            "glossy-rays",
            "N",
            Range::Count(0, 4096),
            "Glossy rays a pixel. More: less noise on what shines, slower",
            |sampled| &mut sampled.glossy_rays,
        ),
        Knob::new("indirect-tracer", "NAME", Range::Names, "What these rays are traced through", |sampled| {
            &mut sampled.tracer
        }),
        Knob { words: RESOLUTION, of: |sampled| &mut sampled.resolution },
        Knob { words: FILTER, of: |sampled| &mut sampled.filter_radius },
        Knob { words: CLAMP, of: |sampled| &mut sampled.clamp },
    ];
    const SHADERS: Shaders = DECLARED;
}

impl IndirectRoom for Sampled {
    fn spend(&mut self, quality: Quality) {
        *self = quality.sampled();
    }

    fn parts(&self) -> Parts {
        Parts::HITS | self.tracer.parts()
    }

    fn look_at_glass(&mut self) {
        self.tracer = self.tracer.exact();
        self.resolution = IndirectResolution::Full;
        self.glossy_rays = self.glossy_rays.max(1);
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
        Ok(Box::new(SampledLight::new(device, sampled, settings.deep_images, settings.accumulate, tracer)?))
    }
}
