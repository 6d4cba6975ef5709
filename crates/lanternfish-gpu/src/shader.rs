//! WESL sources: linked into WGSL, validated and reflected without a GPU.

use std::{
    borrow::Cow,
    cmp::Ordering,
    collections::BTreeMap,
    fmt,
    hash::{Hash, Hasher},
    sync::Arc,
};

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use wesl::{
    CompileOptions, Feature as Switch, Mangler, ModulePath, VirtualResolver, Wesl,
    syntax::{Attribute, Expression, GlobalDeclaration, LiteralExpression, PathOrigin, Spanned, TranslationUnit},
};
use wgsl_parse::SyntaxNode;

use crate::{
    GpuError,
    edited::{self, ShaderTexts},
    engine,
};

/// A choice that a shader makes when it is linked: the name of an `@if`, or a module in the place of a `package::chosen::…`. A constant
/// where what it means is declared.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Feature {
    name: &'static str,
    chosen: Option<Chosen>,
}

/// A module that a shader imports by the name of what it is for.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Chosen {
    purpose: &'static str,
    module: &'static str,
    package: Package,
}

/// Another package, known by where it lies: it is a static. (Where its list of files lies does not say: constants may have copies.)
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
    /// The name of an `@if`.
    pub const fn new(name: &'static str) -> Self {
        Self { name, chosen: None }
    }

    /// The same, and what a shader imports from `package::chosen::PURPOSE` is that of `module` (a path, as `"tiled/cell"`). `package`: the
    /// static that the module lies in, where it is not in the shader's own package.
    pub const fn choosing(
        name: &'static str,
        purpose: &'static str,
        module: &'static str,
        package: Option<&'static ShaderLibrary>,
    ) -> Self {
        Self { name, chosen: Some(Chosen { purpose, module, package: Package(package) }) }
    }

    /// True if it chooses a module.
    pub const fn is_choice(self) -> bool {
        self.chosen.is_some()
    }

    /// The name of its `@if`.
    pub const fn name(self) -> &'static str {
        self.name
    }
}

impl fmt::Debug for Feature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Feature").field(&self.name).finish()
    }
}

/// One WESL file: its module path below the package (`"light_culling/tiled/assign"`), and its text.
pub type ShaderSource = (&'static str, &'static str);

/// The WESL package of a crate.
#[derive(Clone, Copy, Debug)]
pub struct ShaderLibrary {
    base: Option<&'static ShaderLibrary>,
    sources: &'static [ShaderSource],
}

/// A module with everything it imports, as WGSL that naga accepts.
#[derive(Debug)]
pub struct LinkedShader {
    /// The root module's path and the features that were on, e.g. `shading/forward+binding_arrays`.
    pub label: String,
    /// The linked WGSL.
    pub source: String,
    /// naga's view of it.
    pub module: naga::Module,
    /// What each entry point uses.
    pub info: ModuleInfo,
}

impl ShaderLibrary {
    /// A package of these files.
    pub const fn new(sources: &'static [ShaderSource]) -> Self {
        Self { base: None, sources }
    }

    /// A package of these files, which may import those of another one as if they were of one package: `package::view::view`.
    pub const fn extending(base: &'static ShaderLibrary, sources: &'static [ShaderSource]) -> Self {
        Self { base: Some(base), sources }
    }

