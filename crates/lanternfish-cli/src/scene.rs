//! Names of scenes, and loading them.

use std::{
    ffi::{OsStr, OsString},
    fmt, fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering::Relaxed},
};

use clap::builder::{OsStringValueParser, TryMapValueParser, TypedValueParser, ValueParserFactory};
use lanternfish_scene::{LoadOptions, Scene, memory};
use serde::{Serialize, Serializer};

use crate::{args::part::PartArgs, ending::has_ending, error::CliError};

/// The name of a scene: a path, in any spelling that the system supports, or `demo:NAME`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneName(OsString);

impl SceneName {
    /// The name of a built-in scene.
    pub fn demo(&self) -> Option<&str> {
        self.0.to_str()?.strip_prefix("demo:")
    }

    /// The name as a path; valid if [`Self::demo`] returns `None`.
    pub fn path(&self) -> &Path {
        Path::new(&self.0)
    }

    /// The path, if it names an image.
    pub fn image(&self) -> Option<&Path> {
        let is_image = |path: &&Path| has_ending(path, "png") || has_ending(path, "exr");
        Some(self.path()).filter(|path| self.demo().is_none() && is_image(path))
    }

    /// The name for files that others get: without the folders of a path.
    pub fn public_name(&self) -> String {
        match (self.demo(), self.path().file_name()) {
            (None, Some(name)) => name.to_string_lossy().into_owned(),
            _ => self.to_string(),
        }
    }

    /// The original spelling.
    pub fn spelling(&self) -> &OsStr {
        &self.0
    }
}

impl<T: Into<OsString>> From<T> for SceneName {
    fn from(name: T) -> Self {
        Self(name.into())
    }
}

#[cfg(test)]
#[test]
fn public_names_have_no_folders() {
    let public = |name: &str| SceneName::from(name).public_name();
    assert_eq!((public("/home/me/a b.glb"), public("demo:atrium")), ("a b.glb".into(), "demo:atrium".into()));
}

/// For people: invalid UTF-8 is replaced.
impl fmt::Display for SceneName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.display().fmt(f)
    }
}

impl Serialize for SceneName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Parses a word of the command line.
type Read = fn(OsString) -> Result<SceneName, &'static str>;

impl ValueParserFactory for SceneName {
    type Parser = TryMapValueParser<OsStringValueParser, Read>;

    fn value_parser() -> Self::Parser {
        let read: Read = |name| match name.is_empty() {
            true => Err("expected a scene: a file, or demo:NAME"),
            false => Ok(Self(name)),
        };
        OsStringValueParser::new().try_map(read)
    }
}

/// True if scenes may only be read from their own folders, as set on the command line.
static CONFINES: AtomicBool = AtomicBool::new(false);

/// Sets, once and before anything is read, whether this process reads scenes from their folders only, and its memory
/// limit, bytes.
pub(crate) fn trust(confine: bool, memory_limit: Option<u64>) {
    CONFINES.store(confine, Relaxed);
    if let Some(bytes) = memory_limit {
        memory::set_limit(bytes);
    }
}

/// Reads a scene of a file, with the materials of a variant, or generates a built-in one.
///
/// Devices and pipes are refused: they may be endless, and reading them may never return.
pub fn load_part(source: &SceneName, part: &PartArgs) -> Result<Scene, CliError> {
    if source.demo().is_none()
        && let Ok(metadata) = fs::metadata(source.path())
        && !metadata.is_file()
    {
        let what = if metadata.is_dir() { "this is a folder" } else { "this is no file" };
        return Err(CliError::new(format_args!("{source}: {what}"), files_hint(source.path())));
    }
    let confine = CONFINES.load(Relaxed);
    let (scene, variant) = (part.scene_of_file.clone(), part.variant.clone());
    let up = part.up.unwrap_or_default();
    let options = LoadOptions { scene, variant, up, confine, ..LoadOptions::default() };
    Ok(lanternfish_scene::load_with(source.spelling(), &options)?)
}

/// A hint in place of a folder: the scenes in it, if there are a few.
fn files_hint(folder: &Path) -> String {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_scene = |path: &PathBuf| ["gltf", "glb", "obj"].iter().any(|ending| has_ending(path, ending));
    let mut scenes: Vec<_> = entries.filter(is_scene).take(FEW + 1).map(|path| path.display().to_string()).collect();
    scenes.sort();
    match scenes.len() {
        1..=FEW => format!("it holds {}", scenes.join(", ")),
        _ => "name a .gltf, .glb or .obj file".to_owned(),
    }
}

/// Most scenes of a folder that a hint lists.
const FEW: usize = 5;

#[cfg(test)]
#[test]
fn a_folder_is_refused_with_the_scenes_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let error = || {
        let part = PartArgs::default();
        load_part(&SceneName::from(folder.path()), &part).unwrap_err().to_string()
    };
    assert!(error().contains("this is a folder") && error().contains("name a .gltf, .glb or .obj file"), "{}", error());
    for name in ["b.GLB", "a.gltf", "a.bin"] {
        fs::write(folder.path().join(name), "").unwrap();
    }
    let both = ["a.gltf", "b.GLB"].map(|name| folder.path().join(name).display().to_string()).join(", ");
    assert!(error().ends_with(&format!("it holds {both}")), "{}", error());
}
