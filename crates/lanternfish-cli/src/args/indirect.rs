//! Flags of indirect light and ambient occlusion.

use clap::Args;
use lanternfish::{
    indirect::IndirectTechnique,
    occlusion::OcclusionTechnique,
    settings::{Indirect, Occlusion, Preset, Samples, Settings},
};
use lanternfish_papers::DeepImageSettings;

use super::parameters::{DeepImages, ParameterFlags, TechniqueFlag};
use crate::choices::choice;

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
    #[command(flatten)]
    deep_images: ParameterFlags<DeepImages>,
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
        let mut images = DeepImageSettings { resolution: spent, ..usual };
        self.deep_images.set(&mut images);
        images
    }
}
