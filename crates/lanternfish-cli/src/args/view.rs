//! Flags of `view`: those of `render`, and its own.

use std::path::PathBuf;

use clap::{ArgMatches, Args, FromArgMatches};

use super::{RenderArgs, ShotArgs};

/// The scene that `view` shows if none is named.
const FIRST: &str = "demo:atrium";

/// The flags of `render`, with an optional scene, and the flags of the window.
#[derive(Debug)]
pub struct WindowArgs {
    /// The flags of `render`.
    pub render: RenderArgs,
    /// The flags of `view` alone.
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

impl Args for WindowArgs {
    fn augment_args(command: clap::Command) -> clap::Command {
        let command = OnlyWindowArgs::augment_args(ShotArgs::augment_args(command));
        command.mut_arg("scene", |scene| scene.required(false).default_value(FIRST))
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for WindowArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let (render, window) = (RenderArgs::from_arg_matches(matches)?, OnlyWindowArgs::from_arg_matches(matches)?);
        Ok(Self { render, window })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.render.update_from_arg_matches(matches)?;
        self.window.update_from_arg_matches(matches)
    }
}
