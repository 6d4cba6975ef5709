//! Lists every `.wesl` file below `src/`, so that the library carries its shaders with it.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

fn main() {
    let root = Path::new(&env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("src");
    let mut files = Vec::new();
    collect(&root, &mut files);
    files.sort();

    let mut table = String::from("&[\n");
    for file in &files {
        let module = file.strip_prefix(&root).expect("it is below src").with_extension("");
        let module = module.components().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/");
        table += &format!("    ({module:?}, include_str!({file:?})),\n");
    }
    table += "]\n";
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it")).join("shaders.rs");
    fs::write(&out, table).expect("OUT_DIR can be written");
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    println!("cargo::rerun-if-changed={}", folder.display());
    for entry in fs::read_dir(folder).expect("src can be read") {
        let path = entry.expect("src can be read").path();
        if path.ends_with("src/testing") {
            // Probes of the tests, which take them in themselves.
            continue;
        } else if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|e| e == "wesl") {
            println!("cargo::rerun-if-changed={}", path.display());
            files.push(path);
        }
    }
}
