//! WESL sources: linked into WGSL, validated and reflected without a GPU.

use std::borrow::Cow;

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use wesl::{CompileOptions, Feature, Mangler, ModulePath, VirtualResolver, Wesl, syntax::PathOrigin};

use crate::GpuError;

/// One WESL file: its module path below the package (`"light_culling/tiled/assign"`), and its text.
pub type ShaderSource = (&'static str, &'static str);

/// The WESL package of a crate.
#[derive(Clone, Copy, Debug)]
pub struct ShaderLibrary {
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
        Self { sources }
    }

    /// The files of the package.
    pub fn sources(&self) -> &'static [ShaderSource] {
        self.sources
    }

    /// Links `module` with its imports, the named `@if` features on and all others off, and validates it.
    pub fn link(&self, module: &str, features: &[&str]) -> Result<LinkedShader, GpuError> {
        let label = features.iter().fold(module.to_owned(), |label, feature| format!("{label}+{feature}"));
        let fail = |what: String| GpuError::Shader { shader: label.clone(), what };

        let mut resolver = VirtualResolver::new();
        for (path, text) in self.sources {
            resolver.add_module(module_path(path), Cow::Borrowed(*text));
        }
        let mut linker = Wesl::new_barebones().set_custom_resolver(resolver);
        linker.set_options(CompileOptions { validate: false, ..Default::default() });
        linker.set_custom_mangler(ItemFirst).use_sourcemap(true).set_missing_feature_behavior(Feature::Disable);
        linker.set_features(features.iter().map(|feature| (feature.to_string(), true)));
        let source = linker.compile(&module_path(module)).map_err(|e| fail(e.to_string()))?.to_string();

        let module = naga::front::wgsl::parse_str(&source).map_err(|e| fail(e.emit_to_string(&source)))?;
        let info = Validator::new(ValidationFlags::all(), Capabilities::all())
            .validate(&module)
            .map_err(|e| fail(e.emit_to_string(&source)))?;
        Ok(LinkedShader { label, source, module, info })
    }
}

impl LinkedShader {
    /// The workgroup size of a compute entry point, as the shader's constants say.
    ///
    /// Panics when there is no such entry point: a bug.
    pub fn workgroup_size(&self, entry: &str) -> [u32; 3] {
        self.module.entry_points[self.entry_index(entry)].workgroup_size
    }

    /// Index of an entry point in naga's list.
    /// Whether it has an entry point of this name.
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

    const LIBRARY: ShaderLibrary = ShaderLibrary::new(&[
        ("common/math", "const PI = 3.14159;\nfn unused() -> f32 { return 1.0; }"),
        (
            "room/kernel",
            "import package::common::math::PI;\n@group(2) @binding(0) var<storage, read_write> out: array<f32>;\n\
             @if(double) const SCALE = 2.0;\n@else const SCALE = 1.0;\nconst SIZE = 64u;\n\
             @compute @workgroup_size(SIZE) fn main() { out[0] = SCALE * PI; }",
        ),
        ("room/broken", "@compute @workgroup_size(1) fn main() { let x: u32 = 1.0; }"),
    ]);

    #[test]
    fn imports_features_and_stripping() {
        let plain = LIBRARY.link("room/kernel", &[]).unwrap();
        let double = LIBRARY.link("room/kernel", &["double"]).unwrap();
        assert!(plain.source.contains("SCALE = 1.0") && double.source.contains("SCALE = 2.0"));
        assert!(!plain.source.contains("unused"));
        assert_eq!(plain.workgroup_size("main"), [64, 1, 1]);
        assert_eq!(double.label, "room/kernel+double");
    }

    #[test]
    fn a_shader_that_does_not_validate_is_an_error_that_names_it() {
        let error = LIBRARY.link("room/broken", &[]).unwrap_err().to_string();
        assert!(error.contains("room/broken") && error.contains("u32"), "{error}");
        assert!(LIBRARY.link("room/missing", &[]).is_err());
    }
}
