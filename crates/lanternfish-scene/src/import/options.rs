//! Options for importing a scene file.

use glam::{Affine3A, Mat3, Vec3};
use lanternfish_limits::memory::Budget;

use crate::named_enum;

named_enum! {
    /// The axis of a file that points up.
    #[derive(Default)]
    UpAxis {
        /// As glTF has it, and most OBJ files.
        #[default]
        Y = "y": "As glTF has it, and most OBJ files",
        /// As CAD and map data have it: the file's +y becomes −z.
        Z = "z": "As CAD and map data have it; +y points away from the front",
    }
}

impl UpAxis {
    /// The rotation from the file's axes to those of the scene, whose +y is up.
    pub(crate) fn world_from_file(self) -> Affine3A {
        match self {
            Self::Y => Affine3A::IDENTITY,
            Self::Z => Affine3A::from_mat3(Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y)),
        }
    }
}

/// Options of [`crate::load_with`]. The default reads the file's default scene with its default materials, follows every path in the file, and may use
/// the memory limit of the process.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Name of the scene to read, else its index in decimal; `None`: the default scene.
    pub scene: Option<String>,
    /// Name of the variant of the materials (`KHR_materials_variants`), else its index in decimal; `None`: the default
    /// materials.
    pub variant: Option<String>,
    /// The axis that points up in the file. Not of built-in scenes.
    pub up: UpAxis,
    /// True if only files in the scene's folder and its subfolders are read. The check uses the resolved path:
    /// `..`, percent-encoding and symbolic links cannot leave the folder, and a scene that is itself a link to elsewhere is refused.
    ///
    /// For files from untrusted sources: otherwise a scene can name any file that the process can read, as a buffer or a texture.
    /// A path out of the folder is an error in a glTF file. In an OBJ file it is a warning, as a missing file is.
    pub confine: bool,
    /// Memory limit of the import, bytes; `None`: [the limit of the process](lanternfish_limits::memory::set_limit); without
    /// either, in proportion to the size of the files, 2 GiB at least.
    /// The need is estimated from headers before anything is allocated.
    pub memory_limit: Option<u64>,
}

impl LoadOptions {
    /// The memory budget of the import.
    pub(crate) fn budget(&self) -> Budget {
        self.memory_limit.map_or_else(Budget::of_file, Budget::of)
    }
}
