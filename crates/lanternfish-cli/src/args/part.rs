//! Flags that choose a part of a file.

use clap::{Args, builder::NonEmptyStringValueParser};

/// Flags that choose a scene of a file, and its materials.
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
}
