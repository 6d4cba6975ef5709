//! Names of scenes, and loading them.

use std::{
    ffi::{OsStr, OsString},
    fmt, fs,
    path::Path,
    sync::atomic::{AtomicBool, Ordering::Relaxed},
};

use clap::builder::{OsStringValueParser, TryMapValueParser, TypedValueParser, ValueParserFactory};
use lanternfish_scene::{LoadOptions, Scene, memory};
use serde::{Serialize, Serializer};

use crate::{args::PartArgs, error::CliError};

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

/// Sets, once and before anything is read, whether this process reads scenes from their folders only, and its memory limit,
/// bytes.
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
    if source.demo().is_none() && fs::metadata(source.path()).is_ok_and(|m| !m.is_file()) {
        return Err(CliError::new(format_args!("{source}: this is no file"), "name a .gltf, .glb or .obj file"));
    }
    let confine = CONFINES.load(Relaxed);
    let (scene, variant) = (part.scene_of_file.clone(), part.variant.clone());
    let options = LoadOptions { scene, variant, confine, ..LoadOptions::default() };
    Ok(lanternfish_scene::load_with(source.spelling(), &options)?)
}
