//! Declaration and linking of shaders: each folder declares its files with entry points and the feature sets of each file.

use std::{collections::HashMap, sync::Arc};

use lanternfish_gpu::{
    Engine, Feature, GpuError, LinkedShader, ShaderLibrary, ShaderSource, ShaderTexts, SharedStruct,
};

/// Every `.wesl` file of this crate; the path of a module is the path of its file.
pub static SHADERS: Package = Package(ShaderLibrary::new(include!(concat!(env!("OUT_DIR"), "/shaders.rs"))));

/// The shaders of a crate. Its folders declare and link them ([`Shaders::link`]).
#[derive(Clone, Copy, Debug)]
pub struct Package(ShaderLibrary);

/// Replaces texts of the library's own shaders, by module path below its `src/`, for all renderers that the engine builds afterwards.
/// Unchanged texts and texts of unknown files are ignored. Returns the previous replacements.
pub fn edit(engine: &Engine, mut texts: ShaderTexts) -> Arc<ShaderTexts> {
    let own: HashMap<_, _> = SHADERS.sources().iter().copied().collect();
    texts.retain(|path, text| own.get(path.as_str()).is_some_and(|own| own != text));
    engine.edit(SHADERS.library(), texts)
}

/// The shader declarations of a folder.
#[derive(Clone, Copy, Debug)]
pub struct Shaders {
    package: &'static Package,
    /// The folder's files with entry points.
    pub roots: &'static [Root],
    /// The structs that the host declares too; a test compares the layouts.
    pub structs: &'static [SharedStruct],
}

impl Shaders {
    /// Declares files of this crate with entry points, and the structs that the host declares too.
    pub(crate) const fn new(roots: &'static [Root], structs: &'static [SharedStruct]) -> Self {
        Self::of(&SHADERS, roots, structs)
    }

    /// Declares shaders of another crate's package.
    pub const fn of(package: &'static Package, roots: &'static [Root], structs: &'static [SharedStruct]) -> Self {
        Self { package, roots, structs }
    }

    /// Links a file with entry points with these features on and all others off.
    ///
    /// Panics with debug assertions, so in every test, if the folder does not declare the file with these features: a bug.
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

/// A file with entry points and its valid feature sets.
#[derive(Clone, Copy, Debug)]
pub struct Root {
    /// The path below `src/`, without extension.
    pub module: &'static str,
    variants: Variants,
}

/// The valid feature sets of a file.
#[derive(Clone, Copy, Debug)]
enum Variants {
    /// The Cartesian product of these lists: a feature set joins one choice from each list.
    Chosen(&'static [&'static [&'static [Feature]]]),
    /// The feature sets that a function returns.
    Computed(fn() -> Vec<Vec<Feature>>),
    /// The feature sets that a function of the settings returns; a test covers all settings.
    BySettings,
}

impl Root {
    /// A file with one variant.
    pub const fn new(module: &'static str) -> Self {
        Self::of(module, &[])
    }

    /// A file with the Cartesian product of these choices as its variants.
    pub const fn of(module: &'static str, choices: &'static [&'static [&'static [Feature]]]) -> Self {
        Self { module, variants: Variants::Chosen(choices) }
    }

    /// A file with the feature sets that a function returns.
    #[doc(hidden)]
    pub const fn computed(module: &'static str, variants: fn() -> Vec<Vec<Feature>>) -> Self {
        Self { module, variants: Variants::Computed(variants) }
    }

    /// A file whose folder computes its feature set from the settings.
    #[doc(hidden)]
    pub const fn by_settings(module: &'static str) -> Self {
        Self { module, variants: Variants::BySettings }
    }

    /// Every variant, if the file declares them.
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
    /// The shaders of another crate, by path (`"fog/find"`). They may import modules of this crate: `package::view::view`.
    pub const fn new(sources: &'static [ShaderSource]) -> Self {
        Self(ShaderLibrary::extending(&SHADERS.0, sources))
    }

    /// The shader files.
    #[doc(hidden)]
    pub const fn sources(&self) -> &'static [ShaderSource] {
        self.0.sources()
    }

    /// The linker's library of all files of the package.
    #[doc(hidden)]
    pub const fn library(&self) -> &ShaderLibrary {
        &self.0
    }
}

#[cfg(any(test, feature = "testing"))]
impl Package {
    /// The value of a shader constant without its suffix, for tests that compare it with the host's.
    ///
    /// Panics if the module declares no such constant.
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

/// [`Package::constant`] for the library's shaders.
#[cfg(test)]
pub(crate) fn constant(module: &str, name: &str) -> f64 {
    SHADERS.constant(module, name)
}

#[cfg(test)]
mod tests;
