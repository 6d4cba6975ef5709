//! `cargo xtask new-room`: another room of a family. The family's folder holds a room of the name `new_room`, which the library has
//! in its tests alone; the new one is a copy of it under another name, and the lines of the family's own files that name the template
//! are repeated for it.

use std::{fs, path::Path};

/// The room that is copied.
const TEMPLATE: &str = "new_room";

/// Writes the room, formats it, and says what there is to do.
pub fn run(words: &[String]) -> Result<(), String> {
    let [family, name] = words else { return Err("new-room takes a family and a name: new-room indirect fog".into()) };
    let library = crate::command::workspace().join("crates/lanternfish/src");
    let changed = write(&library, family, name)?;
    crate::command::run(&mut crate::command::cargo(["fmt", "--package", "lanternfish"]))?;
    println!(
        "crates/lanternfish/src/{family}/{name}/ is a room, and a line or two of {} name it.",
        changed.join(" and ")
    );
    println!(
        "Its page, its shader and its twin say what it does: change them. cargo xtask test runs its test with all others."
    );
    // Tracers have no flag of their own: whatever traces rays asks for them.
    let flag = match family.as_str() {
        "rays" => "shadows",
        "light_culling" => "culling",
        other => other,
    };
    println!("cargo run --release -- render demo:cornell --{flag} {} -o {name}.png", name.replace('_', "-"));
    Ok(())
}

/// Copies the template of a family below `library`, and names the room where the family's own files name the template. Returns the files
/// that it changed.
fn write(library: &Path, family: &str, name: &str) -> Result<Vec<String>, String> {
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
    // A word of Rust, or a name that a family has already: of a variant, of a trait, or of what chooses a room by itself.
    let words = "abstract async auto await become box break const continue crate default dyn else enum extern false final for impl let loop \
                 macro match mod move mut none override priv pub ref return room self settings static struct super trait true try type \
                 typeof unsafe unsized use virtual where while yield";
    if words.split(' ').any(|word| word == name) || name.ends_with("_room") || name.len() < 3 {
        return Err(format!("{name}: choose another name: it is a word of Rust or of the family"));
    }
    let room = library.join(family).join(name);
    if room.exists() || room.with_extension("rs").exists() {
        return Err(format!("{family}/{name} is there already"));
    }
    let names = Names::new(name);
    let mut changed = Vec::new();
    for entry in fs::read_dir(library.join(family)).map_err(|error| format!("{family}: {error}"))? {
        let path = entry.map_err(|error| format!("{family}: {error}"))?.path();
        if path.extension().is_some_and(|ending| ending == "rs" || ending == "wesl") {
            let text = read(&path)?;
            let named = with_room(&text, &names);
            if named != text {
                changed.push((path, named));
            }
        }
    }
    if !changed.iter().any(|(path, _)| path.ends_with("mod.rs")) {
        return Err(format!("{family}/mod.rs does not name {TEMPLATE}"));
    }
    copy(&template, &room, &names)?;
    for (path, text) in &changed {
        fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    let file = |path: &Path| path.strip_prefix(library).unwrap_or(path).display().to_string();
    Ok(changed.iter().map(|(path, _)| file(path)).collect())
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

/// The text of a family's file with each line that names the template repeated for a room, without the attributes before it: modules
/// stand in alphabetical order, all else before the template.
fn with_room(text: &str, names: &Names) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let templates: Vec<usize> = (0..lines.len()).filter(|at| lines[*at].contains(TEMPLATE)).collect();
    for template in templates.into_iter().rev() {
        let line = names.put_into(&lines[template]);
        if module(&line).is_some() {
            lines.insert(place_of_module(&lines, &names.snake), format!("pub {line}"));
        } else {
            let has_attribute = template > 0 && lines[template - 1].trim() == "#[cfg(test)]";
            lines.insert(if has_attribute { template - 1 } else { template }, line);
        }
    }
    lines.iter().flat_map(|line| [line.as_str(), "\n"]).collect()
}

/// The module that a line declares.
fn module(line: &str) -> Option<&str> {
    let rest = line.strip_prefix("pub ").or(line.strip_prefix("pub(crate) ")).unwrap_or(line);
    rest.strip_prefix("mod ")?.strip_suffix(';')
}

/// Number of the line before which the declaration of the module `name` stands in order.
fn place_of_module(lines: &[String], name: &str) -> usize {
    let Some(mut at) = lines.iter().position(|line| module(line).is_some_and(|known| known > name)) else {
        return lines.iter().rposition(|line| module(line).is_some()).map_or(0, |last| last + 1);
    };
    while at > 0 && lines[at - 1].starts_with("#[") {
        at -= 1;
    }
    at
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
        assert_eq!(families, ["indirect", "light_culling", "occlusion", "rays"]);
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
                        let text = text.to_lowercase();
                        for word in ["new_room", "new-room", "newroom", "new room"] {
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
            ("indirect", "enum", "another name"),
            ("rays", "auto", "another name"),
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
        let inserted = |name: &str| {
            let named = with_room(text, &Names::new(name));
            named.lines().position(|line| line == format!("pub mod {name};"))
        };
        assert_eq!(inserted("fog"), Some(1));
        assert_eq!(inserted("pools"), Some(3));
        assert_eq!(inserted("spheres"), Some(4));
        assert_eq!(inserted("voxels"), Some(6));
    }
}
