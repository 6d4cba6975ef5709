//! Light that arrives from other surfaces, and from the surroundings.
//!
//! Every room ends in one structure, read through `indirect_light.wesl`: four layers of the size of the picture. A room: [`sampled`].

pub mod sampled;
#[cfg(test)]
mod tests;

use lanternfish_gpu::{Bindings, Feature, Frame};
use lanternfish_scene::named_enum;

use crate::{
    context::ViewContext,
    deep_images::DeepImages,
    error::RenderError,
    prepass::Surface,
    rays::Tracer,
    settings::{Materials, Samples, Settings},
};

use self::sampled::{RayCounters, SampledLight};

/// Shading adds what arrives from other surfaces.
pub(crate) const INDIRECT: Feature = Feature("indirect");

/// Where light comes from that is not straight from the listed lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Indirect {
    /// Nowhere.
    None,
    /// Rays from every pixel, whose ends are shaded by the scene's lights: one bounce, emission, surroundings
    /// [Niessner2010, §4, §5].
    Sampled(Sampled),
}

/// How rays of indirect light are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampled {
    /// Rays a pixel by the cosine, at least 1. More: less noise, slower.
    pub diffuse_rays: u32,
    /// Rays a pixel about the mirror direction. More: less noise on glossy surfaces, slower; 0: none shine.
    pub glossy_rays: u32,
    /// What rays are traced through.
    pub tracer: IndirectTracer,
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

named_enum! {
    /// What is spent on indirect light.
    #[derive(Default)]
    Quality {
        /// 4 and 1 rays from every fourth pixel, through the BVH.
        Draft = "draft",
        /// 8 and 4 rays from every pixel, through the BVH.
        #[default]
        Good = "good",
        /// 32 and 16 rays from every pixel, through the BVH, none clamped; traced exactly.
        Best = "best",
    }
}

impl Quality {
    /// How rays are taken.
    pub const fn sampled(self) -> Sampled {
        let good = Sampled {
            diffuse_rays: 8,
            glossy_rays: 4,
            tracer: IndirectTracer::Bvh,
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

    /// Texels across the deep images, where rays go through them.
    pub const fn deep_resolution(self) -> u32 {
        match self {
            Self::Draft => 64,
            Self::Good | Self::Best => 128,
        }
    }

    /// Samples a pixel at edges: several, where they are a tenth of the frame; beside a draft's light they were a third of it.
    pub const fn samples(self) -> Samples {
        match self {
            Self::Draft => Samples::One,
            Self::Good | Self::Best => Samples::Four,
        }
    }
}

named_enum! {
    /// What rays of indirect light are traced through.
    IndirectTracer {
        /// The texel of a deep image that the ray starts in, along the image's axis [Archer2019, §3.2].
        WithinTexel = "within-texel",
        /// Every texel of that image that the ray crosses [Niessner2010, §3.2].
        AcrossTexels = "across-texels",
        /// The BVH: exact.
        Bvh = "bvh",
        /// The adapter's own acceleration structure: exact, and fast where it is hardware.
        RayQuery = "ray-query",
    }
}

impl IndirectTracer {
    /// The structure.
    pub(crate) fn tracer(self) -> Tracer {
        match self {
            Self::WithinTexel => Tracer::WithinTexel,
            Self::AcrossTexels => Tracer::AcrossTexels,
            Self::Bvh => Tracer::Bvh,
            Self::RayQuery => Tracer::RayQuery,
        }
    }
}

named_enum! {
    /// Where rays of indirect light start.
    IndirectResolution {
        /// From every pixel.
        Full = "full",
        /// From every second pixel of every second row; between them light is interpolated along surfaces.
        Half = "half",
    }
}

named_enum! {
    /// Whether what a pixel's rays bring is bounded by its neighbours.
    IndirectClamp {
        /// By the mean of the pixels around it whose surfaces are like its own, and five standard deviations; by n times as much in a
        /// mean of n frames, of each of which 1 − 8/n is kept at least: the mean of many is right.
        On = "on",
        /// It is not: the mean of all pictures is right.
        Off = "off",
    }
}

impl Indirect {
    /// What its rays are traced through.
    pub(crate) fn tracer(&self) -> Tracer {
        match self {
            Self::None => Tracer::None,
            Self::Sampled(sampled) => sampled.tracer.tracer(),
        }
    }

    /// Whether ends of rays are shaded.
    pub(crate) fn shades_hits(&self) -> bool {
        matches!(self, Self::Sampled(_))
    }
}

/// The passes of a room.
#[derive(Debug)]
pub(crate) enum IndirectLight {
    /// Rays from every pixel.
    Sampled(SampledLight),
}

/// Indirect light of one view.
#[derive(Clone, Debug)]
pub struct IndirectSums {
    layers: wgpu::TextureView,
    pub(crate) counters: RayCounters,
}

impl IndirectSums {
    /// What shaders call it.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("indirect_sums", &self.layers)
    }
}

impl IndirectLight {
    /// Compiles the passes that the settings need: none, where there is no indirect light.
    pub fn new(device: &wgpu::Device, settings: &Settings, tracer: Tracer) -> Result<Option<Self>, RenderError> {
        match settings.indirect {
            Indirect::None => Ok(None),
            Indirect::Sampled(mut sampled) => {
                if settings.materials == Materials::Lambert {
                    // Nothing shines.
                    sampled.glossy_rays = 0;
                }
                let Settings { deep_images, accumulate, .. } = *settings;
                Ok(Some(Self::Sampled(SampledLight::new(device, sampled, deep_images, accumulate, tracer)?)))
            }
        }
    }

    /// Finds the indirect light of a surface that a view shows, one sample a pixel. `images` are of the scene as it stands, where the
    /// room uses them.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
        images: Option<&DeepImages>,
    ) -> Result<IndirectSums, RenderError> {
        let Self::Sampled(sampled) = self;
        sampled.record(frame, view, surface, images)
    }
}
