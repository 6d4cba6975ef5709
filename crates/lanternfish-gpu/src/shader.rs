//! Linking of WESL sources into WGSL, validation and reflection, without a GPU.

mod files;

use std::{
    cmp::Ordering,
    collections::BTreeMap,
    fmt,
    hash::{Hash, Hasher},
    sync::Arc,
};

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use wesl::{
    CompileOptions, Feature as Switch, Mangler, ModulePath, Wesl,
    syntax::{Attribute, Expression, GlobalDeclaration, LiteralExpression, PathOrigin, Spanned, TranslationUnit},
};
use wgsl_parse::SyntaxNode;

use self::files::Files;
use crate::{
    GpuError,
    edited::{self, ShaderTexts},
    engine, platform,
};

/// A choice at link time: enables an `@if`, and may also select the module that `package::chosen::…` stands for.
/// Declare features as constants next to the code that they select.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Feature {
    name: &'static str,
    chosen: Option<Chosen>,
}

/// A module that a shader imports by its purpose.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Chosen {
    purpose: &'static str,
    module: &'static str,
    package: Package,
}

/// Another package, compared by its address, which is unique because it is a static. The address of its list of files
/// is not unique, because constants may be copied.
#[derive(Clone, Copy)]
struct Package(Option<&'static ShaderLibrary>);

impl Package {
    fn address(self) -> usize {
        self.0.map_or(0, |library| std::ptr::from_ref(library).addr())
    }
}

impl PartialEq for Package {
    fn eq(&self, other: &Self) -> bool {
        self.address() == other.address()
    }
}

impl Eq for Package {}

impl PartialOrd for Package {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Package {
    fn cmp(&self, other: &Self) -> Ordering {
        self.address().cmp(&other.address())
    }
}

impl Hash for Package {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.address().hash(state);
    }
}

impl Feature {
    /// A feature that enables the `@if` of this name.
    pub const fn new(name: &'static str) -> Self {
        Self { name, chosen: None }
    }

    /// A feature that enables the `@if` of this name and makes imports from `package::chosen::PURPOSE` refer to
    /// `module` (a path, e.g. `"tiled/cell"`). `package` is the static with the module, if that is not the shader's own
    /// package.
    #[doc(hidden)]
    pub const fn choosing(
        name: &'static str,
        purpose: &'static str,
        module: &'static str,
        package: Option<&'static ShaderLibrary>,
    ) -> Self {
        Self { name, chosen: Some(Chosen { purpose, module, package: Package(package) }) }
    }

    /// True if it selects a module.
    #[doc(hidden)]
    pub const fn is_choice(self) -> bool {
        self.chosen.is_some()
    }

    /// The name of its `@if`.
    #[doc(hidden)]
    pub const fn name(self) -> &'static str {
        self.name
    }
}

impl fmt::Debug for Feature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Feature").field(&self.name).finish()
    }
}

/// One WESL file: its module path within the package (e.g. `"light_culling/tiled/assign"`), and its text.
pub type ShaderSource = (&'static str, &'static str);

/// The WESL package of a crate.
#[derive(Clone, Copy, Debug)]
pub struct ShaderLibrary {
    base: Option<&'static ShaderLibrary>,
    sources: &'static [ShaderSource],
}

/// A module with all its imports, linked to WGSL and validated.
#[derive(Debug)]
pub struct LinkedShader {
    /// The root module's path and the enabled features, e.g. `shading/forward+binding_arrays`.
    pub label: String,
    /// The linked WGSL.
    pub source: String,
    /// The parsed module.
    pub module: naga::Module,
    /// Validation results, such as the resources that each entry point uses.
    pub info: ModuleInfo,
}

impl ShaderLibrary {
    /// A package of these files.
    pub const fn new(sources: &'static [ShaderSource]) -> Self {
        Self { base: None, sources }
    }

    /// A package of these files, which may import files of `base` as if both were one package: `package::view::view`.
    pub const fn extending(base: &'static ShaderLibrary, sources: &'static [ShaderSource]) -> Self {
        Self { base: Some(base), sources }
    }

