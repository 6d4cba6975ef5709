//! Flags of indirect light and ambient occlusion.

use clap::Args;
use lanternfish::{
    indirect::IndirectTechnique,
    occlusion::OcclusionTechnique,
    settings::{Indirect, Occlusion, Preset, Samples, Settings},
};
use lanternfish_papers::{DeepBuilder, DeepImageSettings, DeepSearch, DeepSort, DirectionSet};

use super::parameters::{ParameterFlags, TechniqueFlag};
use crate::{choices::choice, parse};

/// Least number of averaged frames at which one sample per pixel gives edges as accurate as four, at lower cost. More frames
/// give more accurate edges.
const SMOOTH_FRAMES: u32 = 32;

/// Flags of indirect light and occlusion.
#[derive(Debug, Args)]
pub struct IndirectArgs {
    #[command(flatten)]
    indirect: TechniqueFlag<dyn IndirectTechnique>,
    /// Preset.
    ///
    /// Sets the flags below that are not given, and with draft --indirect probes; with realtime also --direct sampled,
    /// --history on and --antialiasing temporal.
    #[arg(long, value_name = "NAME", value_parser = choice::<Preset>(), default_value_t = Preset::default())]
    pub quality: Preset,
    #[command(flatten)]
    indirect_parameters: ParameterFlags<dyn IndirectTechnique>,
    #[command(flatten)]
    occlusion: TechniqueFlag<dyn OcclusionTechnique>,
    #[command(flatten)]
    occlusion_parameters: ParameterFlags<dyn OcclusionTechnique>,
    /// Texels across and down each deep image. More: finer, and more memory by the square. Without it: 64, or the value of
    /// --quality.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=1024))]
    #[arg(hide_short_help = true)]
    pub deep_resolution: Option<u32>,
    /// Set of deep-image directions: zonal:N, stacks:AxB or cube:K, as in `lanternfish help deep-images`. Each direction also
    /// serves its opposite. More: smoother, slower.
    #[arg(long, value_name = "SET", value_parser = parse::direction_set, default_value = "zonal:169")]
    #[arg(hide_short_help = true)]
    pub deep_directions: DirectionSet,
    /// Frames over which deep images are rebuilt after something moved, in a window and in replays. More: less time per frame,
    /// and some directions lag by up to this many frames.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64), default_value_t = 1)]
    #[arg(hide_short_help = true)]
    pub deep_slices: u32,
    /// Builder of deep images. A window needs per_triangle or per_direction.
    ///
    /// As in Archer 2019: --deep-directions stacks:13x13 --deep-resolution 64 --deep-builder single_pass --deep-merge 0
    /// --deep-sort blocks --deep-search linear_steps.
    #[arg(long, value_name = "NAME", value_parser = choice::<DeepBuilder>())]
    #[arg(default_value_t = DeepImageSettings::default().builder, hide_short_help = true)]
    pub deep_builder: DeepBuilder,
    /// Sort of the lists of deep images. The image is the same.
    #[arg(long, value_name = "NAME", value_parser = choice::<DeepSort>())]
    #[arg(default_value_t = DeepImageSettings::default().sort, hide_short_help = true)]
    pub deep_sort: DeepSort,
    /// Distance below which fragments of a list are merged, texel widths; 0: none is. More: less memory, thin walls get thinner.
    #[arg(long, value_name = "TEXELS", value_parser = parse::texels)]
    #[arg(default_value_t = DeepImageSettings::default().merge_texels, hide_short_help = true)]
    pub deep_merge: f32,
    /// Search in the lists of deep images. The image is the same.
    #[arg(long, value_name = "NAME", value_parser = choice::<DeepSearch>())]
    #[arg(default_value_t = DeepImageSettings::default().search, hide_short_help = true)]
    pub deep_search: DeepSearch,
}

impl IndirectArgs {
    /// The library's setting.
    pub fn indirect(&self) -> Indirect {
        let quality = self.quality.quality();
        let chosen = match self.indirect.is_given {
            true => self.indirect.choice.clone().of_quality(quality),
            false => Indirect::preset(quality),
        };
        self.indirect_parameters.turned(chosen)
    }

    /// Samples per pixel for an image that averages `frames` frames. Averaged frames jitter the sample position, so edges are
    /// smooth without multisampling; with multisampling too, edges smear over neighbouring pixels.
    pub fn samples(&self, frames: u32) -> Samples {
        match self.indirect.choice.is_none() {
            _ if frames >= SMOOTH_FRAMES => Samples::One,
            true => Settings::direct_light().image.samples,
            false => self.quality.quality().samples(),
        }
    }

    /// The library's setting.
    pub fn occlusion(&self) -> Occlusion {
        self.occlusion_parameters.turned(self.occlusion.choice.clone())
    }

    /// Settings of the deep images that both use.
    pub fn deep_images(&self) -> DeepImageSettings {
        let usual = DeepImageSettings::default();
        let spent = match self.indirect.choice.is_none() {
            true => usual.resolution,
            false => DeepImageSettings::of_quality(self.quality.quality()).resolution,
        };
        let resolution = self.deep_resolution.unwrap_or(spent);
        DeepImageSettings {
            directions: self.deep_directions,
            resolution,
            builder: self.deep_builder,
            merge_texels: self.deep_merge,
            slices: self.deep_slices,
            sort: self.deep_sort,
            search: self.deep_search,
            ..usual
        }
    }
}
