//! Flags that choose a part of a file.

use clap::{Args, builder::NonEmptyStringValueParser};
use lanternfish_scene::UpAxis;

use crate::choices::choice;

/// Flags that choose a scene of a file, its materials, and how it stands.
#[derive(Debug, Default, Args)]
pub struct PartArgs {
    /// A scene of the file, by name or index. Without it: the file's default scene.
    #[arg(long = "scene", value_name = "NAME|INDEX", value_parser = NonEmptyStringValueParser::new())]
    #[arg(allow_hyphen_values = true, hide_short_help = true)]
    pub scene_of_file: Option<String>,
    /// A variant of the file's materials, by name or index. Without it: the file's default materials.
    ///
    /// `lanternfish info` lists them (KHR_materials_variants).
    #[arg(long, value_name = "NAME|INDEX", value_parser = NonEmptyStringValueParser::new())]
    #[arg(allow_hyphen_values = true, hide_short_help = true)]
    pub variant: Option<String>,
    /// The axis of the file that points up. Without it: y.
    ///
    /// A file that lies on its back was made with z up. Built-in scenes stand as they are.
    #[arg(long, value_name = "AXIS", value_parser = choice::<UpAxis>(), hide_short_help = true)]
    pub up: Option<UpAxis>,
}