    /// The files of the package.
    pub const fn sources(&self) -> &'static [ShaderSource] {
        self.sources
    }

    /// A unique number of the library: the address of its list of files, so a library must be a static.
    pub(crate) fn number(&self) -> usize {
        self.sources.as_ptr().addr()
    }

    /// Links `module` with its imports, enables exactly these features, numbers the bindings, and validates the result.
    /// Within an [`Engine`](crate::Engine) that already holds it, returns that shader.
    pub fn link(&self, module: &str, features: &[Feature]) -> Result<Arc<LinkedShader>, GpuError> {
        let (libraries, label) =
            ([Some(self), self.base].map(|library| library.map(Self::number)), label(module, features));
        engine::linked(libraries, &label, |edited| self.link_edited(module, features, edited))
    }

    /// Like [`Self::link`], with edited texts in place of files of the package. Also fails if the host could not run
    /// the edited shader.
    pub(crate) fn link_edited(
        &self,
        module: &str,
        features: &[Feature],
        texts: &ShaderTexts,
    ) -> Result<LinkedShader, GpuError> {
        let linked = self.link_uncached(module, features, texts)?;
        if !texts.is_empty() {
            let original = self.link_uncached(module, features, &ShaderTexts::new())?;
            let fail = |what| GpuError::Shader { shader: linked.label.clone(), what };
            edited::check(&original, &linked).map_err(fail)?;
        }
        Ok(linked)
    }

    fn link_uncached(&self, module: &str, features: &[Feature], texts: &ShaderTexts) -> Result<LinkedShader, GpuError> {
        let label = label(module, features);
        let fail = |what: String| GpuError::Shader { shader: label.clone(), what };

        let packages: Vec<_> = features.iter().filter_map(|feature| feature.chosen?.package.0).collect();
        let lists = [Some(self), self.base].into_iter().flatten().chain(packages).map(|library| library.sources);
        let files = Files { lists: lists.collect(), texts, features };
        let mut linker = Wesl::new_barebones().set_custom_resolver(&files);
        linker.set_options(CompileOptions { validate: false, ..Default::default() });
        linker.set_custom_mangler(ItemFirst).use_sourcemap(false).set_missing_feature_behavior(Switch::Disable);
        linker.set_features(features.iter().map(|feature| (feature.name.to_owned(), true)));
        let root = module_path(module);
        // Again for a message with the place: a linker that keeps it parses every file itself.
        let linked = linker.compile(&root).or_else(|_| linker.use_sourcemap(true).compile(&root));
        let mut linked = linked.map_err(|e| fail(e.to_string()))?;
        put_in_order(&mut linked.syntax);
        number_bindings(&mut linked.syntax).map_err(fail)?;
        let source = linked.to_string();

        let module = naga::front::wgsl::parse_str(&source).map_err(|e| fail(e.emit_to_string(&source)))?;
        let info = Validator::new(ValidationFlags::all(), Capabilities::all())
            .validate(&module)
            .map_err(|e| fail(e.emit_to_string(&source)))?;
        Ok(LinkedShader { label, source, module, info })
    }
}

fn label(module: &str, features: &[Feature]) -> String {
    features.iter().fold(module.to_owned(), |label, feature| format!("{label}+{}", feature.name))
}

impl LinkedShader {
    /// The workgroup size of a compute entry point.
    ///
    /// # Panics
    ///
    /// If there is no such entry point, which is a bug of the caller.
    pub fn workgroup_size(&self, entry: &str) -> [u32; 3] {
        self.module.entry_points[self.entry_index(entry)].workgroup_size
    }

    /// True if a compute entry point reads the number of workgroups of its dispatch.
    pub(crate) fn uses_workgroup_count(&self, entry: &str) -> bool {
        let count = Some(naga::Binding::BuiltIn(naga::BuiltIn::NumWorkGroups));
        self.module.entry_points[self.entry_index(entry)].function.arguments.iter().any(|input| input.binding == count)
    }

    /// True if it has an entry point of this name.
    #[doc(hidden)]
    pub fn has_entry(&self, entry: &str) -> bool {
        self.module.entry_points.iter().any(|e| e.name == entry)
    }

    /// Locations that a vertex entry point reads.
    #[doc(hidden)]
    pub fn vertex_locations(&self, entry: &str) -> Vec<u32> {
        let location = |binding: &Option<naga::Binding>| match binding {
            Some(naga::Binding::Location { location, .. }) => Some(*location),
            _ => None,
        };
        let arguments = &self.module.entry_points[self.entry_index(entry)].function.arguments;
        let mut locations = Vec::new();
        for argument in arguments {
            locations.extend(location(&argument.binding));
            if let naga::TypeInner::Struct { members, .. } = &self.module.types[argument.ty].inner {
                locations.extend(members.iter().filter_map(|member| location(&member.binding)));
            }
        }
        locations
    }

