//! Which rooms of the library import which: arrows go one way. Rooms are folders; what they take of each other through files beside
//! the folders, as `settings.rs`, is not seen.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// Rooms by name, each with the names of the rooms that its files import. What tests import does not count.
type Arrows = BTreeMap<String, BTreeSet<String>>;

/// The arrows between the folders of `source`.
fn arrows(source: &Path) -> Arrows {
    let entries = fs::read_dir(source).expect("the library is there").filter_map(Result::ok);
    let folders = entries.filter(|entry| entry.path().is_dir());
    let rooms: BTreeSet<String> = folders
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| name != "testing")
        .collect();
    let arrows_of = |room: &String| {
        let mut imported = BTreeSet::new();
        visit(&source.join(room), &mut |name, text| imported.extend(imports(name, text)));
        imported.retain(|other| other != room && rooms.contains(other));
        (room.clone(), imported)
    };
    rooms.iter().map(arrows_of).collect()
}

/// Calls `show` with the name and the text of every source file below a folder that is neither a test nor a twin.
fn visit(folder: &Path, show: &mut impl FnMut(&str, &str)) {
    for entry in fs::read_dir(folder).expect("a folder of the library").filter_map(Result::ok) {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        if path.is_dir() && name != "tests" {
            visit(&path, show);
        }
        // Twins are for tests alone.
        let is_source = name.ends_with(".rs") || name.ends_with(".wesl");
        if path.is_file() && is_source && !["tests.rs", "twin.rs"].contains(&&*name) {
            show(&name, &fs::read_to_string(&path).expect("source is text"));
        }
    }
}

/// The first path segment of everything that a file imports from its own crate: the room's name, for an item of a room.
fn imports(name: &str, text: &str) -> BTreeSet<String> {
    // Comments and what is compiled for tests are no imports.
    let code: String = text
        .split("#[cfg(test)]\nmod tests {")
        .next()
        .unwrap_or_default()
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .fold(String::new(), |code, line| code + line + "\n");
    let root = if name.ends_with(".wesl") { "package::" } else { "crate::" };
    let mut found = BTreeSet::new();
    for rest in code.split(root).skip(1) {
        match rest.strip_prefix('{') {
            Some(list) => found.extend(names_of_list(list)),
            None => found.extend(first_name(rest)),
        }
    }
    found
}

fn first_name(text: &str) -> Option<String> {
    let name: String = text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    (!name.is_empty()).then_some(name)
}

/// First path segments of an import list's entries, up to the list's closing brace: `a` and `c` for `a::b, c::{d, e}}…`.
fn names_of_list(list: &str) -> BTreeSet<String> {
    let (mut depth, mut is_first, mut names) = (0, true, BTreeSet::new());
    for (at, letter) in list.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => is_first = true,
            _ if is_first && !letter.is_whitespace() => {
                names.extend(first_name(&list[at..]));
                is_first = false;
            }
            _ => {}
        }
    }
    names
}

/// Pairs of rooms each of which leads to the other, by however many arrows.
fn circles(arrows: &Arrows) -> BTreeSet<(String, String)> {
    let reach = |room: &String| {
        let (mut reached, mut next) = (BTreeSet::new(), vec![room.clone()]);
        while let Some(room) = next.pop() {
            for other in arrows.get(&room).into_iter().flatten() {
                if reached.insert(other.clone()) {
                    next.push(other.clone());
                }
            }
        }
        reached
    };
    let reached: BTreeMap<_, _> = arrows.keys().map(|room| (room.clone(), reach(room))).collect();
    let leads = |a: &String, b: &String| reached.get(a).is_some_and(|reached| reached.contains(b));
    let arrow = arrows.iter().flat_map(|(room, imported)| imported.iter().map(move |other| (room, other)));
    arrow.filter(|(room, other)| leads(other, room)).map(|(room, other)| (room.clone(), other.clone())).collect()
}

#[test]
fn rooms_import_each_other_in_no_circle() {
    let source = crate::command::workspace().join("crates/lanternfish/src");
    let arrows = arrows(&source);
    assert!(arrows.len() > 12 && arrows["indirect"].contains("rays"), "{arrows:?}");
    let circles = circles(&arrows);
    assert!(circles.is_empty(), "{circles:?}");
}

#[test]
fn circles_are_found() {
    let arrows = |pairs: &[(&str, &str)]| {
        let mut arrows = Arrows::new();
        for (room, other) in pairs {
            arrows.entry(room.to_string()).or_default().insert(other.to_string());
        }
        arrows
    };
    assert!(circles(&arrows(&[("a", "b"), ("b", "c"), ("a", "c")])).is_empty());
    assert_eq!(circles(&arrows(&[("a", "b"), ("b", "c"), ("c", "a"), ("c", "d")])).len(), 3);
}

#[test]
fn imports_are_read() {
    let names = |name, text| imports(name, text).into_iter().collect::<Vec<_>>();
    let rust = "//! [`crate::no`]\nuse crate::{\n    a::{b, c},\n    d,\n    e::f,\n};\nfn g() { crate::h::i() }\n\
                #[cfg(test)]\nmod tests {\n use crate::no;\n}";
    assert_eq!(names("x.rs", rust), ["a", "d", "e", "h"]);
    assert_eq!(names("x.wesl", "// package::no::x\n@if(y) import package::a::b::{c, d};"), ["a"]);
}
