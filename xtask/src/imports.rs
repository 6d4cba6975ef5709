//! Tests the imports of every crate: no large cycle of files, and no technique imported outside its folder.
//!
//! An edge leads from a file to the file that an imported path names, as far as the path consists of files: an item
//! that a module re-exports counts as the module's. Paths begin with `crate`, `super`, `self` or `package`: `pub use
//! child::X` is part of a module's declarations, like `mod child`, and `package::chosen` is not a file. Tests may
//! import anything.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use crate::files;

/// The files of a crate by language and module path, each with the files that it imports.
type Imports = BTreeMap<File, BTreeSet<File>>;

/// `("rs", "gpu_scene/bvh")`; the root is `("rs", "")`.
type File = (&'static str, String);

/// Most files in a cycle of imports within a crate.
const LARGEST_CYCLE: usize = 6;

/// Folders of techniques of the library. Outside of them, only the registration may import from them.
const TECHNIQUES: &[&str] =
    &["direct_light/sampled", "indirect/sampled", "light_culling/clustered", "light_culling/tiled"];

/// Imports that point up between the library's folders: settings hold techniques, which are built for settings.
const UP: [(&str, &str); 3] = [("settings", "direct_light"), ("settings", "indirect"), ("settings", "occlusion")];

/// The only files of `crates` that name the crate of the papers: the command line's, and that of the window's tests.
const PAPERS: [&str; 2] = ["crates/lanternfish-cli/src/paper.rs", "crates/lanternfish-viewer/src/testing.rs"];

/// The list that registers all techniques.
const REGISTRATION: &str = "techniques";

/// The imports between the files below a crate's `src`.
fn imports(source: &Path) -> Imports {
    let texts = texts(source);
    let files: BTreeSet<File> = texts.keys().cloned().collect();
    let of = |(file, text): (&File, &String)| {
        let mut imported: BTreeSet<File> =
            paths(file, text).iter().filter_map(|path| named(&files, file.0, path)).collect();
        imported.remove(file);
        (file.clone(), imported)
    };
    texts.iter().map(of).collect()
}

/// Every source file except tests.
fn texts(source: &Path) -> BTreeMap<File, String> {
    let mut texts = BTreeMap::new();
    for path in files::below(source).expect("a folder of the crate") {
        let names = path.strip_prefix(source).expect("it lies below").iter().map(|name| name.to_string_lossy());
        let mut module: Vec<_> = names.map(String::from).collect();
        let file = module.pop().expect("a file has a name");
        let language = match file.split_once('.') {
            Some((_, "rs")) => "rs",
            Some((_, "wesl")) => "wesl",
            _ => continue,
        };
        let stem = &file[..file.len() - language.len() - 1];
        // CPU references are for tests only.
        let is_test = |name: &String| ["tests", "testing"].contains(&name.as_str());
        if module.iter().any(is_test) || ["tests", "cpu_reference"].contains(&stem) {
            continue;
        }
        let text = files::read(&path).expect("source is text");
        if text.contains("\ngpu_struct! {") || text.contains("\ngpu_constants! {") {
            // The build script generates it from the folder's declarations; it imports nothing.
            texts.entry(("wesl", [&module[..], &["host".to_owned()]].concat().join("/"))).or_default();
        }
        if language == "wesl" || !["mod", "lib", "main"].contains(&stem) {
            module.push(stem.to_owned());
        }
        texts.insert((language, module.join("/")), text);
    }
    texts
}

/// The file that a path names: its longest prefix that is a file.
fn named(files: &BTreeSet<File>, language: &'static str, path: &[String]) -> Option<File> {
    let begins = (0..=path.len()).rev().map(|length| (language, path[..length].join("/")));
    begins.into_iter().find(|file| files.contains(file))
}

/// All imports of a file from its own crate, as paths from the crate's root.
fn paths((language, module): &File, text: &str) -> Vec<Vec<String>> {
    let code = without_tests(text);
    let module: Vec<String> = module.split('/').filter(|name| !name.is_empty()).map(str::to_owned).collect();
    let mut paths = Vec::new();
    for root in ["crate::", "package::", "super::", "self::"] {
        let mut end = 0;
        for (at, _) in code.match_indices(root) {
            // Skip what the last path contains, the end of a longer path, and a macro's `$crate`.
            let before = code[..at].chars().next_back();
            if at < end || before.is_some_and(|c| c.is_alphanumeric() || "_:$".contains(c)) {
                continue;
            }
            let mut rest = &code[at + root.len()..];
            let mut base = match root {
                "self::" => module.clone(),
                "super::" => module[..module.len().saturating_sub(1)].to_vec(),
                _ => Vec::new(),
            };
            while let Some(further) = rest.strip_prefix("super::") {
                base.pop();
                rest = further;
            }
            let (further, behind) = tree(rest);
            end = code.len() - behind.len();
            paths.extend(further.into_iter().map(|path| joined(&base, path)));
        }
    }
    let is_item = |name: &String| *language == "rs" && name == "self";
    paths.iter_mut().for_each(|path| path.retain(|name| !is_item(name)));
    paths
}

/// A path that begins in a module.
fn joined(base: &[String], path: Vec<String>) -> Vec<String> {
    let up = path.iter().take_while(|name| *name == "super").count();
    [&base[..base.len().saturating_sub(up)], &path[up..]].concat()
}

/// The text of a file without comments and code that is compiled for tests only.
fn without_tests(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let mut rest = String::new();
    let mut is_test = false;
    for line in code.lines() {
        let line = line.trim_start();
        if line == "#[cfg(test)]" {
            is_test = true;
        } else if is_test && line.ends_with(';') {
            is_test = false;
        } else if !line.starts_with("//") && !is_test {
            rest += line;
            rest.push('\n');
        } else if is_test && line.ends_with('{') {
            is_test = false;
        }
    }
    rest
}

/// Parses the import tree at the start of a text (`a::{b, c::d}`). Returns its paths and the remaining text.
pub fn tree(text: &str) -> (Vec<Vec<String>>, &str) {
    let text = text.trim_start();
    if let Some(mut rest) = text.strip_prefix('{') {
        let mut all = Vec::new();
        loop {
            rest = rest.trim_start().trim_start_matches(',').trim_start();
            if let Some(behind) = rest.strip_prefix('}') {
                return (all, behind);
            }
            let (paths, behind) = tree(rest);
            if behind.len() == rest.len() {
                return (all, behind);
            }
            all.extend(paths);
            // ` as name`
            let end = behind.find([',', '}']).unwrap_or(behind.len());
            rest = &behind[end..];
        }
    }
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
    let (name, rest) = text.split_at(end);
    if name.is_empty() {
        return (vec![Vec::new()], rest);
    }
    let Some(further) = rest.strip_prefix("::") else { return (vec![vec![name.to_owned()]], rest) };
    let (paths, behind) = tree(further);
    (paths.into_iter().map(|path| [vec![name.to_owned()], path].concat()).collect(), behind)
}

/// The files of each import cycle, the largest cycle first.
fn cycles(imports: &Imports) -> Vec<BTreeSet<File>> {
    let reach = |file: &File| {
        let (mut reached, mut next) = (BTreeSet::new(), vec![file.clone()]);
        while let Some(file) = next.pop() {
            let more = imports.get(&file).into_iter().flatten().filter(|other| reached.insert((*other).clone()));
            next.extend(more.cloned());
        }
        reached
    };
    let reached: BTreeMap<&File, BTreeSet<File>> = imports.keys().map(|file| (file, reach(file))).collect();
    let of = |file: &File| {
        let all = reached[file].iter().filter(|other| reached.get(other).is_some_and(|back| back.contains(file)));
        all.cloned().collect::<BTreeSet<File>>()
    };
    let mut cycles: Vec<_> = imports.keys().map(of).filter(|cycle| cycle.len() > 1).collect();
    cycles.sort_by(|a, b| b.len().cmp(&a.len()).then_with(|| a.cmp(b)));
    cycles.dedup();
    cycles
}

/// True if a file lies in a folder.
fn is_in((_, module): &File, folder: &str) -> bool {
    module.strip_prefix(folder).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

/// Imports of a technique's folder, or of the registration, from outside it.
fn outside(imports: &Imports, techniques: &[&str]) -> Vec<String> {
    let mut imports_from_outside = Vec::new();
    for (file, imported) in imports.iter().filter(|((_, module), _)| module != REGISTRATION) {
        let others = techniques.iter().filter(|folder| !is_in(file, folder));
        for folder in others.chain([&REGISTRATION]) {
            let names = imported.iter().filter(|other| is_in(other, folder));
            imports_from_outside.extend(names.map(|other| format!("{}.{} imports {}", file.1, file.0, other.1)));
        }
    }
    imports_from_outside
}

#[test]
fn no_crate_has_a_large_cycle_of_files() {
    let mut files = 0;
    for package in crate::command::packages() {
        let (name, imports) = (package.display(), imports(&package.join("src")));
        files += imports.len();
        let largest = cycles(&imports).into_iter().next().unwrap_or_default();
        let within =
            |file: &File| imports[file].intersection(&largest).map(|(_, other)| other.as_str()).collect::<Vec<_>>();
        let edges: Vec<String> =
            largest.iter().map(|file| format!("{} imports {}", file.1, within(file).join(", "))).collect();
        assert!(
            largest.len() <= LARGEST_CYCLE,
            "{name}: {} files import each other:\n{}",
            largest.len(),
            edges.join("\n")
        );
    }
    assert!(files > 500, "{files}");
}

#[test]
fn folders_of_the_library_stand_on_floors() {
    let folder = |(_, module): &File| ("", module.split('/').next().unwrap_or_default().to_owned());
    let mut folders = Imports::new();
    for (file, imported) in imports(&crate::command::workspace().join("crates/lanternfish/src")) {
        // Not the list of re-exports.
        let imported = imported.iter().map(folder).filter(|other| *other != folder(&file) && !other.1.is_empty());
        folders.entry(folder(&file)).or_default().extend(imported);
    }
    assert!(!cycles(&folders).is_empty());
    for (from, to) in UP {
        let imported = folders.get_mut(&("", from.to_owned()));
        let is_there = imported.is_some_and(|imported| imported.remove(&("", to.to_owned())));
        assert!(is_there, "{from} does not import {to}");
    }
    assert_eq!(cycles(&folders), Vec::<BTreeSet<File>>::new());
}

#[test]
fn one_file_of_the_product_names_the_papers() {
    let files = files::texts("crates", &["rs"]);
    let naming = files.iter().filter(|(_, text)| text.contains("lanternfish_papers")).map(|(file, _)| file);
    assert_eq!(naming.collect::<Vec<_>>(), PAPERS);
}

#[test]
fn only_the_registration_imports_techniques() {
    let imports = imports(&crate::command::workspace().join("crates/lanternfish/src"));
    for folder in TECHNIQUES {
        assert!(imports.keys().any(|(_, module)| module.starts_with(folder)), "there is no {folder}");
    }
    assert!(
        imports.contains_key(&("wesl", "light_culling/tiled/host".to_owned())),
        "declarations of Rust for shaders are missing"
    );
    assert_eq!(outside(&imports, TECHNIQUES), [""; 0]);
}

#[test]
fn cycles_and_imports_from_outside_are_detected() {
    let file = |module: &str| ("rs", module.to_owned());
    let imports = |edges: &[(&str, &str)]| {
        let mut imports = Imports::new();
        for (from, to) in edges {
            imports.entry(file(to)).or_default();
            imports.entry(file(from)).or_default().insert(file(to));
        }
        imports
    };
    assert!(cycles(&imports(&[("a", "b"), ("b", "c"), ("a", "c")])).is_empty());
    let actual = cycles(&imports(&[("a", "b/x"), ("b/x", "c"), ("c", "a"), ("c", "d"), ("d", "e"), ("e", "d")]));
    assert_eq!(actual, [[file("a"), file("b/x"), file("c")].into(), [file("d"), file("e")].into()]);
    let edges =
        [("a", "t/x"), ("t", "t/x"), ("t/x", "a"), (REGISTRATION, "t"), ("u", "tt"), ("v", "t"), ("w", REGISTRATION)];
    let expected = ["a.rs imports t/x", "v.rs imports t", "w.rs imports techniques"];
    assert_eq!(outside(&imports(&edges), &["t", "v"]), expected);
}

#[test]
fn imports_are_parsed() {
    let names = |file: &File, text| paths(file, text).iter().map(|path| path.join("/")).collect::<BTreeSet<_>>();
    let rust = "//! [`crate::no`]\nuse crate::{\n    a::{b, c as x},\n    d,\n};\nuse super::{e, f::g, super::{n, o}};\nuse self::h::I;\n\
                fn k() { crate::l::m() }\n#[cfg(test)]\nuse crate::no;\n#[cfg(test)]\nmod tests {\n use crate::no;\n}";
    let actual = names(&("rs", "p/q".to_owned()), rust);
    assert_eq!(actual.into_iter().collect::<Vec<_>>(), ["a/b", "a/c", "d", "l/m", "n", "o", "p/e", "p/f/g", "p/q/h/I"]);
    let shader = names(&("wesl", "x".to_owned()), "// package::no::x\n@if(y) import package::a::b::{c, d};");
    assert_eq!(shader.into_iter().collect::<Vec<_>>(), ["a/b/c", "a/b/d"]);
    let files: BTreeSet<File> = ["", "a", "a/b"].map(|module| ("rs", module.to_owned())).into();
    let named = |path: &str| named(&files, "rs", &path.split('/').map(str::to_owned).collect::<Vec<_>>());
    assert_eq!([named("a/b/c"), named("a/x"), named("y")], ["a/b", "a", ""].map(|file| Some(("rs", file.to_owned()))));
}
