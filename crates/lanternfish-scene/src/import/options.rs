//! Options of reading a scene file.

use lanternfish_limits::memory::Budget;

/// How [`crate::load_with`] reads a file. The default reads its default scene, follows every path that it names, and takes what
/// memory the process may.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Which of the file's scenes: that of this name, else that of the index that it spells; `None`: the default scene.
    pub scene: Option<String>,
    /// Whether only files of the scene's folder, and of folders in it, are read. It holds for where a path leads in the end:
    /// `..`, percent-encoding and symbolic links do not get out, and a scene that is itself a link to elsewhere is refused.
    ///
    /// For files from strangers: without it a scene can name any file that the process can read, as a buffer or a texture.
    /// What leads out is an error of glTF files, and of OBJ files a warning, as a missing file is.
    pub confine: bool,
    /// Most memory that the import may need, bytes; `None`: [what the process may use](lanternfish_limits::memory::set_limit).
    /// It is counted from headers before anything is allocated.
    pub memory_limit: Option<u64>,
}

impl LoadOptions {
    /// What an import may take.
    pub(crate) fn budget(&self) -> Budget {
        self.memory_limit.map_or_else(Budget::of_process, Budget::of)
    }
}
