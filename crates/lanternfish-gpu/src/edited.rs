//! Shader texts edited while the program runs, which replace those compiled into a library.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use naga::{Module, TypeInner};

use crate::{LinkedShader, shader::item_name};

/// Texts of WESL files by module path within the package, e.g. `"light_culling/tiled/assign"`.
pub type ShaderTexts = BTreeMap<String, String>;

/// Every `.wesl` file below a folder, with its module path. Folders that cannot be read are skipped.
pub fn shader_files(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut files = Vec::new();
    collect(folder, folder, &mut files);
    files
}

fn collect(root: &Path, folder: &Path, files: &mut Vec<(PathBuf, String)>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
        if path.is_dir() {
            collect(root, &path, files);
        } else if path.extension().is_some_and(|ending| ending == "wesl")
            && let Ok(module) = path.strip_prefix(root).map(|module| module.with_extension(""))
        {
            let module = module.components().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/");
            files.push((path, module));
        }
    }
}

/// Reads all shaders below a folder. Fails if a file cannot be read, or if there are none; the error names the file or the folder.
pub fn read_shader_texts(folder: &Path) -> Result<ShaderTexts, String> {
    let files = shader_files(folder);
    if files.is_empty() {
        return Err(format!("{}: contains no .wesl file", folder.display()));
    }
    let text = |(path, module): (PathBuf, String)| match lanternfish_limits::read_text(&path) {
        Ok(text) => Ok((module, text)),
        Err(error) => Err(format!("{}: {error}", path.display())),
    };
    files.into_iter().map(text).collect()
}

/// An entry point's interface to the host.
#[derive(Debug, PartialEq, Eq)]
struct Interface {
    /// Stage and name.
    entry: String,
    /// Group, address space and type of each resource in use, by name.
    resources: BTreeMap<String, String>,
}

/// The interfaces of all entry points, sorted by stage and name.
fn interfaces(shader: &LinkedShader) -> Vec<Interface> {
    let module = &shader.module;
    let of = |(index, entry): (usize, &naga::EntryPoint)| {
        let uses = shader.info.get_entry_point(index);
        let used = module.global_variables.iter();
        let used = used.filter(|(handle, variable)| variable.binding.is_some() && !uses[*handle].is_empty());
        let resources = used.map(|(_, variable)| {
            let name = item_name(variable.name.as_deref().unwrap_or_default()).to_owned();
            let group = variable.binding.as_ref().map_or(0, |binding| binding.group);
            (name, format!("group {group}, {:?}, {}", variable.space, described(module, variable.ty)))
        });
        let stage = format!("{:?}", entry.stage).to_lowercase();
        Interface { entry: format!("@{stage} {}", entry.name), resources: resources.collect() }
    };
    let mut all: Vec<_> = module.entry_points.iter().enumerate().map(of).collect();
    all.sort_by(|a, b| a.entry.cmp(&b.entry));
    all
}

/// The text of a type with all its members, for comparing types of two modules.
fn described(module: &Module, ty: naga::Handle<naga::Type>) -> String {
    match &module.types[ty].inner {
        TypeInner::Array { base, size, stride } => {
            let size = match size {
                naga::ArraySize::Constant(count) => count.to_string(),
                _ => "any number".to_owned(),
            };
            format!("{size} × {stride} bytes of {}", described(module, *base))
        }
        TypeInner::BindingArray { base, .. } => format!("any number of {}", described(module, *base)),
        TypeInner::Struct { members, span } => {
            let members = members.iter().map(|member| {
                let name = member.name.as_deref().unwrap_or_default();
                format!("{name} at {}: {}", member.offset, described(module, member.ty))
            });
            format!("{span} bytes of {{ {} }}", members.collect::<Vec<_>>().join(", "))
        }
        plain => format!("{plain:?}"),
    }
}

