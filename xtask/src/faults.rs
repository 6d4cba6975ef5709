//! `cargo xtask faults`: which test finds each fault of `xtask/faults.toml` first, and after how long.
//!
//! All faults are built once, into a copy of the sources in `target/faults`, each behind a switch: the variable
//! [`VARIABLE`] names the one that is on. The text of a shader changes where a linker takes it ([`TAKES_TEXT`]), in every
//! process, also in programs that tests start. Tests of this program read sources, and are left out.

use std::{
    collections::{BTreeMap, BTreeSet},
    env, fs,
    io::{BufRead as _, BufReader, Error},
    path::{Path, PathBuf, absolute},
    process::{Command, Stdio},
    time::Instant,
};

use crate::{
    command::{cargo, run as step, run_for_output, workspace},
    files::{self, at, read},
    test::{TARGETS, keep_shaders},
};

const LIST: &str = include_str!("../faults.toml");

/// What an earlier run found (`target/faults.tsv`). A fault's test in it runs before all others.
const TABLE: &str = include_str!("../../docs/measured/faults.tsv");

/// Names the fault that is on.
const VARIABLE: &str = "LANTERNFISH_FAULT";

/// The file and the line in which a linker takes the text of a shader.
const TAKES_TEXT: [&str; 2] = [
    "crates/lanternfish-gpu/src/shader/files.rs",
    "        let text = self.texts.get(&name).map_or(*text, String::as_str);\n",
];

/// The keys of a fault, and their values.
struct Fault<'a>(BTreeMap<&'a str, &'a str>);

impl<'a> Fault<'a> {
    /// Reads a table of literal strings, the only TOML of the list.
    fn of(table: &'a str) -> Self {
        let (mut keys, mut rest) = (BTreeMap::new(), table);
        while let Some((key, value)) = rest.split_once(" = ") {
            // A line break after three quotes is no part of the value.
            let (value, end) = match value.strip_prefix("'''") {
                Some(lines) => (lines.strip_prefix('\n').unwrap_or(lines), "'''"),
                None => (value.strip_prefix('\'').expect("all values are literal strings"), "'"),
            };
            let (value, after) = value.split_once(end).expect("a string ends");
            keys.insert(key.trim(), value);
            rest = after;
        }
        Self(keys)
    }

    fn get(&self, key: &str) -> &'a str {
        self.0.get(key).unwrap_or_else(|| panic!("a fault without {key}: {:?}", self.0))
    }

    /// The name of the package, and the path below `src/` without its ending: of a shader, the module's.
    fn place(&self) -> (&'a str, &'a str) {
        let (package, path) = self.get("file").split_once("/src/").expect("it is a source of a package");
        (package.rsplit('/').next().unwrap_or(package), path.rsplit_once('.').map_or(path, |(path, _)| path))
    }

    /// The test that found the fault when the table was made, as nextest selects it; none if no test did.
    fn found_before(&self) -> String {
        let row = TABLE.lines().map(|row| row.split('\t').collect::<Vec<_>>()).find(|row| row[0] == self.get("name"));
        row.filter(|row| row[2].contains(' ')).map_or_else(|| "none()".to_owned(), |row| only(row[2]))
    }
}

/// A test by its program and name, as nextest selects it.
fn only(test: &str) -> String {
    let (program, name) = test.split_once(' ').unwrap_or_default();
    format!("binary_id(={program}) & test(={name})")
}

fn parse(list: &str) -> Vec<Fault<'_>> {
    list.split("\n[[fault]]\n").skip(1).map(Fault::of).collect()
}

