//! The public items of a crate, read from rustdoc's JSON.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use serde_json::Value;

/// The format of rustdoc's JSON that is read: that of the compiler in `Cargo.toml`.
pub const FORMAT: u64 = 57;

/// What it has for an item that the documentation does not show.
pub const HIDDEN: &str = "#[doc(hidden)]";

/// The public items of a crate.
#[derive(Clone, Debug, PartialEq)]
pub struct Listing {
    /// The name of the package.
    pub name: String,
    /// The kind of each item by its path: `method` of `lanternfish::Renderer::record`.
    pub items: BTreeMap<String, String>,
    /// The other crate's path of each re-exported item by its path here.
    pub foreign: BTreeMap<String, String>,
}

impl Listing {
    /// The listing of a package. `None` if the JSON has another format.
    pub fn of(name: &str, documentation: &Value) -> Option<Self> {
        (documentation["format_version"] == FORMAT).then_some(())?;
        let mut reader = Reader {
            index: &documentation["index"],
            paths: &documentation["paths"],
            listing: Self { name: name.to_owned(), items: BTreeMap::new(), foreign: BTreeMap::new() },
            visited: BTreeSet::new(),
            modules: VecDeque::from([(name.replace('-', "_"), key(&documentation["root"]))]),
        };
        // Breadth first, so that an item is reached under its shortest path.
        while let Some((path, id)) = reader.modules.pop_front() {
            reader.read_module(&path, &id);
        }
        Some(reader.listing)
    }

    /// How many items there are. Modules are listed and not counted.
    pub fn count(&self) -> usize {
        self.items.values().filter(|kind| *kind != "mod").count()
    }
}

struct Reader<'a> {
    index: &'a Value,
    paths: &'a Value,
    listing: Listing,
    /// The items that are listed already.
    visited: BTreeSet<String>,
    /// The modules to be read, by the path that leads there.
    modules: VecDeque<(String, String)>,
}

impl Reader<'_> {
    fn read_module(&mut self, path: &str, id: &str) {
        for child in ids(&self.index[id]["inner"]["module"]["items"]) {
            let item = &self.index[&child];
            if is_hidden(item) {
                continue;
            }
            let used = &item["inner"]["use"];
            if used.is_null() {
                self.read_item(&join(path, &item["name"]), &child);
                continue;
            }
            let target = key(&used["id"]);
            if self.index[&target].is_null() || self.index[&target]["crate_id"] != 0 {
                let segments = self.paths[&target]["path"].as_array();
                let segments = segments.map(|all| all.iter().filter_map(Value::as_str).collect::<Vec<_>>().join("::"));
                let source = segments.unwrap_or_else(|| used["source"].as_str().unwrap_or("?").to_owned());
                self.listing.foreign.insert(join(path, &used["name"]), source);
            } else if used["is_glob"] == true {
                self.modules.push_back((path.to_owned(), target));
            } else {
                self.read_item(&join(path, &used["name"]), &target);
            }
        }
    }

    fn read_item(&mut self, path: &str, id: &str) {
        let inner = self.index[id]["inner"].as_object();
        let Some((kind, inner)) = inner.and_then(|inner| inner.iter().next()) else { return };
        if is_hidden(&self.index[id]) || !self.visited.insert(id.to_owned()) {
            return;
        }
        let kind = match kind.as_str() {
            "module" => {
                self.modules.push_back((path.to_owned(), id.to_owned()));
                "mod"
            }
            "function" => "fn",
            "constant" => "const",
            "type_alias" => "type",
            "proc_macro" => "macro",
            same => same,
        };
        self.listing.items.insert(path.to_owned(), kind.to_owned());
        for implementation in ids(&inner["impls"]) {
            let of = &self.index[&implementation]["inner"]["impl"];
            if !of.is_null() && of["trait"].is_null() {
                self.read_members(path, &of["items"]);
            }
        }
        if kind == "trait" {
            self.read_members(path, &inner["items"]);
        }
    }

    /// What an inherent implementation or a trait has.
    fn read_members(&mut self, path: &str, members: &Value) {
        for member in ids(members).iter().map(|id| &self.index[id]).filter(|member| !is_hidden(member)) {
            let kind = match member["inner"].as_object().and_then(|inner| inner.keys().next()).map(String::as_str) {
                Some("function") => "method",
                Some("assoc_const") => "const",
                Some("assoc_type") => "type",
                _ => continue,
            };
            self.listing.items.insert(join(path, &member["name"]), kind.to_owned());
        }
    }
}

fn is_hidden(item: &Value) -> bool {
    item["attrs"].as_array().is_some_and(|attributes| attributes.iter().any(|attribute| attribute["other"] == HIDDEN))
}

fn join(path: &str, name: &Value) -> String {
    format!("{path}::{}", name.as_str().unwrap_or("?"))
}

/// Ids are numbers, and keys of the index are texts.
fn key(id: &Value) -> String {
    id.as_str().map_or_else(|| id.to_string(), str::to_owned)
}

fn ids(list: &Value) -> Vec<String> {
    list.as_array().into_iter().flatten().map(key).collect()
}

/// The text that is stored: counts, and for each crate its items.
pub fn page(listings: &[Listing]) -> String {
    let mut page = "The public interface. `cargo xtask interface --write` writes this file.\n\n".to_owned();
    for listing in listings {
        page += &format!("{:4} {}\n", listing.count(), listing.name);
    }
    page += &format!("{:4} together\n", listings.iter().map(Listing::count).sum::<usize>());
    for listing in listings {
        page += &format!("\n# {}\n\n", listing.name);
        listing.items.iter().for_each(|(path, kind)| page += &format!("{path} {kind}\n"));
        listing.foreign.iter().for_each(|(path, source)| page += &format!("{path} = {source}\n"));
    }
    page
}

/// The lines of which only one text has one, marked `-` if it is the stored text and `+` if it is the new one.
pub fn differences(stored: &str, new: &str) -> Vec<String> {
    let [stored, new] = [stored, new].map(|text| text.lines().collect::<BTreeSet<_>>());
    let removed = stored.difference(&new).map(|line| format!("- {line}"));
    removed.chain(new.difference(&stored).map(|line| format!("+ {line}"))).collect()
}