    /// Index of an entry point in [`Self::module`]. Panics if there is none of this name.
    pub(crate) fn entry_index(&self, entry: &str) -> usize {
        let index = self.module.entry_points.iter().position(|e| e.name == entry);
        index.unwrap_or_else(|| panic!("{}: no entry point {entry}", self.label))
    }

    /// Creates the wgpu shader module.
    pub(crate) fn create_module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        let source = platform::source(self);
        device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(&self.label), source })
    }
}

/// Sorts declarations by file, the root's first, and keeps the order within a file. The linker visits the files of a
/// root with several entry points in random order. Without sorting, the linked text would differ from run to run, and
/// caches keyed by the text (such as the driver's) would miss.
fn put_in_order(linked: &mut TranslationUnit) {
    let file = |declaration: &Spanned<GlobalDeclaration>| {
        let name = declaration.ident().map(|ident| ident.to_string()).unwrap_or_default();
        name.split_once("__").map_or(String::new(), |(_, file)| file.to_owned())
    };
    linked.global_declarations.sort_by_cached_key(file);
    linked.global_directives.sort_by_cached_key(ToString::to_string);
}

/// Adds a `@binding` to every variable with a group: from 0 up in each group, in the order of the linked declarations.
/// Fails if a shader declares a `@binding` itself: the host binds by name, and numbers of different files might
/// collide.
fn number_bindings(linked: &mut TranslationUnit) -> Result<(), String> {
    let mut next: BTreeMap<String, i64> = BTreeMap::new();
    for declaration in &mut linked.global_declarations {
        let GlobalDeclaration::Declaration(variable) = declaration.node_mut() else { continue };
        let mut group = None;
        for attribute in &variable.attributes {
            match attribute.node() {
                Attribute::Group(number) => group = Some(number.to_string()),
                Attribute::Binding(_) => {
                    let name = variable.ident.to_string();
                    return Err(format!("{}: leave its @binding out, the linker numbers bindings", item_name(&name)));
                }
                _ => {}
            }
        }
        if let Some(group) = group {
            let number = next.entry(group).or_default();
            let written = Expression::Literal(LiteralExpression::AbstractInt(*number));
            variable.attributes.push(Attribute::Binding(written.into()).into());
            *number += 1;
        }
    }
    Ok(())
}

/// An item's name in its own file, from its linked name.
pub(crate) fn item_name(linked_name: &str) -> &str {
    linked_name.split("__").next().unwrap_or(linked_name)
}

/// Mangles `common/math`'s `PI` to `PI__common_math`, so that the item's own name can be read back.
struct ItemFirst;

impl Mangler for ItemFirst {
    fn mangle(&self, path: &ModulePath, item: &str) -> String {
        format!("{item}__{}", path.components.join("_"))
    }
}

