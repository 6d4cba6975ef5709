//! Flags of rendering techniques.

use clap::Args;
use lanternfish::{
    direct_light::DirectTechnique,
    direct_light::auto::AutoLights,
    light_culling::CullingTechnique,
    settings::{Direct, Settings},
};

use super::parameters::{ParameterFlags, SampleFlags, ShadowFlags, TechniqueFlag};

/// Flags of light culling, shadows and antialiasing.
#[derive(Debug, Args)]
pub struct TechniqueArgs {
    #[command(flatten)]
    direct: TechniqueFlag<dyn DirectTechnique>,
    #[command(flatten)]
    direct_parameters: ParameterFlags<dyn DirectTechnique>,
    /// Shadows, and frames that depend on each other.
    #[command(flatten)]
    shadows: ShadowFlags,
    #[command(flatten)]
    culling: TechniqueFlag<dyn CullingTechnique>,
    #[command(flatten)]
    culling_parameters: ParameterFlags<dyn CullingTechnique>,
    /// Samples, and bindings.
    #[command(flatten)]
    samples: SampleFlags,
}

impl TechniqueArgs {
    /// Sets what these flags choose.
    pub fn set(&self, settings: &mut Settings) {
        let direct = if self.direct.is_given { &self.direct.choice } else { &settings.direct };
        settings.direct = self.direct_parameters.turned(direct.clone());
        settings.culling = self.culling_parameters.turned(self.culling.choice.clone());
        self.shadows.set(settings);
        self.samples.set(settings);
    }

    /// Number of frames that an image averages.
    pub fn frames(&self) -> u32 {
        let mut settings = Settings::default();
        self.samples.set(&mut settings);
        settings.image.accumulate
    }

    /// The technique that follows the number of lights, with the parameters of these flags.
    pub fn automatic_direct(&self) -> Direct {
        self.direct_parameters.turned(AutoLights::default().into())
    }
}
