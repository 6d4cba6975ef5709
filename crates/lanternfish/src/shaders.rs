//! How shaders are declared and linked: a folder names its files with entry points and the features that each may be linked with.

use std::{collections::HashMap, sync::Arc};

use lanternfish_gpu::{
    Engine, Feature, GpuError, LinkedShader, ShaderLibrary, ShaderSource, ShaderTexts, SharedStruct,
};

/// Every `.wesl` file of this crate; a module's path is its file's.
pub static SHADERS: Package = Package(ShaderLibrary::new(include!(concat!(env!("OUT_DIR"), "/shaders.rs"))));

/// The shaders of a crate, which its folders link as they declare ([`Shaders::link`]).
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
    package: &'static Package,
    /// Its files with entry points.
    pub roots: &'static [Root],
    /// The structs of its files that the host declares too; a test compares them.
    pub structs: &'static [SharedStruct],
}

impl Shaders {
    /// Files of this crate with entry points, and the structs of the folder that the host declares too.
    pub(crate) const fn new(roots: &'static [Root], structs: &'static [SharedStruct]) -> Self {
        Self::of(&SHADERS, roots, structs)
    }

    /// The same of another crate's package.
    pub const fn of(package: &'static Package, roots: &'static [Root], structs: &'static [SharedStruct]) -> Self {
        Self { package, roots, structs }
    }

    /// Links one of the folder's files with entry points, these features on and all others off.
    ///
    /// Panics with debug assertions, so in every test, where the folder does not declare the file, or not with these features: a bug.
    pub fn link(&self, module: &str, features: &[Feature]) -> Result<Arc<LinkedShader>, GpuError> {
        debug_assert!(self.declares(module, features), "{module}: its folder does not declare {features:?}");
        self.package.0.link(module, features)
    }

    fn declares(&self, module: &str, features: &[Feature]) -> bool {
        let same = |variant: &Vec<Feature>| {
            variant.len() == features.len() && features.iter().all(|feature| variant.contains(feature))
        };
        let root = self.roots.iter().find(|root| root.module == module);
        root.is_some_and(|root| root.variants().is_none_or(|variants| variants.iter().any(same)))
    }
}

/// A file with entry points, and the features that it may be linked with.
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

    /// A file whose folder has a function that gives its features for settings.
    pub const fn by_settings(module: &'static str) -> Self {
        Self { module, variants: Variants::BySettings }
    }

    /// Every variant, where the file declares them.
    pub(crate) fn variants(&self) -> Option<Vec<Vec<Feature>>> {
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
    /// The shaders of another crate, by their paths (`"fog/find"`). They may import those of this one: `package::view::view`.
    pub const fn new(sources: &'static [ShaderSource]) -> Self {
        Self(ShaderLibrary::extending(&SHADERS.0, sources))
    }

    /// The files.
    pub const fn sources(&self) -> &'static [ShaderSource] {
        self.0.sources()
    }

    /// All files of the package, linked in any way.
    pub const fn library(&self) -> &ShaderLibrary {
        &self.0
    }
}

#[cfg(any(test, feature = "testing"))]
impl Package {
    /// What a constant of a shader is written as, without its suffix; for tests that compare it with the host's.
    ///
    /// Panics when the module declares no such constant.
    pub fn constant(&self, module: &str, name: &str) -> f64 {
        let text = self.sources().iter().find(|(path, _)| *path == module).map(|(_, text)| *text);
        let text = text.unwrap_or_else(|| panic!("no shader {module}"));
        let start = format!("const {name} = ");
        let line = text.lines().find_map(|line| line.strip_prefix(&start));
        let value =
            line.and_then(|line| line.split(';').next()).unwrap_or_else(|| panic!("{module}: no constant {name}"));
        let digits = value.trim_end_matches('u');
        let number = match digits.strip_prefix("0x") {
            Some(hexadecimal) => u32::from_str_radix(hexadecimal, 16).ok().map(f64::from),
            None => digits.parse().ok(),
        };
        number.unwrap_or_else(|| panic!("{module}: {name} = {value} is not a number"))
    }
}

/// [`Package::constant`] of the library's shaders.
#[cfg(test)]
pub(crate) fn constant(module: &str, name: &str) -> f64 {
    SHADERS.constant(module, name)
}

#[cfg(test)]
mod tests;