/// Returns an error that names the first fault whose text does not occur once in its file.
fn check(faults: &[Fault<'_>]) -> Result<(), String> {
    let once = |name: &str, file: &str, text: &str| match read(&workspace().join(file))?.matches(text).count() {
        1 => Ok(()),
        count => Err(format!("{name}: {count} times in {file}, not once: {text}")),
    };
    once("the text of shaders", TAKES_TEXT[0], TAKES_TEXT[1])?;
    faults.iter().try_for_each(|fault| once(fault.get("name"), fault.get("file"), fault.get("text")))
}

/// A file's text with the switches of its faults; where a linker takes the text of shaders, those of all shaders.
fn switched(file: &str, mut text: String, faults: &[Fault<'_>]) -> String {
    let (mut arms, lock) = (String::new(), "std::sync::LazyLock");
    for fault in faults {
        let [name, from, by] = ["name", "text", "by"].map(|key| fault.get(key));
        if fault.get("file").ends_with(".wesl") {
            let (_, module) = fault.place();
            arms += &format!("Some({name:?}) if name == {module:?} => &*text.replace({from:?}, {by:?}).leak(),\n");
        } else if fault.get("file") == file {
            let is_on = format!("std::env::var_os({VARIABLE:?}).is_some_and(|on| on == {name:?})");
            let on = format!("static ON: {lock}<bool> = {lock}::new(|| {is_on}); *ON");
            text = text.replace(from, &format!("match {{ {on} }} {{ true => {by}, false => {from} }}"));
        }
    }
    let on = format!("static ON: {lock}<Option<String>> = {lock}::new(|| std::env::var({VARIABLE:?}).ok());");
    let change = format!("{}{on}\nlet text = match ON.as_deref() {{\n{arms}_ => text\n}};\n", TAKES_TEXT[1]);
    if file == TAKES_TEXT[0] { text.replace(TAKES_TEXT[1], &change) } else { text }
}

/// Copies the sources with all faults. Files that stay the same keep their times, so that cargo builds only the others.
fn copy_sources(tree: &Path, faults: &[Fault<'_>]) -> Result<(), String> {
    let listed = ["ls-files", "-co", "--exclude-standard", "-z"];
    let listed = run_for_output(Command::new("git").args(listed).current_dir(workspace()))?;
    let mut copied = BTreeSet::new();
    for name in listed.split('\0').filter(|name| workspace().join(name).is_file()) {
        let (from, to) = (workspace().join(name), tree.join(name));
        let content = String::from_utf8(at(&from, fs::read(&from))?).map(|text| switched(name, text, faults));
        let content = content.map_or_else(|binary| binary.into_bytes(), String::into_bytes);
        if fs::read(&to).ok().as_ref() != Some(&content) {
            files::copy(&from, &to).and_then(|()| files::write(&to, content))?;
        }
        copied.insert(to);
    }
    let mut others = files::below(tree)?.into_iter().filter(|file| !copied.contains(file));
    others.try_for_each(|file| {
        // A crate's folder without a manifest would stop cargo. Only empty folders can be removed.
        at(&file, fs::remove_file(&file)).map(|()| _ = file.ancestors().skip(1).find(|at| fs::remove_dir(at).is_err()))
    })
}

/// A command of cargo in the copy, with the environment of `cargo xtask test` and one fault.
fn in_copy(tree: &Path, fault: &str, words: &[&str]) -> Command {
    let mut command = cargo(words);
    let shared = env::var_os("LANTERNFISH_SHARED").map_or_else(|| workspace().join("../shared"), PathBuf::from);
    command.current_dir(tree).env("CARGO_TARGET_DIR", tree.with_file_name("build"));
    command.env("LANTERNFISH_SHARED", absolute(&shared).unwrap_or(shared)).env(VARIABLE, fault);
    keep_shaders(&mut command);
    command
}

/// Runs tests until one fails: its program and name, and when. `ignored`: `default`, or `only` those of `--full`.
fn first_failure(tree: &Path, fault: &str, filter: &str, ignored: &str) -> Result<Option<(String, Instant)>, String> {
    let words = "nextest run --cargo-quiet --color=never --status-level=fail --failure-output=never --no-tests=pass";
    let words = words.split(' ').chain(["--max-fail=1:immediate", "--run-ignored", ignored, "-E", filter]);
    let words: Vec<_> = words.chain(TARGETS.into_iter().skip(1)).collect();
    let failed = |error: Error| format!("cargo nextest: {error}");
    let mut command = in_copy(tree, fault, &words);
    command.env("LANTERNFISH_FULL", if ignored == "only" { "1" } else { "0" });
    let (mut first, mut said) = (None, Vec::new());
    let mut child = command.stderr(Stdio::piped()).spawn().map_err(failed)?;
    for line in BufReader::new(child.stderr.take().expect("it is piped")).lines() {
        said.push(line.map_err(failed)?);
        first = first.or_else(|| Some((failed_test(said.last()?)?.to_owned(), Instant::now())));
    }
    let status = child.wait().map_err(failed)?;
    if first.is_some() || status.success() { Ok(first) } else { Err(format!("{status}\n{}", said.join("\n"))) }
}

/// The program and name of a test that a line of nextest's says has failed.
fn failed_test(line: &str) -> Option<&str> {
    let (status, rest) = line.trim_start().split_once(" [")?;
    let is_failure = status.bytes().all(|byte| byte.is_ascii_uppercase() || b" +-".contains(&byte)) && status != "PASS";
    // After the time and its number among all.
    is_failure.then(|| rest.rsplit_once(") ").or_else(|| rest.split_once("] ")).map(|(_, test)| test.trim_start()))?
}

/// Who finds a fault (`fast`, `full` or `-`), the first test that fails, and the seconds until then.
type Found = (&'static str, String, f32);

/// Adds tests that fail anyway or by chance, which find nothing, to those that are left `out`.
fn hunt(tree: &Path, fault: &Fault<'_>, is_full: bool, out: &mut String) -> Result<Found, String> {
    let (started, on, first) = (Instant::now(), fault.get("name"), fault.found_before());
    let others = format!("all() - ({first})");
    let tiers = [("fast", "default"), ("full", "only")].into_iter().take(if is_full { 2 } else { 1 });
    for ((tier, ignored), filter) in tiers.flat_map(|tier| [(tier, &first), (tier, &others)]) {
        while let Some((test, when)) = first_failure(tree, on, &format!("({filter}) - ({out})"), ignored)? {
            let alone = only(&test);
            let fails = |on| first_failure(tree, on, &alone, ignored).map(|found| found.is_some());
            if fails(on)? && !fails("")? {
                return Ok((tier, test, (when - started).as_secs_f32()));
            }
            eprintln!("{test} fails without a fault, or not always");
            *out += &format!(" + ({alone})");
        }
    }
    Ok(("-", "MISSED".to_owned(), started.elapsed().as_secs_f32()))
}

/// `cargo xtask faults [NAME...] [--full]`. An error if the fast tests miss more than two of the faults.
pub fn run(words: &[String]) -> Result<(), String> {
    let all = parse(LIST);
    let (full, names): (Vec<&str>, Vec<&str>) = words.iter().map(String::as_str).partition(|word| *word == "--full");
    if let Some(unknown) = names.iter().find(|name| all.iter().all(|fault| fault.get("name") != **name)) {
        return Err(format!("xtask/faults.toml has no fault {unknown}"));
    }
    check(&all)?;
    let (tree, mut out) = (workspace().join("target/faults/tree"), "package(xtask)".to_owned());
    copy_sources(&tree, &all)?;
    step(in_copy(&tree, "", &TARGETS).arg("--no-run"))?;
    let (mut table, mut missed) = ("fault\ttests\tfirst that fails\tseconds\n".to_owned(), 0);
    for fault in all.iter().filter(|fault| names.is_empty() || names.contains(&fault.get("name"))) {
        let (name, (tier, test, seconds)) = (fault.get("name"), hunt(&tree, fault, !full.is_empty(), &mut out)?);
        println!("{name:<31} {tier:<5} {seconds:>5.0} s  {test}");
        table += &format!("{name}\t{tier}\t{test}\t{seconds:.0}\n");
        files::write(&workspace().join("target/faults.tsv"), &table)?;
        missed += usize::from(tier != "fast");
    }
    if missed > 2 { Err(format!("the fast tests miss {missed} faults, more than 2")) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_has_24_faults_that_apply() {
        let faults = parse(LIST);
        check(&faults).unwrap();
        let of = |key| faults.iter().filter_map(|fault| fault.0.get(key)).collect::<BTreeSet<_>>().len();
        assert_eq!((faults.len(), of("name"), of("what"), of("commit")), (24, 24, 24, 12));
        assert!(faults.iter().all(|fault| fault.0.contains_key("commit") == (fault.get("kind") == "mended")));
        let found = faults.iter().filter(|fault| fault.found_before() != "none()").count();
        assert_eq!((TABLE.lines().count(), found), (25, 24), "a header, and a row for each fault with its test");
    }

    #[test]
    fn a_fault_without_its_text_is_named() {
        let list = "\n[[fault]]\nname = 'gone'\nfile = 'xtask/src/main.rs'\ntext = 'no such text'\nby = ''\n";
        assert!(check(&parse(list)).unwrap_err().starts_with("gone: 0 times in xtask/src/main.rs"));
        assert!(check(&parse(&list.replace("no such text", "mod "))).is_err());
    }

    #[test]
    fn only_a_failed_test_is_a_failure() {
        let failed = ["        FAIL [   0.005s] (12/174) a b::gpu_c", "  SIGABRT [   1.2s] a b::gpu_c"];
        assert_eq!(failed.map(failed_test), [Some("a b::gpu_c"); 2]);
        let passed = ["        PASS [   0.1s] (1/2) a b", "     Summary [   0.2s] 3 tests run: 3 passed", "9 | [1] y"];
        assert_eq!(passed.map(failed_test), [None; 3]);
    }
}
