//! The library's shaders, and every variant of them that a room can ask for.

use std::{collections::HashMap, sync::Arc};

use lanternfish_gpu::{
    Engine, Feature, GpuError, LinkedShader, ShaderLibrary, ShaderSource, ShaderTexts, SharedStruct,
};

use crate::{indirect::Indirect, light_culling::Culling, occlusion::Occlusion};

/// Every `.wesl` file of this crate; a module's path is its file's.
pub static SHADERS: Package = Package(ShaderLibrary::new(include!(concat!(env!("OUT_DIR"), "/shaders.rs"))));

/// Shaders that are linked as their folders declare, and in no other way.
#[derive(Clone, Copy, Debug)]
pub struct Package(ShaderLibrary);

/// Puts texts in the place of the library's own shaders, by module path below its `src/`: renderers of the engine that are built from now
/// on run them. Texts that are the library's own, and those of files that it does not have, are left out. Gives what stood there before.
pub fn edit(engine: &Engine, mut texts: ShaderTexts) -> Arc<ShaderTexts> {
    let own: HashMap<_, _> = SHADERS.sources().iter().copied().collect();
    texts.retain(|path, text| own.get(path.as_str()).is_some_and(|own| own != text));
    engine.edit(SHADERS.library(), texts)
}

/// What a folder declares of its shaders.
#[derive(Clone, Copy, Debug)]
pub struct Shaders {
    /// Its files with entry points.
    pub roots: &'static [Root],
    /// The structs of its files that the host declares too; a test compares them.
    pub structs: &'static [SharedStruct],
}

/// A file with entry points, and the features that a room may link it with.
#[derive(Clone, Copy, Debug)]
pub struct Root {
    /// Its path below `src/`, without an ending.
    pub module: &'static str,
    variants: Variants,
}

/// The features that a file may be linked with.
#[derive(Clone, Copy, Debug)]
enum Variants {
    /// One choice of each list: the features of that choice.
    Chosen(&'static [&'static [&'static [Feature]]]),
    /// Those that a function lists.
    Computed(fn() -> Vec<Vec<Feature>>),
    /// Those that a function of the settings gives; a test asks it under all of them.
    BySettings,
}

/// Every folder with shaders.
const FOLDERS: &[&[Shaders]] = &[
    &[
        crate::view::DECLARED,
        crate::gpu_scene::DECLARED,
        crate::gpu_scene::moving::DECLARED,
        crate::lights::DECLARED,
        crate::prepass::DECLARED,
        crate::light_culling::DECLARED,
        crate::deep_images::DECLARED,
        crate::indirect::radiance_cache::DECLARED,
        crate::rays::DECLARED,
        crate::environment_light::DECLARED,
        crate::indirect::light_views::DECLARED,
        crate::indirect::smoothing::DECLARED,
        crate::indirect::history::DECLARED,
        crate::occlusion::DECLARED,
        crate::shadows::DECLARED,
        crate::shading::DECLARED,
        crate::sky::DECLARED,
        crate::progressive::DECLARED,
        crate::output::DECLARED,
        crate::debug_views::DECLARED,
    ],
    Culling::SHADERS,
    Indirect::SHADERS,
    Occlusion::SHADERS,
];

fn folders() -> impl Iterator<Item = &'static Shaders> {
    FOLDERS.iter().copied().flatten()
}

/// Every file with entry points.
fn roots() -> impl Iterator<Item = &'static Root> {
    folders().flat_map(|folder| folder.roots)
}

/// Whether a folder declares the file, and these features for it.
fn is_declared(module: &str, features: &[Feature]) -> bool {
    let same = |variant: &Vec<Feature>| {
        variant.len() == features.len() && features.iter().all(|feature| variant.contains(feature))
    };
    let root = roots().find(|root| root.module == module);
    root.is_some_and(|root| root.variants().is_none_or(|variants| variants.iter().any(same)))
}

impl Root {
    /// A file that is linked in one way.
    pub const fn new(module: &'static str) -> Self {
        Self::of(module, &[])
    }

    /// A file that is linked with one choice of each list: the features of that choice.
    pub const fn of(module: &'static str, choices: &'static [&'static [&'static [Feature]]]) -> Self {
        Self { module, variants: Variants::Chosen(choices) }
    }

    /// A file that is linked with one of the lists of features that a function gives.
    pub const fn computed(module: &'static str, variants: fn() -> Vec<Vec<Feature>>) -> Self {
        Self { module, variants: Variants::Computed(variants) }
    }

    /// A file whose room has a function that gives its features for settings.
    pub const fn by_settings(module: &'static str) -> Self {
        Self { module, variants: Variants::BySettings }
    }

    /// Every variant, where the file declares them.
    fn variants(&self) -> Option<Vec<Vec<Feature>>> {
        let lists = match self.variants {
            Variants::Chosen(lists) => lists,
            Variants::Computed(variants) => return Some(variants()),
            Variants::BySettings => return None,
        };
        Some(lists.iter().fold(vec![Vec::new()], |variants, choices| {
            let extended = |variant: &Vec<Feature>, choice: &[Feature]| [variant, choice].concat();
            variants.iter().flat_map(|v| choices.iter().map(move |choice| extended(v, choice))).collect()
        }))
    }
}

impl Package {
    /// The files.
    pub fn sources(&self) -> &'static [ShaderSource] {
        self.0.sources()
    }

    /// All files of the package, linked in any way.
    pub fn library(&self) -> &ShaderLibrary {
        &self.0
    }

    /// Links a file with entry points, these features on and all others off.
    ///
    /// Panics with debug assertions, so in every test, where no folder declares the file, or its folder does not declare these features
    /// for it: a bug.
    pub fn link(&self, module: &str, features: &[Feature]) -> Result<Arc<LinkedShader>, GpuError> {
        debug_assert!(is_declared(module, features), "{module}: its folder does not declare {features:?}");
        self.0.link(module, features)
    }
}

/// What a constant of a shader is written as, without its suffix; for tests that compare it with the host's.
///
/// Panics when the module declares no such constant.
#[cfg(test)]
pub(crate) fn constant(module: &str, name: &str) -> f64 {
    let text = SHADERS.sources().iter().find(|(path, _)| *path == module).map(|(_, text)| *text);
    let text = text.unwrap_or_else(|| panic!("no shader {module}"));
    let start = format!("const {name} = ");
    let line = text.lines().find_map(|line| line.strip_prefix(&start));
    let value = line.and_then(|line| line.split(';').next()).unwrap_or_else(|| panic!("{module}: no constant {name}"));
    let digits = value.trim_end_matches('u');
    let number = match digits.strip_prefix("0x") {
        Some(hexadecimal) => u32::from_str_radix(hexadecimal, 16).ok().map(f64::from),
        None => digits.parse().ok(),
    };
    number.unwrap_or_else(|| panic!("{module}: {name} = {value} is not a number"))
}

#[cfg(test)]
mod tests;
