//! The tests to run, chosen by the words after `cargo xtask test`.

use std::process::Command;

use crate::command::cargo;

/// All test targets except documentation, and examples, which clippy sees. Every call uses the same list, so that nothing is built twice.
pub const TARGETS: [&str; 5] = ["test", "--workspace", "--lib", "--bins", "--tests"];

/// The programs with unit tests. Programs that start the command line or render are neither built nor linked.
const UNIT_TARGETS: [&str; 4] = ["test", "--workspace", "--lib", "--bins"];

/// Prefix of the last segment of a test's name if the test needs an adapter.
const NEEDS_ADAPTER: &str = "gpu_";

/// Part of the names of unit tests that render for minutes, with the path tracer.
const RENDERS: &str = "tests::light_paths::";

/// Part of the names that libtest skips. Libtest cannot match the last segment only, so this also skips modules below the root
/// with such names; a module `gpu_…` at the root is not skipped.
const SKIP_ADAPTER: &str = "::gpu_";

/// The tests to run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Part of the tests' names.
    filter: Option<String>,
    /// True to run only unit tests that need no adapter and do not render.
    pub is_quick: bool,
    /// True to run the tests that are marked `full`, too, and to check all combinations where else some stand for them.
    pub is_full: bool,
}

impl Selection {
    /// Parses the words after `cargo xtask test`: `[FILTER] [--quick | --full]`.
    pub fn parse(words: &[String]) -> Result<Self, String> {
        let mut selection = Self::default();
        for word in words {
            match word.as_str() {
                "--quick" => selection.is_quick = true,
                "--full" => selection.is_full = true,
                flag if flag.starts_with('-') => return Err(format!("test has no flag {flag}")),
                "" => return Err("test takes part of a name, not an empty one".to_owned()),
                part => {
                    if let Some(first) = selection.filter.replace(part.to_owned()) {
                        return Err(format!("test takes one part of a name, not both {first:?} and {part:?}"));
                    }
                }
            }
        }
        if selection.is_quick && selection.is_full {
            return Err("test takes --quick or --full, not both".to_owned());
        }
        Ok(selection)
    }

    /// True if documentation tests run too.
    pub fn has_documentation(&self) -> bool {
        self.is_full && self.filter.is_none()
    }

    /// True if no test was selected by name.
    pub fn is_tier(&self) -> bool {
        self.filter.is_none()
    }

    /// True if the test of this name, which is marked `full`, runs.
    pub fn includes_full(&self, name: &str) -> bool {
        self.is_full && self.filter.is_none() || self.filter.as_ref().is_some_and(|filter| name.contains(filter))
    }

    /// True if tests marked `full` run: a filter that names one means it.
    pub fn has_full(&self) -> bool {
        self.is_full || self.filter.is_some()
    }

    /// Nextest's profile, and the name of the folder of its results.
    pub fn profile(&self) -> &'static str {
        if self.is_quick { "quick" } else { "default" }
    }

    /// Builds the tests.
    pub fn build(&self) -> Command {
        let mut command = cargo(self.targets());
        command.arg("--no-run");
        command
    }

    /// Runs the tests with nextest. It does not fail without tests: [`Selection::check`] gives a better message.
    pub fn nextest(&self) -> Command {
        let mut command = cargo(["nextest", "run", "--workspace", "--profile", self.profile()]);
        command.env("NEXTEST_NO_TESTS", "pass");
        command.args(&self.targets()[2..]);
        if self.has_full() {
            command.args(["--run-ignored", "all"]);
        }
        command.args(&self.filter);
        command
    }

    /// Lists the tests that are marked `full`, with nextest: a line each, program and name.
    pub fn list_full() -> Command {
        let words = ["nextest", "list"].iter().chain(&TARGETS[1..]);
        cargo(words.chain(&["--run-ignored", "ignored-only", "--message-format", "oneline"]))
    }

    /// Runs the tests without nextest, with further words for libtest.
    pub fn libtest<S: AsRef<str>>(&self, words: impl IntoIterator<Item = S>) -> Command {
        let mut command = cargo(self.targets());
        command.args(["--no-fail-fast", "--"]);
        command.args(words.into_iter().map(|word| word.as_ref().to_owned()));
        if self.is_quick {
            command.args(["--skip", SKIP_ADAPTER, "--skip", RENDERS]);
        }
        command.args(&self.filter);
        command
    }

    fn targets(&self) -> &'static [&'static str] {
        if self.is_quick { &UNIT_TARGETS } else { &TARGETS }
    }

    /// Returns an error if no test ran, or if a test ran that the selection excludes.
    pub fn check(&self, names: &[&str]) -> Result<(), String> {
        let quick = if self.is_quick { " among the quick ones" } else { "" };
        if names.is_empty() {
            return Err(match &self.filter {
                Some(part) => format!("no test{quick} has a name that contains {part:?}"),
                None => format!("there is no test{quick}"),
            });
        }
        match names.iter().find(|name| self.is_quick && needs_adapter(name)) {
            Some(name) => Err(format!("{name} needs an adapter, and --quick ran it")),
            None => Ok(()),
        }
    }
}

