//! Reads a small documentation, and checks that the listing sees what changes, and that examples use what is listed.

use serde_json::{Value, json};

use super::{
    CRATES,
    listing::{FORMAT, HIDDEN, Listing, differences, page},
};
use crate::{
    command::workspace,
    files::{read, texts},
    imports,
};

/// A crate with a module, a struct that two paths reach, its method, a trait, and an item of another crate; a hidden module with a
/// struct that is not hidden at the root, a hidden method and a hidden re-export.
fn documentation() -> Value {
    json!({
        "format_version": FORMAT,
        "root": 0,
        "paths": { "9": { "crate_id": 3, "path": ["other", "deep", "Thing"] } },
        "index": {
            "0": { "crate_id": 0, "name": "a_b", "inner": { "module": { "items": [1, 3, 4, 8, 11, 12, 14, 16] } } },
            "1": { "crate_id": 0, "name": "inside", "inner": { "module": { "items": [2] } } },
            "2": { "crate_id": 0, "name": "Held", "inner": { "struct": { "impls": [5, 7] } } },
            "3": { "crate_id": 0, "name": null, "inner": { "use": { "name": "Held", "id": 2, "is_glob": false } } },
            "4": { "crate_id": 0, "name": null, "inner": { "use": { "name": "Thing", "id": 9, "is_glob": false } } },
            "5": { "crate_id": 0, "name": null, "inner": { "impl": { "trait": null, "items": [6, 15] } } },
            "6": { "crate_id": 0, "name": "open", "inner": { "function": {} } },
            "7": { "crate_id": 0, "name": null, "inner": { "impl": { "trait": { "path": "Clone" }, "items": [6] } } },
            "8": { "crate_id": 0, "name": "Kind", "inner": { "trait": { "items": [10] } } },
            "10": { "crate_id": 0, "name": "NAME", "inner": { "assoc_const": {} } },
            "11": { "crate_id": 0, "name": null, "inner": { "use": { "name": "inside", "id": 1, "is_glob": true } } },
            "12": { "crate_id": 0, "name": "inner", "attrs": [{ "other": HIDDEN }], "inner": { "module": { "items": [13] } } },
            "13": { "crate_id": 0, "name": "Shown", "inner": { "struct": { "impls": [] } } },
            "14": { "crate_id": 0, "name": null, "inner": { "use": { "name": "Shown", "id": 13, "is_glob": false } } },
            "15": { "crate_id": 0, "name": "inspect", "attrs": ["must_use", { "other": HIDDEN }], "inner": { "function": {} } },
            "16": { "crate_id": 0, "name": null, "attrs": [{ "other": HIDDEN }], "inner": { "use": { "name": "Other", "id": 9, "is_glob": false } } }
        }
    })
}

#[test]
fn an_item_is_listed_once_by_its_shortest_path() {
    let listing = Listing::of("a-b", &documentation()).unwrap();
    let lines: Vec<_> = listing.items.iter().map(|(path, kind)| format!("{path} {kind}")).collect();
    let expected = [
        "a_b::Held struct",
        "a_b::Held::open method",
        "a_b::Kind trait",
        "a_b::Kind::NAME const",
        "a_b::Shown struct",
        "a_b::inside mod",
    ];
    assert_eq!(lines, expected);
    assert_eq!(listing.foreign.into_iter().collect::<Vec<_>>(), [("a_b::Thing".into(), "other::deep::Thing".into())]);
    let mut other_format = documentation();
    other_format["format_version"] = json!(FORMAT + 1);
    assert_eq!(Listing::of("a-b", &other_format), None);
}

#[test]
fn an_item_that_comes_or_goes_is_a_difference() {
    let listing = Listing::of("a-b", &documentation()).unwrap();
    let stored = page(std::slice::from_ref(&listing));
    assert!(stored.contains("   5 a-b\n   5 together\n"), "{stored}");
    assert_eq!(differences(&stored, &stored), [""; 0]);
    let mut fewer = listing;
    fewer.items.remove("a_b::Held::open");
    let lines = differences(&stored, &page(&[fewer]));
    assert!(
        lines.contains(&"- a_b::Held::open method".to_owned()) && lines.contains(&"+    4 a-b".to_owned()),
        "{lines:?}"
    );
}

/// A crate that a program may depend on is listed, or is one of those that promise nothing.
#[test]
fn every_crate_is_listed_or_promises_nothing() {
    let folders = std::fs::read_dir(workspace().join("crates")).unwrap();
    let mut names: Vec<_> = folders.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.retain(|name| !["lanternfish-gpu-test", "lanternfish-python", "lanternfish-web"].contains(&name.as_str()));
    names.sort();
    assert_eq!(names, CRATES);
}

/// What a text of Rust imports from the project's crates, or names by its whole path, and the interface lacks.
fn unlisted(text: &str, interface: &str) -> Vec<String> {
    let starts = text.match_indices("lanternfish").filter(|(at, _)| !text[..*at].ends_with([':', '_']));
    let paths = starts.flat_map(|(at, _)| imports::tree(&text[at..]).0);
    let paths = paths.filter(|path| path.len() > 1 && CRATES.contains(&&*path[0].replace('_', "-")));
    let kind = |path: &str| interface.lines().find_map(|line| line.strip_prefix(path)?.strip_prefix(' '));
    // Fields and variants are not listed.
    let of = |path: &str| kind(path.rsplit_once("::")?.0).filter(|kind| *kind != "mod");
    let is_listed = |path: &str| kind(path).or(of(path)).is_some();
    paths.map(|path| path.join("::")).filter(|path| !is_listed(path)).collect()
}

#[test]
fn examples_and_guide_import_what_is_listed() {
    let interface = read(&workspace().join("docs/interface.txt")).unwrap();
    let folders = ["crates/lanternfish/examples", "examples/hemisphere/src", "docs/guide"];
    let readme = ("README.md".to_owned(), read(&workspace().join("README.md")).unwrap());
    for (name, text) in folders.map(|folder| texts(folder, &["rs", "md"])).concat().into_iter().chain([readme]) {
        assert_eq!(unlisted(&text, &interface), [""; 0], "{name}");
    }
    let text = "use lanternfish::{Renderer, rays::TracePass};\nfn main() { lanternfish_gpu::made() }";
    assert_eq!(unlisted(text, &interface), ["lanternfish::rays::TracePass", "lanternfish_gpu::made"]);
}
