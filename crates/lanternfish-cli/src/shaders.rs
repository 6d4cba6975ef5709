//! The library's shaders from a folder, in place of the built-in ones.

use std::path::Path;

use lanternfish::shaders::SHADERS;
use lanternfish_gpu::{ShaderTexts, read_shader_texts};

use crate::error::CliError;

/// Reads the shaders of the library's folder `src`, of any source tree.
pub fn read(folder: &Path) -> Result<ShaderTexts, CliError> {
    let hint = "name the library's folder `src` of a source tree";
    let texts = read_shader_texts(folder).map_err(|what| CliError::new(what, hint))?;
    if SHADERS.sources().iter().any(|(path, _)| texts.contains_key(*path)) {
        return Ok(texts);
    }
    Err(CliError::new(format_args!("{}: the folder has none of the library's files", folder.display()), hint))
}
