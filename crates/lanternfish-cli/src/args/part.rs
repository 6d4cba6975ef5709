//! Flags of what is taken from a scene file.

use lanternfish_scene::UpAxis;

use super::{flags::flags, spelling::Text};

flags! {
    /// Flags that choose a scene of a file, its materials, and how it stands.
    #[derive(Default)]
    pub struct PartArgs {
        /// A scene of the file, by name or index. Without it: the file's default scene.
        #[arg(long = "scene", value_name = "NAME|INDEX", allow_hyphen_values = true, hide_short_help = true)]
        scene_of_file: Option<String> as Text,
        /// A variant of the file's materials, by name or index. Without it: the file's default materials.
        ///
        /// `lanternfish info` lists them (KHR_materials_variants).
        #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true, hide_short_help = true)]
        variant: Option<String> as Text,
        /// The axis of the file that points up. Without it: y.
        ///
        /// A file that lies on its back was made with z up. Built-in scenes stand as they are.
        #[arg(long, value_name = "AXIS", hide_short_help = true)]
        up: Option<UpAxis> as UpAxis,
    }
}
