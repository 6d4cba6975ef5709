//! Flags of light that does not come straight from the listed lights.

use clap::Args;
use lanternfish::{
    indirect::IndirectTechnique,
    occlusion::OcclusionTechnique,
    settings::{Indirect, Occlusion, Quality, Samples, Settings},
};
use lanternfish_papers::{DeepImageSettings, DirectionSet};

use super::parameters::{ParameterFlags, TechniqueFlag};
use crate::{choices::choice, parse};

/// Frames of a mean from which on its edges are as close to the share of the pixel that they cover with one sample in each as with four, and cost
/// less; with more they are closer.
const SMOOTH_FRAMES: u32 = 8;

/// Flags of indirect light and occlusion.
#[derive(Debug, Args)]
pub struct IndirectArgs {
    #[command(flatten)]
    indirect: TechniqueFlag<dyn IndirectTechnique>,
    /// Cost of indirect light.
    ///
    /// What --indirect sampled spends: the flags below that are not given.
    #[arg(long, value_name = "NAME", value_parser = choice::<Quality>(), default_value_t = Quality::default())]
    pub quality: Quality,
    #[command(flatten)]
    indirect_parameters: ParameterFlags<dyn IndirectTechnique>,
    #[command(flatten)]
    occlusion: TechniqueFlag<dyn OcclusionTechnique>,
    #[command(flatten)]
    occlusion_parameters: ParameterFlags<dyn OcclusionTechnique>,
    /// Texels along an edge of a deep image. More: finer; memory grows with the square. Without it: 64, or what --quality says.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=1024))]
    #[arg(hide_short_help = true)]
    pub deep_resolution: Option<u32>,
    /// Directions of the deep images: zonal:N, stacks:AxB or cube:K, as in `lanternfish help deep-images`. Each serves
    /// its opposite too. More: smoother, slower.
    #[arg(long, value_name = "SET", value_parser = parse::direction_set, default_value = "zonal:169")]
    #[arg(hide_short_help = true)]
    pub deep_directions: DirectionSet,
    /// Frames over which deep images are built again once something has moved, where frames do not wait: in a window and in replays. More: less time
    /// in each frame, and some directions are so many frames late.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64), default_value_t = 1)]
    #[arg(hide_short_help = true)]
    pub deep_slices: u32,
}

impl IndirectArgs {
    /// As the library has it.
    pub fn indirect(&self) -> Indirect {
        self.indirect_parameters.turned(self.indirect.0.clone().of_quality(self.quality))
    }

    /// Samples a pixel that go with it, in a mean of so many frames. Frames of a mean look through other points of their pixels, and their edges
    /// are smooth without; with several samples in each as well, edges are smeared over the pixels beside them.
    pub fn samples(&self, frames: u32) -> Samples {
        match self.indirect.0.is_none() {
            _ if frames >= SMOOTH_FRAMES => Samples::One,
            true => Settings::direct_light().samples,
            false => self.quality.samples(),
        }
    }

    /// As the library has it.
    pub fn occlusion(&self) -> Occlusion {
        self.occlusion_parameters.turned(self.occlusion.0.clone())
    }

    /// The deep images that both are found in.
    pub fn deep_images(&self) -> DeepImageSettings {
        let usual = DeepImageSettings::default();
        let spent = match self.indirect.0.is_none() {
            true => usual.resolution,
            false => DeepImageSettings::of_quality(self.quality).resolution,
        };
        let resolution = self.deep_resolution.unwrap_or(spent);
        DeepImageSettings { directions: self.deep_directions, resolution, slices: self.deep_slices, ..usual }
    }
}
