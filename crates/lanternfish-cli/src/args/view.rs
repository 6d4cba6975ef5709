//! Flags of `view`: those of `render`, and its own.

use std::path::PathBuf;

use clap::Args;

use super::RenderArgs;

/// The scene that `view` shows if none is named.
pub(crate) const FIRST: &str = "demo:atrium";

/// The flags of `render`, and the flags of the window.
#[derive(Debug, Args)]
pub struct WindowArgs {
    /// The flags of `render`.
    #[command(flatten)]
    pub render: RenderArgs,
    /// The flags of `view` alone.
    #[command(flatten, next_help_heading = "Window")]
    pub window: OnlyWindowArgs,
}

/// Flags of `view` alone.
#[derive(Debug, Args)]
pub struct OnlyWindowArgs {
    /// Records the camera step by step, for `render` and `replay`. The file is written when the window is closed.
    #[arg(long, value_name = "TRACK.toml")]
    pub record: Option<PathBuf>,
    /// Renders with the shaders in this folder, the library's `src`, and reloads them when they are saved. A shader
    /// that does not compile only changes the status line below the image.
    #[arg(long, value_name = "FOLDER")]
    pub shaders: Option<PathBuf>,
}
