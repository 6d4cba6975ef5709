//! Flags of light that does not come straight from the listed lights.

use clap::{Args, ValueEnum};
use lanternfish::settings::{
    DeepImageSettings, DirectionSet, Indirect, IndirectResolution, IndirectTracer, Occlusion, Sampled, Settings,
};

use crate::{choices::choice, parse};

#[derive(Debug, Args)]
pub struct IndirectArgs {
    /// Where light comes from that is not straight from the lights: other surfaces, emission, the surroundings.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = IndirectName::default())]
    pub indirect: IndirectName,
    /// Diffuse rays a pixel, with --indirect sampled. More: less noise, slower.
    #[arg(long, value_name = "N", default_value_t = Sampled::default().diffuse_rays)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=4096), allow_hyphen_values = true)]
    pub indirect_rays: u32,
    /// Glossy rays a pixel, with --indirect sampled. More: less noise on what shines, slower.
    #[arg(long, value_name = "N", default_value_t = Sampled::default().glossy_rays)]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=4096), allow_hyphen_values = true)]
    pub glossy_rays: u32,
    /// What these rays are traced through.
    #[arg(long, value_name = "NAME", value_parser = choice::<IndirectTracer>())]
    #[arg(default_value_t = Sampled::default().tracer)]
    pub indirect_tracer: IndirectTracer,
    /// Where these rays start.
    #[arg(long, value_name = "NAME", value_parser = choice::<IndirectResolution>())]
    #[arg(default_value_t = Sampled::default().resolution)]
    pub indirect_resolution: IndirectResolution,
    /// Pixels to each side over which what they bring is averaged, short of edges; 0: none. More: less noise, less detail.
    #[arg(long, value_name = "PIXELS", default_value_t = Sampled::default().filter_radius)]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=64), allow_hyphen_values = true)]
    pub indirect_filter: u32,
    /// How it is found how much of the --sky surfaces see, which then lights them; with --indirect none. Opaque surfaces alone.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = OcclusionName::None)]
    pub occlusion: OcclusionName,
    /// Distance from which on nothing occludes, m. Higher: darker. Without it: with --occlusion deep everything occludes,
    /// however far; with hbao 1 m.
    #[arg(long, value_name = "METRES", value_parser = parse::positive, allow_hyphen_values = true)]
    pub occlusion_distance: Option<f32>,
    /// Texels across and down a deep image. More: finer, more memory (by the square).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=1024))]
    #[arg(default_value_t = DeepImageSettings::default().resolution)]
    pub deep_resolution: u32,
    /// Directions that there are deep images of: zonal:N, stacks:AxB or cube:K, as in `lanternfish help deep-images`. Each serves
    /// its opposite too. More: smoother, slower.
    #[arg(long, value_name = "SET", value_parser = parse::direction_set, default_value = "zonal:169")]
    pub deep_directions: DirectionSet,
}

/// Where light comes from that is not straight from the lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum IndirectName {
    /// Nowhere: direct light alone
    None,
    /// Rays from every pixel, whose ends are lit by the scene's lights: one bounce
    Sampled,
}

impl Default for IndirectName {
    fn default() -> Self {
        match Settings::default().indirect {
            Indirect::None => Self::None,
            Indirect::Sampled(_) => Self::Sampled,
        }
    }
}

/// How it is found how much of the surroundings surfaces see.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OcclusionName {
    /// It is not: the surroundings light nothing
    None,
    /// By the directions of deep images, which hold the whole scene
    Deep,
    /// By horizons in the picture's depth, which knows what is seen: for comparison
    Hbao,
}

impl IndirectArgs {
    /// As the library has it.
    pub fn indirect(&self) -> Indirect {
        match self.indirect {
            IndirectName::None => Indirect::None,
            IndirectName::Sampled => Indirect::Sampled(Sampled {
                diffuse_rays: self.indirect_rays,
                glossy_rays: self.glossy_rays,
                tracer: self.indirect_tracer,
                resolution: self.indirect_resolution,
                filter_radius: self.indirect_filter,
            }),
        }
    }

    /// As the library has it.
    pub fn occlusion(&self) -> Occlusion {
        match self.occlusion {
            OcclusionName::None => Occlusion::None,
            OcclusionName::Deep => Occlusion::Deep { max_distance: self.occlusion_distance },
            OcclusionName::Hbao => {
                Occlusion::Hbao { radius: self.occlusion_distance.unwrap_or(Occlusion::DEFAULT_RADIUS) }
            }
        }
    }

    /// The deep images that both are found in.
    pub fn deep_images(&self) -> DeepImageSettings {
        DeepImageSettings {
            directions: self.deep_directions,
            resolution: self.deep_resolution,
            ..DeepImageSettings::default()
        }
    }
}
