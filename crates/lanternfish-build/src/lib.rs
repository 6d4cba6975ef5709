//! Build-script helpers for crates with shaders: they embed a crate's WESL files and translate shared Rust declarations to WESL.

use std::{
    collections::BTreeMap,
    env, fs,
    path::{Path, PathBuf},
};

/// Writes `OUT_DIR/shaders.rs`: an expression `&[(path, text)]` with every `.wesl` file below `src/`. A folder whose Rust files declare
/// shared structs or constants (`gpu_struct!`, `gpu_constants!`) also has a module `host`, which holds them in WESL. Files below
/// `src/testing/` are left out.
///
/// ```no_run
/// // build.rs
/// lanternfish_build::write_shaders();
/// ```
///
/// ```ignore
/// // lib.rs
/// pub static SHADERS: Package = Package::new(include!(concat!(env!("OUT_DIR"), "/shaders.rs")));
/// ```
///
/// # Panics
///
/// Panics outside a build script, if a file cannot be read, and if a declaration does not have one field per line, as rustfmt formats it.
pub fn write_shaders() {
    let root = Path::new(&env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("src");
    // From the module path to a Rust expression for the module's text.
    let mut modules = BTreeMap::new();
    collect(&root, &root, &mut modules);
    let rows: String = modules.iter().map(|(module, text)| format!("    ({module:?}, {text}),\n")).collect();
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it")).join("shaders.rs");
    fs::write(&out, format!("&[\n{rows}]\n")).expect("OUT_DIR can be written");
}

fn collect(root: &Path, folder: &Path, modules: &mut BTreeMap<String, String>) {
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut entries: Vec<_> =
        fs::read_dir(folder).expect("src can be read").map(|entry| entry.expect("src can be read").path()).collect();
    entries.sort();
    let mut shared = String::new();
    for path in entries {
        if path.ends_with("src/testing") {
            // Shaders of the tests, which include them themselves.
            continue;
        } else if path.is_dir() {
            collect(root, &path, modules);
        } else if path.extension().is_some_and(|e| e == "wesl") {
            println!("cargo::rerun-if-changed={}", path.display());
            modules.insert(module_path(root, &path.with_extension("")), format!("include_str!({path:?})"));
        } else if path.extension().is_some_and(|e| e == "rs") {
            shared += &in_wesl(&fs::read_to_string(&path).expect("sources are UTF-8"));
        }
    }
    if !shared.is_empty() {
        modules.insert(module_path(root, &folder.join("host")), format!("{shared:?}"));
    }
}

/// The module path of a file, relative to `src/`.
fn module_path(root: &Path, path: &Path) -> String {
    let below = path.strip_prefix(root).expect("it is below src");
    below.components().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}

/// Translates a Rust file's shared declarations to WESL. Expects one field or constant per line, as rustfmt and `gpu_struct!` format them.
fn in_wesl(text: &str) -> String {
    let mut wesl = String::new();
    for start in ["\ngpu_constants! {\n", "\ngpu_struct! {\n"] {
        for block in text.split(start).skip(1) {
            let block = block.split("\n}\n").next().unwrap_or_default();
            let code = block.lines().map(str::trim).filter(|line| !line.starts_with("//") && !line.is_empty());
            wesl.extend(code.map(|line| line_in_wesl(line) + "\n"));
        }
    }
    wesl
}

fn line_in_wesl(line: &str) -> String {
    if line == "}" {
        line.to_owned()
    } else if let Some((_, name)) = line.split_once("struct ") {
        format!("struct {name}")
    } else if let Some((_, constant)) = line.split_once("const ") {
        let parts = constant.split_once(": ").and_then(|(name, rest)| Some((name, rest.split_once(" = ")?)));
        let (name, (kind, value)) = parts.unwrap_or_else(|| panic!("not a constant: {line}"));
        format!("const {name}: {} = {value}", type_in_wesl(kind))
    } else {
        let field = line.strip_suffix(',').and_then(|field| field.split_once(": "));
        let (name, kind) = field.unwrap_or_else(|| panic!("not a field: {line}"));
        format!("    {name}: {},", type_in_wesl(kind))
    }
}

fn type_in_wesl(rust: &str) -> String {
    if let Some((element, count)) = rust.strip_prefix('[').and_then(|array| array.strip_suffix(']')?.split_once("; ")) {
        return format!("array<{}, {count}>", type_in_wesl(element));
    }
    let wesl = match rust.trim_start_matches("glam::") {
        "usize" => "u32",
        "Vec2" => "vec2f",
        "Vec3" => "vec3f",
        "Vec4" => "vec4f",
        "UVec2" => "vec2u",
        "UVec3" => "vec3u",
        "UVec4" => "vec4u",
        "Mat4" => "mat4x4f",
        // A type with the same name in both languages, or another struct of the folder.
        same => same,
    };
    wesl.to_owned()
}
