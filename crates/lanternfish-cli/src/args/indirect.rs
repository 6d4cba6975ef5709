//! Flags of light that does not come straight from the listed lights.

use clap::{Args, ValueEnum};
use lanternfish::settings::{
    DeepImageSettings, DirectionSet, Indirect, IndirectResolution, IndirectTracer, Sampled, Settings,
};

use crate::choices::choice;

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
    /// Directions that there are deep images of. More: rays bent less, more memory.
    #[arg(long, value_name = "N", default_value_t = count(DeepImageSettings::default().directions))]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=4096), allow_hyphen_values = true)]
    pub deep_directions: u32,
    /// Texels across and down a deep image. More: finer, memory by the square.
    #[arg(long, value_name = "TEXELS", default_value_t = DeepImageSettings::default().resolution)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=4096), allow_hyphen_values = true)]
    pub deep_resolution: u32,
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

fn count(set: DirectionSet) -> u32 {
    u32::try_from(set.count()).expect("the default set is small")
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

    /// The deep images it is found in.
    pub fn deep_images(&self) -> DeepImageSettings {
        DeepImageSettings {
            directions: DirectionSet::ZonalEqualArea { count: self.deep_directions },
            resolution: self.deep_resolution,
            ..DeepImageSettings::default()
        }
    }
}
