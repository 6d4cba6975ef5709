//! Flags of light that does not come straight from the listed lights.

use clap::{Args, ValueEnum};
use lanternfish::settings::{
    DeepImageSettings, DirectionSet, Indirect, IndirectClamp, IndirectResolution, IndirectTracer, Occlusion, Quality,
    Sampled, Samples, Settings,
};

use crate::{choices::choice, parse};

#[derive(Debug, Args)]
pub struct IndirectArgs {
    /// Indirect light.
    ///
    /// Where light comes from that is not straight from the lights: other surfaces, emission, the surroundings.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = IndirectName::default())]
    pub indirect: IndirectName,
    /// What that may cost.
    ///
    /// What --indirect sampled spends: the flags below that are not given.
    #[arg(long, value_name = "NAME", value_parser = choice::<Quality>(), default_value_t = Quality::default())]
    pub quality: Quality,
    /// Diffuse rays a pixel. More: less noise, slower.
    #[arg(long, value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=4096), allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    pub indirect_rays: Option<u32>,
    /// Glossy rays a pixel. More: less noise on what shines, slower.
    #[arg(long, value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=4096), allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    pub glossy_rays: Option<u32>,
    /// What these rays are traced through.
    #[arg(long, value_name = "NAME", value_parser = choice::<IndirectTracer>())]
    #[arg(hide_short_help = true)]
    pub indirect_tracer: Option<IndirectTracer>,
    /// Where these rays start.
    #[arg(long, value_name = "NAME", value_parser = choice::<IndirectResolution>())]
    #[arg(hide_short_help = true)]
    pub indirect_resolution: Option<IndirectResolution>,
    /// Pixels to each side over which what they bring is averaged, short of edges; 0: none. More: less noise, less detail.
    #[arg(long, value_name = "PIXELS")]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=64), allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    pub indirect_filter: Option<u32>,
    /// Whether what a pixel's rays bring is bounded by what those around it do. Without it: on, with --quality best off.
    #[arg(long, value_name = "ON|OFF", value_parser = choice::<IndirectClamp>(), hide_short_help = true)]
    pub indirect_clamp: Option<IndirectClamp>,
    /// How it is found how much of the surroundings (--sky, --environment) surfaces see, which then light them; with --indirect none.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = OcclusionName::default())]
    #[arg(hide_short_help = true)]
    pub occlusion: OcclusionName,
    /// Distance from which on nothing occludes, m. Higher: darker. Without it: with --occlusion deep everything occludes,
    /// however far; with hbao 1 m.
    #[arg(long, value_name = "METRES", value_parser = parse::positive, allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    pub occlusion_distance: Option<f32>,
    /// Texels across and down a deep image. More: finer, more memory (by the square). Without it: 64, or what --quality says.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=1024))]
    #[arg(hide_short_help = true)]
    pub deep_resolution: Option<u32>,
    /// Directions that there are deep images of: zonal:N, stacks:AxB or cube:K, as in `lanternfish help deep-images`. Each serves
    /// its opposite too. More: smoother, slower.
    #[arg(long, value_name = "SET", value_parser = parse::direction_set, default_value = "zonal:169")]
    #[arg(hide_short_help = true)]
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

impl Default for OcclusionName {
    fn default() -> Self {
        match Settings::default().occlusion {
            Occlusion::None => Self::None,
            Occlusion::Deep { .. } => Self::Deep,
            Occlusion::Hbao { .. } => Self::Hbao,
        }
    }
}

impl IndirectArgs {
    /// As the library has it.
    pub fn indirect(&self) -> Indirect {
        match self.indirect {
            IndirectName::None => Indirect::None,
            IndirectName::Sampled => {
                let spent = self.quality.sampled();
                Indirect::Sampled(Sampled {
                    diffuse_rays: self.indirect_rays.unwrap_or(spent.diffuse_rays),
                    glossy_rays: self.glossy_rays.unwrap_or(spent.glossy_rays),
                    tracer: self.indirect_tracer.unwrap_or(spent.tracer),
                    resolution: self.indirect_resolution.unwrap_or(spent.resolution),
                    filter_radius: self.indirect_filter.unwrap_or(spent.filter_radius),
                    clamp: self.indirect_clamp.unwrap_or(spent.clamp),
                })
            }
        }
    }

    /// Samples a pixel that go with it.
    pub fn samples(&self) -> Samples {
        match self.indirect {
            IndirectName::None => Settings::direct_light().samples,
            IndirectName::Sampled => self.quality.samples(),
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
        let usual = DeepImageSettings::default();
        let spent = match self.indirect {
            IndirectName::None => usual.resolution,
            IndirectName::Sampled => self.quality.deep_resolution(),
        };
        let resolution = self.deep_resolution.unwrap_or(spent);
        DeepImageSettings { directions: self.deep_directions, resolution, ..usual }
    }
}
