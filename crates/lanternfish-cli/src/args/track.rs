//! Flags of time: single frames and sequences.

use clap::Args;

use crate::parse::{self, Frames};

/// Flags of time.
#[derive(Debug, Args)]
pub struct TrackArgs {
    /// Time of the frame, seconds: position on the camera track, and time of everything else that moves. Without it: the first
    /// keyframe.
    #[arg(long, value_name = "SECONDS", value_parser = parse::time, allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    pub time: Option<f32>,
    /// Renders a sequence, name.0001.png and so on. N: N frames, from the track's first keyframe to its last. A-B: the frames
    /// of these numbers, frame I at I / --fps seconds. A frame does not depend on which others are requested.
    #[arg(long, value_name = "N|A-B", value_parser = parse::frames)]
    #[arg(allow_hyphen_values = true, hide_short_help = true)]
    pub frames: Option<Frames>,
    /// Renders a turntable: N frames, 360 / N degrees apart, once round the scene. The camera revolves about a vertical axis,
    /// counter-clockwise seen from above, and frame 1 is the image without this flag. The axis goes through --target, else through
    /// the middle of the scene, or in a closed interior through the camera. The lights of --light-rig revolve with the camera, all
    /// others stay. --frames A-B renders some of the frames. Frame I is at (I - 1) / --fps seconds; --time holds the scene still.
    #[arg(long, value_name = "N", value_parser = parse::orbit, allow_hyphen_values = true, hide_short_help = true)]
    pub orbit: Option<u32>,
    /// Frames per second of --frames A-B and --orbit.
    #[arg(long, value_name = "N", value_parser = parse::fps, allow_hyphen_values = true, default_value_t = 24.0)]
    #[arg(hide_short_help = true)]
    pub fps: f32,
    /// The animation of the file to play, by name or index. It loops. Without it: the first, if a time or frames are requested.
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true, hide_short_help = true)]
    pub animation: Option<String>,
    /// Skips frames whose files exist, are complete and have the requested size.
    #[arg(long, hide_short_help = true)]
    pub skip_existing: bool,
}

impl TrackArgs {
    /// True if numbered images are requested.
    pub fn is_sequence(&self) -> bool {
        self.frames.is_some() || self.orbit.is_some()
    }
}
