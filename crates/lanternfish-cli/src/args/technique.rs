//! Flags of rendering techniques.

use clap::Args;
use lanternfish::{
    direct_light::DirectTechnique,
    direct_light::auto::AutoLights,
    light_culling::CullingTechnique,
    settings::{
        Antialiasing, Culling, Direct, History, RayCulling, RayRangeCulling, Samples, Settings, Shadows, TextureBinding,
    },
};

use super::parameters::{ParameterFlags, TechniqueFlag};
use crate::choices::choice;

/// Flags of light culling, shadows and antialiasing.
#[derive(Debug, Args)]
pub struct TechniqueArgs {
    #[command(flatten)]
    direct: TechniqueFlag<dyn DirectTechnique>,
    #[command(flatten)]
    direct_parameters: ParameterFlags<dyn DirectTechnique>,
    /// Technique of shadows.
    ///
    /// The images of the techniques differ in a few pixels at silhouettes; with deep images, within one texel of them.
    #[arg(long, value_name = "NAME", value_parser = choice::<Shadows>(), hide_short_help = true)]
    #[arg(default_value_t = Settings::default().shadows.technique)]
    pub shadows: Shadows,
    /// Shadow rays to skip where the surface faces away from the light.
    #[arg(long, value_name = "NAME", value_parser = choice::<RayCulling>())]
    #[arg(default_value_t = Settings::default().shadows.ray_culling, hide_short_help = true)]
    pub ray_culling: RayCulling,
    /// Shadow rays only from within a light's range, tested for each pixel. The image is the same.
    #[arg(long, value_name = "ON|OFF", value_parser = choice::<RayRangeCulling>())]
    #[arg(default_value_t = Settings::default().shadows.ray_range_culling, hide_short_help = true)]
    pub ray_range_culling: RayRangeCulling,
    /// Shadow rays per pixel to each light with a --light-radius, a --disk or a --rectangle. More: less noise, slower.
    ///
    /// At most 32 to a disk or rectangle; --accumulate adds to them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=255), allow_hyphen_values = true)]
    #[arg(default_value_t = Settings::default().shadows.rays, hide_short_help = true)]
    pub shadow_rays: u32,
    /// Temporal accumulation of indirect light and area-light shadows.
    ///
    /// On: less noise while the camera moves, and changes of light show with a delay. The first image, and its mean, are the
    /// same with either. Without it: off, but on in a window and with --quality realtime.
    #[arg(long, value_name = "ON|OFF", value_parser = choice::<History>(), hide_short_help = true)]
    pub history: Option<History>,
    /// Antialiasing over the frames of a moving view.
    ///
    /// The first image is the same with either; later ones depend on those before. Without it: none, but temporal with
    /// --quality realtime.
    #[arg(long, value_name = "NAME", value_parser = choice::<Antialiasing>(), hide_short_help = true)]
    pub antialiasing: Option<Antialiasing>,
    #[command(flatten)]
    culling: TechniqueFlag<dyn CullingTechnique>,
    #[command(flatten)]
    culling_parameters: ParameterFlags<dyn CullingTechnique>,
    /// Samples per pixel at edges.
    ///
    /// Multisampling of triangle edges. More: smoother edges. Every adapter supports 4. Without it: 4, where they cost a small
    /// part of the frame; 1 with --quality draft, --indirect none, debug views, and images of --accumulate 8 or more, whose
    /// edges are smooth without.
    #[arg(long, value_name = "N", value_parser = choice::<Samples>())]
    pub samples: Option<Samples>,
    /// Averages N frames: smooth edges, less noise.
    ///
    /// Each frame jitters the sample position in the pixel. N times as slow.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_hyphen_values = true)]
    #[arg(default_value_t = Settings::default().image.accumulate)]
    pub accumulate: u32,
    /// Binding of textures to shaders. The image is the same.
    #[arg(long, value_name = "NAME", value_parser = choice::<TextureBinding>())]
    #[arg(default_value_t = Settings::default().materials.textures, hide_short_help = true)]
    pub textures: TextureBinding,
}

impl TechniqueArgs {
    /// The technique of direct light that these flags choose. `usual`: without them.
    pub fn direct(&self, usual: &Direct) -> Direct {
        self.direct_parameters.turned(if self.direct.is_given { &self.direct.choice } else { usual }.clone())
    }

    /// The technique that follows the number of lights, with the parameters of these flags.
    pub fn automatic_direct(&self) -> Direct {
        self.direct_parameters.turned(AutoLights::default().into())
    }

    /// The light culling that these flags choose.
    pub fn culling(&self) -> Culling {
        self.culling_parameters.turned(self.culling.choice.clone())
    }
}