/// True if a test needs an adapter, by its name.
fn needs_adapter(name: &str) -> bool {
    name.rsplit("::").next().is_some_and(|last| last.starts_with(NEEDS_ADAPTER))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{command::workspace, files};

    fn parse(line: &str) -> Result<Selection, String> {
        Selection::parse(&line.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
    }

    fn words(command: &Command) -> String {
        command.get_args().map(|word| word.to_str().unwrap()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn words_are_a_filter_and_quick_or_full() {
        let fast = Selection::default();
        assert_eq!(parse(""), Ok(fast.clone()));
        assert_eq!(parse("--full"), Ok(Selection { is_full: true, ..fast }));
        let filter = Some("scan".to_owned());
        assert_eq!(parse("scan --quick"), Ok(Selection { filter: filter.clone(), is_quick: true, is_full: false }));
        assert_eq!(parse("--quick scan"), parse("scan --quick"));
        assert_eq!(parse("scan"), Ok(Selection { filter, ..Selection::default() }));
        assert!(Selection::parse(&[String::new()]).unwrap_err().contains("empty"));
        for (line, error) in [
            ("--fast", "test has no flag --fast"),
            ("scan sort", "test takes one part of a name, not both \"scan\" and \"sort\""),
            ("--quick --full", "test takes --quick or --full, not both"),
        ] {
            assert_eq!(parse(line).unwrap_err(), error);
        }
    }

    #[test]
    fn documentation_tests_run_only_with_all_tests() {
        let runs = |line| parse(line).unwrap().has_documentation();
        assert!(runs("--full"));
        assert!(!runs("") && !runs("scan") && !runs("--quick") && !runs("--full scan"));
    }

    #[test]
    fn commands_name_the_selection() {
        let quick = parse("scan --quick").unwrap();
        assert_eq!(words(&quick.build()), "test --workspace --lib --bins --no-run");
        assert_eq!(
            words(&quick.nextest()),
            "nextest run --workspace --profile quick --lib --bins --run-ignored all scan"
        );
        assert_eq!(
            words(&quick.libtest(["--list"])),
            "test --workspace --lib --bins --no-fail-fast -- --list --skip ::gpu_ --skip tests::light_paths:: scan"
        );
        let fast = parse("").unwrap();
        assert_eq!(words(&fast.build()), format!("{} --no-run", TARGETS.join(" ")));
        assert_eq!(words(&fast.nextest()), "nextest run --workspace --profile default --lib --bins --tests");
        assert_eq!(words(&fast.libtest([""; 0])), format!("{} --no-fail-fast --", TARGETS.join(" ")));
        let full = parse("--full").unwrap();
        assert_eq!(
            words(&full.nextest()),
            "nextest run --workspace --profile default --lib --bins --tests --run-ignored all"
        );
    }

    #[test]
    fn full_tests_run_by_flag_or_by_name() {
        let includes = |line| parse(line).unwrap().includes_full("window::soak");
        assert!(includes("--full") && includes("soak") && includes("soak --full"));
        assert!(!includes("") && !includes("--quick") && !includes("scan --full"));
    }

    #[test]
    fn no_test_at_all_is_an_error() {
        let error = |line| parse(line).unwrap().check(&[]).unwrap_err();
        assert_eq!(error("scna"), "no test has a name that contains \"scna\"");
        assert_eq!(error("scna --quick"), "no test among the quick ones has a name that contains \"scna\"");
        assert_eq!(error(""), "there is no test");
    }

    #[test]
    fn tests_that_need_an_adapter_are_not_quick() {
        let names = ["gpu_scene::tests::counts", "primitives::scan::tests::gpu_scan"];
        assert!(!needs_adapter(names[0]) && needs_adapter(names[1]) && needs_adapter("gpu_scan"));
        assert_eq!(parse("--quick").unwrap().check(&names[..1]), Ok(()));
        assert!(parse("--quick").unwrap().check(&names).unwrap_err().starts_with(names[1]));
        assert_eq!(parse("").unwrap().check(&names), Ok(()));
        // Nextest's profile has the same rules.
        let profiles = std::fs::read_to_string(workspace().join(".config/nextest.toml")).unwrap();
        let rule = |start| profiles.lines().find_map(|line: &str| line.strip_prefix(start)).unwrap().trim_matches('\'');
        let gpu = format!("test(/(^|::){NEEDS_ADAPTER}[^:]*$/)");
        assert_eq!(rule("filter = "), gpu);
        assert_eq!(rule("default-filter = "), format!("(kind(lib) + kind(bin)) - {gpu} - test({RENDERS})"));
    }

    /// Otherwise libtest would skip more tests than nextest.
    #[test]
    fn no_module_below_a_root_has_the_prefix_of_adapter_tests() {
        for package in crate::command::packages() {
            let root = package.join("src");
            for file in files::below(&root).unwrap().iter().filter(|file| file.extension().is_some_and(|e| e == "rs")) {
                let mut parts = file.strip_prefix(&root).unwrap().iter().skip(1);
                let has_prefix = parts.any(|part| part.to_string_lossy().starts_with(NEEDS_ADAPTER));
                assert!(!has_prefix, "{}", file.display());
            }
        }
    }
}
