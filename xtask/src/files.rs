//! Files, with errors that name them.

use std::{
    fmt::Display,
    fs,
    path::{Path, PathBuf},
};

/// A result with the path in its error.
pub fn at<T, E: Display>(path: &Path, result: Result<T, E>) -> Result<T, String> {
    result.map_err(|error| format!("{}: {error}", path.display()))
}

pub fn read(path: &Path) -> Result<String, String> {
    at(path, fs::read_to_string(path))
}

/// Writes a file, and makes the folder that it lies in.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> Result<(), String> {
    make_folder_of(path)?;
    at(path, fs::write(path, content))
}

/// Copies a file, and makes the folder that the copy lies in.
pub fn copy(from: &Path, to: &Path) -> Result<(), String> {
    make_folder_of(to)?;
    at(from, fs::copy(from, to)).map(drop)
}

fn make_folder_of(path: &Path) -> Result<(), String> {
    at(path, fs::create_dir_all(path.parent().expect("a file lies in a folder")))
}

/// Hash (FNV-1a) of pieces of data, as if they were one.
pub fn hash<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> u64 {
    let bytes = pieces.into_iter().flatten();
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Creates an empty folder.
pub fn make_empty(folder: &Path) -> Result<(), String> {
    if folder.exists() {
        at(folder, fs::remove_dir_all(folder))?;
    }
    at(folder, fs::create_dir_all(folder))
}

/// All files below a folder, sorted; links to files count as files. Leaves out folders that are hidden or called `target`.
pub fn below(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let mut files = Vec::new();
    for entry in at(folder, fs::read_dir(folder))? {
        let entry = at(folder, entry)?;
        let (path, name) = (entry.path(), entry.file_name());
        // Packages link between folders: enter real folders only.
        if path.is_file() {
            files.push(path);
        } else if !path.is_symlink() && name != "target" && !name.to_string_lossy().starts_with('.') {
            files.extend(below(&path)?);
        }
    }
    files.sort();
    Ok(files)
}

/// The files below a folder of the workspace that have one of these endings, by their paths within it, with their texts.
#[cfg(test)]
pub fn texts(folder: &str, endings: &[&str]) -> Vec<(String, String)> {
    let root = crate::command::workspace();
    let mut paths = below(&root.join(folder)).expect("the workspace can be read");
    paths.retain(|path| path.extension().is_some_and(|ending| endings.iter().any(|other| ending == *other)));
    let name = |path: &Path| path.strip_prefix(root).expect("it lies below").display().to_string();
    paths.iter().map(|path| (name(path), read(path).expect("sources are UTF-8"))).collect()
}
