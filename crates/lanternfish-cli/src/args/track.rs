//! Flags of time: moments and sequences.

use clap::Args;

use crate::parse::{self, Frames};

/// Flags of time.
#[derive(Debug, Args)]
pub struct TrackArgs {
    /// Time of the image, seconds: camera track and animations. Default: the first keyframe.
    #[arg(long, value_name = "SECONDS", value_parser = parse::time, allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    pub time: Option<f32>,
    /// Renders a sequence, name.0001.png and so on: N images, from the track's first keyframe to its last; or A-B, the
    /// frames of these numbers, frame I at I / --fps seconds. A frame does not depend on the others requested.
    #[arg(long, value_name = "N|A-B", value_parser = parse::frames)]
    #[arg(allow_hyphen_values = true, hide_short_help = true)]
    pub frames: Option<Frames>,
    /// Frames a second of --frames A-B.
    #[arg(long, value_name = "N", value_parser = parse::fps, allow_hyphen_values = true, default_value_t = 24.0)]
    #[arg(hide_short_help = true)]
    pub fps: f32,
    /// Animation of the file, by name or number; it repeats. Default, if a time or frames are requested: the first.
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true, hide_short_help = true)]
    pub animation: Option<String>,
    /// Skips frames whose files exist, are complete and have the requested size.
    #[arg(long, hide_short_help = true)]
    pub skip_existing: bool,
}