/// Checks that the host can run an edited shader in place of the original. Fails if the entry points differ, if a resource is used that
/// the host does not bind, or if a resource has another type.
pub fn check(original: &LinkedShader, edited: &LinkedShader) -> Result<(), String> {
    let (original, edited) = (interfaces(original), interfaces(edited));
    let names = |all: &[Interface]| all.iter().map(|one| one.entry.as_str()).collect::<Vec<_>>().join(", ");
    if names(&original) != names(&edited) {
        return Err(format!("its entry points are {}, the host runs {}", names(&edited), names(&original)));
    }
    for (original, edited) in original.iter().zip(&edited) {
        let entry = &original.entry;
        for (name, is) in &edited.resources {
            match original.resources.get(name) {
                None => {
                    return Err(format!(
                        "{entry} uses {name}, which the host does not bind there: rebuild the program"
                    ));
                }
                Some(was) if was != is => {
                    return Err(format!("{name} is {is}, the host has {was}: rebuild the program"));
                }
                Some(_) => {}
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{GpuError, ShaderLibrary};

    const LIBRARY: ShaderLibrary = ShaderLibrary::new(&[
        ("common/scale", "const SCALE = 2.0;"),
        (
            "technique/kernel",
            "import package::common::scale::SCALE;\nstruct Cell { size: f32, count: u32 }\n\
             @group(2) var<storage, read_write> cells: array<Cell>;\n\
             @compute @workgroup_size(64) fn main() { cells[0].size = SCALE; }",
        ),
        (
            "technique/two",
            "@group(2) var<storage, read_write> a: array<u32>;\n@group(2) var<storage, read_write> b: array<u32>;\n\
             @compute @workgroup_size(1) fn first() { a[0] = 1u; }\n@compute @workgroup_size(1) fn second() { b[0] = 1u; }",
        ),
    ]);

    /// The host binds resources per entry point.
    #[test]
    fn resources_of_another_entry_point_are_not_bound() {
        let (_, text) = LIBRARY.sources()[2];
        let link = |text: String| {
            let texts = ShaderTexts::from([("technique/two".to_owned(), text)]);
            LIBRARY.link_edited("technique/two", &[], &texts)
        };
        link(text.replace("a[0] = 1u", "a[1] = 2u")).unwrap();
        let refused = link(text.replace("a[0] = 1u", "a[0] = b[0]")).unwrap_err().to_string();
        assert!(refused.contains("@compute first uses b"), "{refused}");
    }

    fn linked(texts: &[(&str, &str)]) -> Result<Arc<LinkedShader>, GpuError> {
        let texts = texts.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect();
        LIBRARY.link_edited("technique/kernel", &[], &texts).map(Arc::new)
    }

    #[test]
    fn an_edited_file_replaces_the_librarys() {
        let plain = linked(&[]).unwrap();
        assert!(plain.source.contains("2.0"));
        let other = linked(&[("common/scale", "const SCALE = 5.0;")]).unwrap();
        assert!(other.source.contains("5.0") && !other.source.contains("2.0"));
        // A text without a file of the library is ignored.
        assert_eq!(linked(&[("common/other", "nonsense")]).unwrap().source, plain.source);
    }

    #[test]
    fn an_incompatible_shader_is_refused_with_a_reason() {
        let kernel = |text: &str| linked(&[("technique/kernel", text)]).unwrap_err().to_string();
        let cases = [
            (linked(&[("common/scale", "const SCALE = ;")]).unwrap_err().to_string(), "expected"),
            (
                kernel(
                    "@group(2) var<storage, read_write> cells: array<u32>;\n@compute @workgroup_size(1) fn other() { cells[0] = 1u; }",
                ),
                "@compute other",
            ),
            (
                kernel(
                    "@group(2) var<storage, read_write> cells: array<u32>;\n@compute @workgroup_size(1) fn main() { cells[0] = 1u; }",
                ),
                "cells is",
            ),
            (
                kernel(
                    "@group(2) var<storage, read_write> more: array<u32>;\n@compute @workgroup_size(1) fn main() { more[0] = 1u; }",
                ),
                "uses more",
            ),
        ];
        for (message, expected) in cases {
            assert!(message.contains(expected) && message.contains("technique/kernel"), "{expected}: {message}");
        }
        // Using fewer resources is allowed.
        linked(&[("technique/kernel", "@compute @workgroup_size(64) fn main() {}")]).unwrap();
    }
}
