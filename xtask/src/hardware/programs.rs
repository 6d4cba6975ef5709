//! The programs of the kit: built by cargo, without symbols.

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;

use crate::command::{find_program, run, run_for_output};

/// A program that cargo builds.
pub struct Program {
    /// Name of its package, and of its folder below `crates`.
    package: &'static str,
    /// Cargo's kind of target: `bin`, `lib` or `test`.
    kind: &'static str,
    /// The target's name, if the package may have several of this kind.
    target: Option<&'static str>,
    /// True if it is built as a test.
    is_test: bool,
    /// Its name in the kit.
    pub name: &'static str,
}

/// The command line, and the benches.
pub const RELEASED: [Program; 2] = [
    Program { package: "lanternfish-cli", kind: "bin", target: None, is_test: false, name: "lanternfish" },
    Program { package: "lanternfish-bench", kind: "bin", target: None, is_test: false, name: "lanternfish-bench" },
];

/// The programs that hold the tests of passes and images.
pub const TESTS: [Program; 4] = [
    Program { package: "lanternfish-gpu", kind: "lib", target: None, is_test: true, name: "lanternfish-gpu" },
    Program { package: "lanternfish", kind: "lib", target: None, is_test: true, name: "lanternfish" },
    Program { package: "lanternfish", kind: "test", target: Some("renderings"), is_test: true, name: "renderings" },
    Program { package: "lanternfish-papers", kind: "lib", target: None, is_test: true, name: "lanternfish-papers" },
];

/// Builds with cargo. Returns its messages, one line of JSON each.
pub fn build(command: &mut Command) -> Result<String, String> {
    run_for_output(command.arg("--message-format=json-render-diagnostics"))
}

impl Program {
    /// Its path, from cargo's messages.
    pub fn find(&self, messages: &str) -> Result<PathBuf, String> {
        let messages = messages.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
        let mut paths = messages.filter_map(|message| self.path_of(&message));
        paths.next().ok_or_else(|| format!("cargo built no {} of package {}", self.kind, self.package))
    }

    /// The path in a message about this program.
    fn path_of(&self, message: &Value) -> Option<PathBuf> {
        let target = &message["target"];
        let manifest = Path::new(message["manifest_path"].as_str()?);
        let is_this = message["reason"] == "compiler-artifact"
            && manifest.parent().and_then(Path::file_name) == Some(OsStr::new(self.package))
            && target["kind"].as_array()?.iter().any(|kind| kind == self.kind)
            && self.target.is_none_or(|name| target["name"] == name)
            && message["profile"]["test"] == self.is_test;
        // A library that is not a test has no executable.
        message["executable"].as_str().filter(|_| is_this).map(PathBuf::from)
    }
}

/// Returns an error if symbols cannot be stripped.
pub fn check_strip() -> Result<(), String> {
    match find_program("strip") {
        Some(_) => Ok(()),
        None => Err("no `strip`, without which the programs are too large: install binutils".to_owned()),
    }
}

/// Copies a program without symbols.
pub fn strip(program: &Path, copy: &Path) -> Result<(), String> {
    run(Command::new("strip").arg("-o").args([copy, program]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Messages of cargo, with fewer fields.
    const MESSAGES: &str = r#"
{"reason":"compiler-artifact","manifest_path":"/w/crates/lanternfish/Cargo.toml","target":{"kind":["lib"],"name":"lanternfish"},"profile":{"test":false},"executable":null}
{"reason":"compiler-artifact","manifest_path":"/w/crates/lanternfish/Cargo.toml","target":{"kind":["lib"],"name":"lanternfish"},"profile":{"test":true},"executable":"/t/lanternfish-1"}
{"reason":"compiler-artifact","manifest_path":"/w/crates/lanternfish-cli/Cargo.toml","target":{"kind":["bin"],"name":"lanternfish"},"profile":{"test":true},"executable":"/t/lanternfish-2"}
{"reason":"compiler-artifact","manifest_path":"/w/crates/lanternfish-cli/Cargo.toml","target":{"kind":["bin"],"name":"lanternfish"},"profile":{"test":false},"executable":"/t/lanternfish"}
{"reason":"compiler-artifact","manifest_path":"/w/crates/lanternfish-cli/Cargo.toml","target":{"kind":["lib"],"name":"lanternfish_cli"},"profile":{"test":false},"executable":null}
{"reason":"compiler-artifact","manifest_path":"/w/papers/lanternfish-bench/Cargo.toml","target":{"kind":["bin"],"name":"lanternfish-bench"},"profile":{"test":false},"executable":"/t/lanternfish-bench"}
{"reason":"compiler-artifact","manifest_path":"/w/crates/lanternfish/Cargo.toml","target":{"kind":["test"],"name":"other"},"profile":{"test":true},"executable":"/t/other-3"}
{"reason":"compiler-artifact","manifest_path":"/w/crates/lanternfish/Cargo.toml","target":{"kind":["test"],"name":"renderings"},"profile":{"test":true},"executable":"/t/renderings-4"}
not JSON
{"reason":"build-finished","success":true}
"#;

    #[test]
    fn programs_are_parsed_from_the_messages_of_cargo() {
        let find = |program: &Program| program.find(MESSAGES);
        assert_eq!(find(&RELEASED[0]), Ok("/t/lanternfish".into()));
        assert_eq!(find(&RELEASED[1]), Ok("/t/lanternfish-bench".into()));
        assert_eq!(find(&TESTS[1]), Ok("/t/lanternfish-1".into()));
        assert_eq!(find(&TESTS[2]), Ok("/t/renderings-4".into()));
        assert_eq!(find(&TESTS[0]), Err("cargo built no lib of package lanternfish-gpu".to_owned()));
    }
}