fn module_path(path: &str) -> ModulePath {
    ModulePath { origin: PathOrigin::Absolute, components: path.split('/').map(str::to_owned).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    static LIBRARY: ShaderLibrary = ShaderLibrary::new(&[
        ("common/math", "const PI = 3.14159;\nfn unused() -> f32 { return 1.0; }"),
        (
            "technique/kernel",
            "import package::common::math::PI;\n@group(2) var<storage, read_write> out: array<f32>;\n\
             @if(double) const SCALE = 2.0;\n@else const SCALE = 1.0;\nconst SIZE = 64u;\n\
             @compute @workgroup_size(SIZE) fn main() { out[0] = SCALE * PI; }",
        ),
        (
            "common/lists",
            "@group(2) var<storage, read> lists: array<u32>;\n@group(1) var<storage, read> lights: array<u32>;",
        ),
        (
            "technique/bound",
            "import package::common::lists::{lists, lights};\n@group(2) var<storage, read_write> out: array<u32>;\n\
             @compute @workgroup_size(1) fn main() { out[0] = lists[0] + lights[0]; }",
        ),
        (
            "technique/numbered",
            "@group(2) @binding(0) var<storage, read_write> out: array<u32>;\n\
             @compute @workgroup_size(1) fn main() { out[0] = 1u; }",
        ),
        ("tools/hand", "fn by_hand() -> f32 { return 1.0; }"),
        ("tools/other", "fn other() -> f32 { return 2.0; }"),
        (
            "technique/both",
            "import package::tools::hand::by_hand;\nimport package::tools::other::other;\n\
             @group(2) var<storage, read_write> out: array<f32>;\n\
             @compute @workgroup_size(1) fn one() { out[0] = by_hand(); }\n\
             @compute @workgroup_size(1) fn two() { out[0] = other(); }",
        ),
        (
            "technique/choosing",
            "import package::chosen::scale as chosen;\n@group(2) var<storage, read_write> out: array<f32>;\n\
                         @compute @workgroup_size(1) fn main() { out[0] = chosen::scale(); }",
        ),
        ("scales/one", "fn scale() -> f32 { return 1.0; }"),
        ("technique/broken", "@compute @workgroup_size(1) fn main() { let x: u32 = 1.0; }"),
    ]);

    #[test]
    fn imports_features_and_stripping() {
        let plain = LIBRARY.link("technique/kernel", &[]).unwrap();
        let double = LIBRARY.link("technique/kernel", &[Feature::new("double")]).unwrap();
        assert!(plain.source.contains("SCALE = 1.0") && double.source.contains("SCALE = 2.0"));
        assert!(!plain.source.contains("unused"));
        assert_eq!(plain.workgroup_size("main"), [64, 1, 1]);
        assert_eq!(double.label, "technique/kernel+double");
    }

    #[test]
    fn bindings_are_numbered_in_each_group_over_all_files() {
        let linked = LIBRARY.link("technique/bound", &[]).unwrap();
        let mut numbers: Vec<_> = linked.module.global_variables.iter().filter_map(|(_, v)| v.binding).collect();
        numbers.sort_by_key(|b| (b.group, b.binding));
        let numbers: Vec<_> = numbers.iter().map(|b| (b.group, b.binding)).collect();
        assert_eq!(numbers, [(1, 0), (2, 0), (2, 1)], "{}", linked.source);
    }

    /// The module may be of another package, which may import from this one.
    #[test]
    fn a_feature_selects_a_module() {
        const OTHER: &[ShaderSource] =
            &[("other/pi", "import package::common::math::PI;\nfn scale() -> f32 { return PI; }")];
        static EXTENDED: ShaderLibrary = ShaderLibrary::extending(&LIBRARY, OTHER);
        let of_base = EXTENDED.link("technique/bound", &[]).unwrap();
        assert_eq!(
            of_base.source,
            LIBRARY.link("technique/bound", &[]).unwrap().source,
            "a package contains the files of its base"
        );
        let own = Feature::choosing("one", "scale", "scales/one", None);
        let other = Feature::choosing("pi", "scale", "other/pi", Some(&EXTENDED));
        let [own, other] = [own, other].map(|feature| LIBRARY.link("technique/choosing", &[feature]).unwrap());
        assert!(own.source.contains("return 1.0") && !own.source.contains("PI"), "{}", own.source);
        assert!(other.source.contains("return PI") && other.source.contains("3.14159"), "{}", other.source);
        let error = LIBRARY.link("technique/choosing", &[]).unwrap_err().to_string();
        assert!(error.contains("chosen"), "{error}");
    }

    #[test]
    fn the_linked_text_is_the_same_each_time() {
        let link = || LIBRARY.link("technique/both", &[]).unwrap().source.clone();
        let first = link();
        assert!(first.find("fn by_hand").unwrap() < first.find("fn other").unwrap(), "{first}");
        assert!((0..32).all(|_| link() == first), "the order of declarations differs");
    }

    #[test]
    fn an_explicit_binding_number_is_refused() {
        let error = LIBRARY.link("technique/numbered", &[]).unwrap_err().to_string();
        assert!(error.contains("out") && error.contains("linker"), "{error}");
    }

    #[test]
    fn a_validation_error_names_the_shader() {
        let error = LIBRARY.link("technique/broken", &[]).unwrap_err().to_string();
        assert!(error.contains("technique/broken") && error.contains("u32"), "{error}");
        assert!(LIBRARY.link("technique/missing", &[]).is_err());
    }
}
