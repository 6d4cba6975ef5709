//! Flags of time: moments and sequences.

use clap::Args;

use crate::parse::{self, Frames};

/// Flags of time.
#[derive(Debug, Args)]
pub struct TrackArgs {
    /// The moment that is rendered, seconds: where the camera is on its track, and all else that moves. Without it: the first
    /// keyframe's.
    #[arg(long, value_name = "SECONDS", value_parser = parse::time, allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    pub time: Option<f32>,
    /// Renders a sequence, name.0001.png and so on: N images, from the track's first keyframe to its last; or A-B, the
    /// frames of these numbers, frame I at I / --fps seconds. A frame is the same image whichever others are requested.
    #[arg(long, value_name = "N|A-B", value_parser = parse::frames)]
    #[arg(allow_hyphen_values = true, hide_short_help = true)]
    pub frames: Option<Frames>,
    /// Frames a second of --frames A-B.
    #[arg(long, value_name = "N", value_parser = parse::fps, allow_hyphen_values = true, default_value_t = 24.0)]
    #[arg(hide_short_help = true)]
    pub fps: f32,
    /// The animation of the file that is played, by name or by number: after its end it starts again. Without it, where a time or
    /// frames are requested, the first.
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true, hide_short_help = true)]
    pub animation: Option<String>,
    /// Leaves out frames of the sequence whose files are there and whole, of the size that is requested.
    #[arg(long, hide_short_help = true)]
    pub skip_existing: bool,
}
