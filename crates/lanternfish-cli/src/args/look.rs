//! Flags of how radiance is displayed.

use clap::Args;
use lanternfish::settings::{Anisotropy, DebugView, Exposure, Materials, Settings, ToneMap};

use crate::{choices::choice, parse};

/// Flags of how radiance is displayed.
#[derive(Debug, Args)]
pub struct LookArgs {
    /// Material model.
    #[arg(long, value_name = "NAME", value_parser = choice::<Materials>())]
    #[arg(default_value_t = Settings::default().materials.model, hide_short_help = true)]
    pub materials: Materials,
    /// Exposure in stops: 1 doubles, -1 halves; auto: metered to show most of the image.
    ///
    /// 0 leaves the image as it is. auto meters the image and prints the value; of a sequence, it meters the first frame and
    /// applies the value to all. PNG only.
    #[arg(long, value_name = "auto|EV", value_parser = parse::exposure_or_auto, allow_hyphen_values = true)]
    #[arg(default_value_t = Settings::default().image.exposure)]
    pub exposure: Exposure,
    /// Tone map, from radiance to display.
    ///
    /// PNG only.
    #[arg(long, value_name = "NAME", value_parser = choice::<ToneMap>())]
    #[arg(default_value_t = Settings::default().image.tone_map)]
    pub tone_map: ToneMap,
    /// Anisotropic texture filtering: most samples along the long axis of a pixel's footprint. More: sharper at grazing angles,
    /// slower.
    #[arg(long, value_name = "N", value_parser = choice::<Anisotropy>())]
    #[arg(default_value_t = Settings::default().materials.anisotropy, hide_short_help = true)]
    pub anisotropy: Anisotropy,
    /// Shows a quantity of the frame instead of the image, with its colour scale below. PNG only.
    #[arg(long, value_name = "NAME", value_parser = choice::<DebugView>(), hide_short_help = true)]
    pub debug_view: Option<DebugView>,
}
