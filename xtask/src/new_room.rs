//! `cargo xtask new-room`: another room of a family. The family's folder holds a room of the name `new_room`, which the library has
//! in its tests alone; the new one is a copy of it under another name, and two lines that name it.

use std::{fs, path::Path};

/// The room that is copied.
const TEMPLATE: &str = "new_room";

/// Writes the room, formats it, and says what there is to do.
pub fn run(words: &[String]) -> Result<(), String> {
    let [family, name] = words else { return Err("new-room takes a family and a name: new-room indirect fog".into()) };
    let library = crate::command::workspace().join("crates/lanternfish/src");
    write(&library, family, name)?;
    crate::command::run(&mut crate::command::cargo(["fmt", "--package", "lanternfish"]))?;
    println!(
        "crates/lanternfish/src/{family}/{name}/ is a room, and two lines of {family}/mod.rs name it. Its page, its shader and its"
    );
    println!("twin say what it does: change them. cargo xtask test runs its test with all others.");
    println!("cargo run --release -- render demo:cornell --{family} {} -o {name}.png", name.replace('_', "-"));
    Ok(())
}

/// Copies the template of a family below `library`, and names the room in the family's `mod.rs`.
fn write(library: &Path, family: &str, name: &str) -> Result<(), String> {
    let template = library.join(family).join(TEMPLATE);
    if !template.is_dir() || family.contains('/') {
        return Err(format!(
            "{family}: no family with a folder {TEMPLATE}; there are: {}",
            families(library).join(", ")
        ));
    }
    let is_word = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    if !is_word {
        return Err(format!("{name}: expected a module's name: small letters, digits, _"));
    }
    // A module may not be called so, or the family has a variant or a trait of this name.
    let taken = ["none", "room", "settings", "loop", "match", "move", "static", "type", "use", "where", "while"];
    if taken.contains(&name) || name.ends_with("_room") || name.len() < 3 {
        return Err(format!("{name}: choose another name: it is a word of Rust or of the family"));
    }
    let room = library.join(family).join(name);
    if room.exists() || room.with_extension("rs").exists() {
        return Err(format!("{family}/{name} is there already"));
    }
    let names = Names::new(name);
    let path = library.join(family).join("mod.rs");
    let text = read(&path)?;
    let text = with_module(&text, name).and_then(|text| with_variant(&text, &names));
    let text = text.ok_or_else(|| format!("{}: it does not name {TEMPLATE} as expected", path.display()))?;
    copy(&template, &room, &names)?;
    fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))
}

