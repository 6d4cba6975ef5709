//! Flags of what is shown of the light.

use clap::Args;
use lanternfish::settings::{Anisotropy, DebugView, Exposure, Materials, Settings, ToneMap};

use crate::{choices::choice, parse};

/// Flags of how radiance is shown.
#[derive(Debug, Args)]
pub struct LookArgs {
    /// Material model.
    #[arg(long, value_name = "NAME", value_parser = choice::<Materials>())]
    #[arg(default_value_t = Settings::default().materials, hide_short_help = true)]
    pub materials: Materials,
    /// Exposure in stops: 1 doubles, -1 halves; auto: as much as shows most of the image.
    ///
    /// 0 leaves the image as it is. What auto finds, from the image itself, is printed; of a track, the first image is metered,
    /// and all are shown as it is. PNG only.
    #[arg(long, value_name = "auto|EV", value_parser = parse::exposure_or_auto, allow_hyphen_values = true)]
    #[arg(default_value_t = Settings::default().exposure)]
    pub exposure: Exposure,
    /// From radiance to what a display shows.
    ///
    /// PNG only.
    #[arg(long, value_name = "NAME", value_parser = choice::<ToneMap>())]
    #[arg(default_value_t = Settings::default().tone_map)]
    pub tone_map: ToneMap,
    /// Maximum anisotropy of texture filtering. Higher: sharper textures at grazing angles, slower.
    #[arg(long, value_name = "N", value_parser = choice::<Anisotropy>())]
    #[arg(default_value_t = Settings::default().anisotropy, hide_short_help = true)]
    pub anisotropy: Anisotropy,
    /// Shows a quantity of the frame, with its colour scale below. PNG only.
    #[arg(long, value_name = "NAME", value_parser = choice::<DebugView>(), hide_short_help = true)]
    pub debug_view: Option<DebugView>,
}