    /// The files of the package.
    pub const fn sources(&self) -> &'static [ShaderSource] {
        self.sources
    }

    /// A number that no other library has: where its list lies, so a library is a static.
    pub(crate) fn number(&self) -> usize {
        self.sources.as_ptr().addr()
    }

    /// Links `module` with its imports, these `@if` features on and all others off, numbers its bindings, and validates it. Within an
    /// [`Engine`](crate::Engine) that has done so before, it is that one's.
    pub fn link(&self, module: &str, features: &[Feature]) -> Result<Arc<LinkedShader>, GpuError> {
        let (libraries, label) =
            ([Some(self), self.base].map(|library| library.map(Self::number)), label(module, features));
        engine::linked(libraries, &label, |edited| self.link_edited(module, features, edited))
    }

    /// The same with texts in the place of files of the package. An error, too, where the host could not run what it has become.
    pub(crate) fn link_edited(
        &self,
        module: &str,
        features: &[Feature],
        texts: &ShaderTexts,
    ) -> Result<LinkedShader, GpuError> {
        let linked = self.link_again(module, features, texts)?;
        if !texts.is_empty() {
            let known = self.link_again(module, features, &ShaderTexts::new())?;
            let fail = |what| GpuError::Shader { shader: linked.label.clone(), what };
            edited::check(&known, &linked).map_err(fail)?;
        }
        Ok(linked)
    }

    fn link_again(&self, module: &str, features: &[Feature], texts: &ShaderTexts) -> Result<LinkedShader, GpuError> {
        let label = label(module, features);
        let fail = |what: String| GpuError::Shader { shader: label.clone(), what };

        let chosen = || features.iter().filter_map(|feature| feature.chosen);
        let mut resolver = VirtualResolver::new();
        let base = self.base.map_or(&[][..], |base| base.sources);
        for (path, text) in chosen()
            .flat_map(|chosen| chosen.package.0.map_or(&[][..], |package| package.sources))
            .chain(base)
            .chain(self.sources)
        {
            let text = texts.get(*path).map_or(*text, String::as_str);
            resolver.add_module(module_path(path), with_chosen(text, chosen()));
        }
        let mut linker = Wesl::new_barebones().set_custom_resolver(resolver);
        linker.set_options(CompileOptions { validate: false, ..Default::default() });
        linker.set_custom_mangler(ItemFirst).use_sourcemap(true).set_missing_feature_behavior(Switch::Disable);
        linker.set_features(features.iter().map(|feature| (feature.name.to_owned(), true)));
        let mut linked = linker.compile(&module_path(module)).map_err(|e| fail(e.to_string()))?;
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

/// A file's text with the chosen modules in the place of what they are for.
fn with_chosen(text: &str, chosen: impl Iterator<Item = Chosen>) -> Cow<'_, str> {
    if !text.contains(CHOSEN) {
        return Cow::Borrowed(text);
    }
    let replaced = chosen.fold(text.to_owned(), |text, Chosen { purpose, module, .. }| {
        text.replace(&format!("{CHOSEN}{purpose}"), &format!("package::{}", module.replace('/', "::")))
    });
    Cow::Owned(replaced)
}

/// How imports of a module begin that a feature chooses.
const CHOSEN: &str = "package::chosen::";

fn label(module: &str, features: &[Feature]) -> String {
    features.iter().fold(module.to_owned(), |label, feature| format!("{label}+{}", feature.name))
}

impl LinkedShader {
    /// The workgroup size of a compute entry point, as the shader's constants say.
    ///
    /// Panics when there is no such entry point: a bug.
    pub fn workgroup_size(&self, entry: &str) -> [u32; 3] {
        self.module.entry_points[self.entry_index(entry)].workgroup_size
    }

    /// True if it has an entry point of this name.
    pub fn has_entry(&self, entry: &str) -> bool {
        self.module.entry_points.iter().any(|e| e.name == entry)
    }

    /// Locations that a vertex entry point reads.
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

    /// Index of an entry point in naga's list.
    pub(crate) fn entry_index(&self, entry: &str) -> usize {
        let index = self.module.entry_points.iter().position(|e| e.name == entry);
        index.unwrap_or_else(|| panic!("{}: no entry point {entry}", self.label))
    }

    /// wgpu's module of it.
    pub(crate) fn create_module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(&self.label),
            source: wgpu::ShaderSource::Naga(Cow::Owned(self.module.clone())),
        })
    }
}

/// Orders declarations by the files that they are of, and within a file as they stand there; the root's own come first. The linker takes
/// the files of a root with several entry points in an order that is another one each time: the same shader would be another to whoever
/// knows it by its text, the driver's cache among them.
fn put_in_order(linked: &mut TranslationUnit) {
    let file = |declaration: &Spanned<GlobalDeclaration>| {
        let name = declaration.ident().map(|ident| ident.to_string()).unwrap_or_default();
        name.split_once("__").map_or(String::new(), |(_, file)| file.to_owned())
    };
    linked.global_declarations.sort_by_cached_key(file);
    linked.global_directives.sort_by_cached_key(ToString::to_string);
}

/// Gives every variable that has a group its `@binding`: from 0 up in each group, in the order of the linked declarations. An error
/// where a shader writes a number itself: the host binds by name, and two numbers of different files might meet.
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

