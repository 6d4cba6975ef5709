//! Flags of how the image is found.

use clap::Args;
use lanternfish::{
    light_culling::CullingTechnique,
    settings::{Culling, History, RayCulling, Samples, Settings, Shadows, TextureBinding},
};

use super::parameters::{ParameterFlags, TechniqueFlag};
use crate::choices::choice;

/// Flags of light culling, shadows and antialiasing.
#[derive(Debug, Args)]
pub struct TechniqueArgs {
    /// Shadow technique.
    ///
    /// The image is the same but for a few pixels at silhouettes; through deep images, for a texel around them.
    #[arg(long, value_name = "NAME", value_parser = choice::<Shadows>(), hide_short_help = true)]
    #[arg(default_value_t = Settings::default().shadows)]
    pub shadows: Shadows,
    /// Skips shadow rays where the surface faces away from the light.
    #[arg(long, value_name = "NAME", value_parser = choice::<RayCulling>())]
    #[arg(default_value_t = Settings::default().ray_culling, hide_short_help = true)]
    pub ray_culling: RayCulling,
    /// Rays from a pixel to each light that has a --light-radius, a --disk or a --rectangle. More: less noise, slower.
    ///
    /// To a disk or rectangle 32 at most; --accumulate adds to them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=255), allow_hyphen_values = true)]
    #[arg(default_value_t = Settings::default().shadow_rays, hide_short_help = true)]
    pub shadow_rays: u32,
    /// True if indirect light and soft shadows are mixed with those of the frames before, along surfaces.
    ///
    /// On: less noise while the view moves, and light that changes is followed late. The first image, and its mean, are the same with
    /// either. In a window: on.
    #[arg(long, value_name = "ON|OFF", value_parser = choice::<History>(), hide_short_help = true)]
    #[arg(default_value_t = Settings::default().history)]
    pub history: History,
    #[command(flatten)]
    culling: TechniqueFlag<dyn CullingTechnique>,
    #[command(flatten)]
    culling_parameters: ParameterFlags<dyn CullingTechnique>,
    /// Samples per pixel at triangle edges (MSAA).
    ///
    /// The edges are those of triangles. More: smoother edges. 4 is on every adapter. Without it: 4, where they are a small part
    /// of the frame; 1 with --quality draft, --indirect none, debug views, and in images of --accumulate 8 or more, whose edges are smooth without.
    #[arg(long, value_name = "N", value_parser = choice::<Samples>())]
    pub samples: Option<Samples>,
    /// Averages N frames: smooth edges, less noise.
    ///
    /// Each is rendered through other points of its pixels. N times as slow.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_hyphen_values = true)]
    #[arg(default_value_t = Settings::default().accumulate)]
    pub accumulate: u32,
    /// Texture binding. The image does not depend on it.
    #[arg(long, value_name = "NAME", value_parser = choice::<TextureBinding>())]
    #[arg(default_value_t = Settings::default().textures, hide_short_help = true)]
    pub textures: TextureBinding,
}

impl TechniqueArgs {
    /// How these flags want lights to be found.
    pub fn culling(&self) -> Culling {
        self.culling_parameters.turned(self.culling.0.clone())
    }
}