/// Families that have a template.
fn families(library: &Path) -> Vec<String> {
    let entries = fs::read_dir(library).into_iter().flatten().filter_map(Result::ok);
    let with_template = entries.filter(|entry| entry.path().join(TEMPLATE).is_dir());
    let mut names: Vec<_> = with_template.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The spellings of a room's name.
struct Names {
    /// Word in names of folders, modules and functions, such as `my_room`.
    snake: String,
    /// Word in the command line's flags, such as `my-room`.
    kebab: String,
    /// Word in names of types, such as `MyRoom`.
    camel: String,
    /// Title of the room's page, such as `My room`.
    title: String,
}

impl Names {
    fn new(snake: &str) -> Self {
        let capital = |word: &str| word[..1].to_uppercase() + &word[1..];
        let words = || snake.split('_').filter(|word| !word.is_empty());
        Self {
            snake: snake.to_owned(),
            kebab: snake.replace('_', "-"),
            camel: words().map(capital).collect(),
            title: capital(&words().collect::<Vec<_>>().join(" ")),
        }
    }

    /// A text of the template with the template's name, in every spelling, replaced by this room's.
    fn put_into(&self, text: &str) -> String {
        let text = text.replace(TEMPLATE, &self.snake).replace("new-room", &self.kebab);
        text.replace("NewRoom", &self.camel).replace("New room", &self.title)
    }
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
}

fn copy(from: &Path, to: &Path, names: &Names) -> Result<(), String> {
    let failed = |error| format!("{}: {error}", to.display());
    fs::create_dir(to).map_err(failed)?;
    for entry in fs::read_dir(from).map_err(failed)?.filter_map(Result::ok) {
        let target = to.join(names.put_into(&entry.file_name().to_string_lossy()));
        if entry.path().is_dir() {
            copy(&entry.path(), &target, names)?;
        } else {
            fs::write(target, names.put_into(&read(&entry.path())?)).map_err(failed)?;
        }
    }
    Ok(())
}

/// The text of a family's `mod.rs` with a line for the module `name` among its modules, which are in alphabetical order. `None` where
/// the text does not declare the template's module.
fn with_module(text: &str, name: &str) -> Option<String> {
    let lines: Vec<&str> = text.lines().collect();
    let module = |line: &str| {
        let rest = line.strip_prefix("pub ").or(line.strip_prefix("pub(crate) ")).unwrap_or(line);
        rest.strip_prefix("mod ")?.strip_suffix(';').map(str::to_owned)
    };
    lines.iter().position(|line| module(line).as_deref() == Some(TEMPLATE))?;
    let after = lines.iter().position(|line| module(line).is_some_and(|known| known.as_str() > name));
    let mut at = after.unwrap_or(lines.iter().rposition(|line| module(line).is_some())? + 1);
    while after.is_some() && at > 0 && lines[at - 1].starts_with("#[") {
        at -= 1;
    }
    Some(with_line(&lines, at, &format!("pub mod {name};")))
}

/// The text of a family's `mod.rs` with a line for the room's variant before the template's. `None` where the template has none.
fn with_variant(text: &str, names: &Names) -> Option<String> {
    let lines: Vec<&str> = text.lines().collect();
    let template = lines.iter().position(|line| line.trim() == "NewRoom(new_room::NewRoom),")?;
    let at = template.checked_sub(1).filter(|before| lines[*before].trim() == "#[cfg(test)]")?;
    Some(with_line(&lines, at, &names.put_into(lines[template])))
}

fn with_line(lines: &[&str], at: usize, line: &str) -> String {
    let (before, after) = lines.split_at(at);
    before.iter().chain([&line]).chain(after).flat_map(|line| [*line, "\n"]).collect()
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeMap, path::PathBuf};

    use super::*;

    /// A copy of the library's sources in a temporary folder, which is deleted when this is dropped.
    struct Copy(PathBuf);

    impl Copy {
        fn new(test: &str) -> Self {
            let folder = std::env::temp_dir().join(format!("{test}-{}", std::process::id()));
            // What a test that was killed left.
            let _ = fs::remove_dir_all(&folder);
            for (path, text) in files(&crate::command::workspace().join("crates/lanternfish/src")) {
                let path = folder.join(path);
                fs::create_dir_all(path.parent().unwrap()).unwrap();
                fs::write(path, text).unwrap();
            }
            Self(folder)
        }
    }

    impl Drop for Copy {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    /// Every file below a folder, by its path there.
    fn files(folder: &Path) -> BTreeMap<PathBuf, String> {
        fn visit(folder: &Path, below: &Path, found: &mut BTreeMap<PathBuf, String>) {
            for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
                let (path, below) = (entry.path(), below.join(entry.file_name()));
                if path.is_dir() {
                    visit(&path, &below, found);
                } else if let Ok(text) = fs::read_to_string(&path) {
                    found.insert(below, text);
                }
            }
        }
        let mut found = BTreeMap::new();
        visit(folder, Path::new(""), &mut found);
        found
    }

    /// A new room is a folder, and at most three lines outside of it. (That it compiles, and is its twin, is tested where its template
    /// is: it is a room of the library's tests, and a copy of it differs in names alone.)
    #[test]
    fn a_new_room_is_one_folder_and_few_lines() {
        let library = Copy::new("a_new_room_is_one_folder_and_few_lines");
        let families = families(&library.0);
        assert!(families.contains(&"indirect".to_owned()), "{families:?}");
        for family in families {
            let before = files(&library.0);
            write(&library.0, &family, "room_of_a_test").unwrap();
            let after = files(&library.0);
            let folder = Path::new(&family).join("room_of_a_test");
            let template = Path::new(&family).join(TEMPLATE);
            let (mut lines, mut changed) = (0, Vec::new());
            for (path, text) in &after {
                match before.get(path) {
                    None => {
                        assert!(path.starts_with(&folder), "{path:?} is outside of the room");
                        for word in ["new_room", "new-room", "NewRoom", "New room"] {
                            assert!(!text.contains(word), "{path:?} has the name of the template");
                        }
                    }
                    Some(known) if known != text => {
                        let added = text.lines().filter(|line| line.contains("room_of_a_test")).count();
                        assert_eq!(text.lines().count(), known.lines().count() + added, "{path:?}");
                        lines += added;
                        changed.push(path);
                    }
                    Some(_) => {}
                }
            }
            let count = |folder: &Path| after.keys().filter(|path| path.starts_with(folder)).count();
            assert_eq!(count(&folder), count(&template));
            assert!(count(&folder) >= 5, "shader, host, twin, test and page");
            println!("{family}: one folder, {lines} lines elsewhere, in {changed:?}");
            assert!((1..=3).contains(&lines), "{family}: {lines} lines in {changed:?}");
        }
    }

    #[test]
    fn what_cannot_be_a_room_is_refused_and_nothing_is_written() {
        let library = Copy::new("what_cannot_be_a_room_is_refused");
        let before = files(&library.0);
        for (family, name, what) in [
            ("indirect", "sampled", "there already"),
            ("indirect", "tests", "there already"),
            ("indirect", "Fog", "small letters"),
            ("indirect", "../fog", "small letters"),
            ("indirect", "", "small letters"),
            ("indirect", "none", "another name"),
            ("indirect", "loop", "another name"),
            ("indirect", "indirect_room", "another name"),
            ("nowhere", "fog", "indirect"),
            ("", "fog", "indirect"),
        ] {
            let error = write(&library.0, family, name).unwrap_err();
            assert!(error.contains(what), "{family} {name:?}: {error}");
        }
        assert_eq!(files(&library.0), before);
    }

    #[test]
    fn modules_stay_in_order() {
        let text = "mod a;\n#[cfg(test)]\nmod new_room;\npub mod sampled;\n#[cfg(test)]\nmod tests;\n\nuse x;\n";
        let inserted =
            |name| with_module(text, name).unwrap().lines().position(|line| line == format!("pub mod {name};"));
        assert_eq!(inserted("fog"), Some(1));
        assert_eq!(inserted("pools"), Some(3));
        assert_eq!(inserted("spheres"), Some(4));
        assert_eq!(inserted("voxels"), Some(6));
    }
}