/// What an item was called in its own file.
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
            "room/kernel",
            "import package::common::math::PI;\n@group(2) var<storage, read_write> out: array<f32>;\n\
             @if(double) const SCALE = 2.0;\n@else const SCALE = 1.0;\nconst SIZE = 64u;\n\
             @compute @workgroup_size(SIZE) fn main() { out[0] = SCALE * PI; }",
        ),
        (
            "door/lists",
            "@group(2) var<storage, read> lists: array<u32>;\n@group(1) var<storage, read> lights: array<u32>;",
        ),
        (
            "room/bound",
            "import package::door::lists::{lists, lights};\n@group(2) var<storage, read_write> out: array<u32>;\n\
             @compute @workgroup_size(1) fn main() { out[0] = lists[0] + lights[0]; }",
        ),
        (
            "room/numbered",
            "@group(2) @binding(0) var<storage, read_write> out: array<u32>;\n\
             @compute @workgroup_size(1) fn main() { out[0] = 1u; }",
        ),
        ("tools/hand", "fn by_hand() -> f32 { return 1.0; }"),
        ("tools/other", "fn other() -> f32 { return 2.0; }"),
        (
            "room/both",
            "import package::tools::hand::by_hand;\nimport package::tools::other::other;\n\
             @group(2) var<storage, read_write> out: array<f32>;\n\
             @compute @workgroup_size(1) fn one() { out[0] = by_hand(); }\n\
             @compute @workgroup_size(1) fn two() { out[0] = other(); }",
        ),
        (
            "room/asking",
            "import package::chosen::scale as chosen;\n@group(2) var<storage, read_write> out: array<f32>;\n\
                         @compute @workgroup_size(1) fn main() { out[0] = chosen::scale(); }",
        ),
        ("scales/one", "fn scale() -> f32 { return 1.0; }"),
        ("room/broken", "@compute @workgroup_size(1) fn main() { let x: u32 = 1.0; }"),
    ]);

    #[test]
    fn imports_features_and_stripping() {
        let plain = LIBRARY.link("room/kernel", &[]).unwrap();
        let double = LIBRARY.link("room/kernel", &[Feature::new("double")]).unwrap();
        assert!(plain.source.contains("SCALE = 1.0") && double.source.contains("SCALE = 2.0"));
        assert!(!plain.source.contains("unused"));
        assert_eq!(plain.workgroup_size("main"), [64, 1, 1]);
        assert_eq!(double.label, "room/kernel+double");
    }

    #[test]
    fn bindings_are_numbered_in_each_group_over_all_files() {
        let linked = LIBRARY.link("room/bound", &[]).unwrap();
        let mut numbers: Vec<_> = linked.module.global_variables.iter().filter_map(|(_, v)| v.binding).collect();
        numbers.sort_by_key(|b| (b.group, b.binding));
        let numbers: Vec<_> = numbers.iter().map(|b| (b.group, b.binding)).collect();
        assert_eq!(numbers, [(1, 0), (2, 0), (2, 1)], "{}", linked.source);
    }

    /// Also one of another package, which may import from this one.
    #[test]
    fn a_feature_chooses_a_module() {
        const OTHER: &[ShaderSource] =
            &[("other/pi", "import package::common::math::PI;\nfn scale() -> f32 { return PI; }")];
        static EXTENDED: ShaderLibrary = ShaderLibrary::extending(&LIBRARY, OTHER);
        let of_base = EXTENDED.link("room/bound", &[]).unwrap();
        assert_eq!(
            of_base.source,
            LIBRARY.link("room/bound", &[]).unwrap().source,
            "a package has the files of its base"
        );
        let own = Feature::choosing("one", "scale", "scales/one", None);
        let other = Feature::choosing("pi", "scale", "other/pi", Some(&EXTENDED));
        let [own, other] = [own, other].map(|feature| LIBRARY.link("room/asking", &[feature]).unwrap());
        assert!(own.source.contains("return 1.0") && !own.source.contains("PI"), "{}", own.source);
        assert!(other.source.contains("return PI") && other.source.contains("3.14159"), "{}", other.source);
        let error = LIBRARY.link("room/asking", &[]).unwrap_err().to_string();
        assert!(error.contains("chosen"), "{error}");
    }

    #[test]
    fn a_shader_is_the_same_text_each_time() {
        let link = || LIBRARY.link("room/both", &[]).unwrap().source.clone();
        let first = link();
        assert!(first.find("fn by_hand").unwrap() < first.find("fn other").unwrap(), "{first}");
        assert!((0..32).all(|_| link() == first), "another order");
    }

    #[test]
    fn a_binding_with_a_number_of_its_own_is_refused() {
        let error = LIBRARY.link("room/numbered", &[]).unwrap_err().to_string();
        assert!(error.contains("out") && error.contains("linker"), "{error}");
    }

    #[test]
    fn a_shader_that_does_not_validate_is_an_error_that_names_it() {
        let error = LIBRARY.link("room/broken", &[]).unwrap_err().to_string();
        assert!(error.contains("room/broken") && error.contains("u32"), "{error}");
        assert!(LIBRARY.link("room/missing", &[]).is_err());
    }
}
