//! `cargo xtask test`: runs the fast tests, with `--full` all, or those of a name, or the quick ones.
//!
//! A test that cannot run here (no ray query, no shared assets) passes and appends a line to the file that
//! `LANTERNFISH_LEFT_OUT` names:
//! - `LEFT OUT: name: reason`: the adapter lacks support. A failure if `LANTERNFISH_REQUIRE_ALL` is 1.
//! - `LEFT OUT (shared): name: reason`: assets outside the repository are missing. Never a failure.

mod selection;
mod times;

use std::{
    env::{self, consts::EXE_SUFFIX},
    fs,
    path::{Path, PathBuf},
    process::Command,
    thread,
    time::{Duration, Instant},
};

use crate::{
    command::{cargo, run as step, run_for_output, succeeds},
    driver, web,
};

use selection::Selection;
use times::{JUnit, SLOWEST, Test};

pub use selection::TARGETS;

/// Prefix of a line about missing support of the adapter.
const LEFT_OUT: &str = "LEFT OUT: ";

/// Concurrent tests without nextest; `gpu` in `.config/nextest.toml`.
const MOST_AT_ONCE: usize = 4;

/// The adapter name for quick tests. No adapter has this name: a test that opens one fails wherever there is a driver.
const NO_ADAPTER: &str = "none-for-quick-tests";

pub fn run(words: &[String], may_install: bool) -> Result<(), String> {
    let selection = Selection::parse(words)?;
    let started = Instant::now();
    if !selection.is_quick {
        driver::before_build(may_install)?;
    }
    let (built, build_time) = timed(|| step(&mut selection.build()));
    built?;
    if !selection.is_quick {
        // The tests of the command line build its program beside this one.
        let here = env::current_exe().map_err(|error| format!("path of this program: {error}"))?;
        let lanternfish = here.with_file_name(format!("lanternfish{EXE_SUFFIX}"));
        driver::after_build(may_install, true, || {
            let mut command = Command::new(&lanternfish);
            command.args(["info", "--adapters"]);
            command
        })?;
    }

    let browser = web::for_tests(|test| selection.includes_full(test))?;
    let list = List::new();
    let prepare = |mut command: Command| {
        command.env("LANTERNFISH_LEFT_OUT", &list.0).envs(browser.iter().map(|(name, value)| (name, value)));
        keep_shaders(&mut command);
        if selection.is_quick {
            command.env("LANTERNFISH_TEST_ADAPTER", NO_ADAPTER);
        }
        if selection.is_full {
            command.env("LANTERNFISH_FULL", "1");
        }
        command
    };
    // A failure in documentation does not prevent other tests.
    let (documented, documentation_time) = timed(|| {
        let mut command = prepare(cargo(["test", "--workspace", "--doc"]));
        if selection.has_documentation() { step(&mut command) } else { Ok(()) }
    });
    let ((result, tests, full), run_time) = timed(|| run_tests(&selection, prepare));

    let left_out = list.lines();
    if left_out.is_empty() {
        eprintln!("\nnothing was left out");
    } else {
        eprintln!("\nleft out:\n  {}", left_out.join("\n  "));
    }
    let seconds = |time: Duration| format!("{:.0} s", time.as_secs_f64());
    let documentation = match selection.has_documentation() {
        true => format!("the tests in documentation {}, the others ", seconds(documentation_time)),
        false => "the tests ".to_owned(),
    };
    eprintln!(
        "{} tests ran. Building took {}, {documentation}{}, everything {}.",
        tests.len(),
        seconds(build_time),
        seconds(run_time),
        seconds(started.elapsed())
    );
    documented.and(result)?;
    selection.check(&tests.iter().map(|test| test.name.as_str()).collect::<Vec<_>>())?;
    check_left_out(&left_out, env::var_os("LANTERNFISH_REQUIRE_ALL").is_some_and(|value| value == "1"))?;
    let is_fast = !selection.is_quick && !selection.has_full();
    let more = if is_fast { format!(" {} more run with --full.", full.len()) } else { String::new() };
    eprintln!("All of them passed.{more}");
    Ok(())
}

/// Runs each selected test once and returns those that ran, including failed ones, and those that are marked `full`. Prints the
/// slowest if nextest is installed, and the times of folders if nothing was selected by name.
fn run_tests(
    selection: &Selection,
    prepare: impl Fn(Command) -> Command,
) -> (Result<(), String>, Vec<Test>, Vec<Test>) {
    // Nextest, in a version that supports the project's profiles.
    if succeeds(&mut cargo(["nextest", "show-config", "version"])) {
        let junit = JUnit::of(selection.profile());
        junit.remove();
        let result = step(&mut prepare(selection.nextest()));
        let tests = junit.tests();
        let mut full = Vec::new();
        if selection.is_tier() && !selection.is_quick {
            full = run_for_output(&mut Selection::list_full()).map_or(full, |list| times::nextest_tests(&list));
            eprintln!("\n{}", times::by_folder(&tests, &full).join("\n"));
        }
        if !tests.is_empty() {
            eprintln!("\nthe slowest tests, {SLOWEST} at most:\n{}", times::slowest(&tests).join("\n"));
            eprintln!("the time of every test: {}", junit.path().display());
        }
        return (result, tests, full);
    }
    let list = |words: &[&str]| run_for_output(&mut prepare(selection.libtest(words)));
    let (tests, full) = match (list(&["--list"]), list(&["--list", "--ignored"])) {
        (Ok(all), Ok(ignored)) => {
            let full = times::listed_tests(&ignored, "");
            (times::listed_tests(&all, if selection.has_full() { "" } else { &ignored }), full)
        }
        (Err(error), _) | (_, Err(error)) => return (Err(error), Vec::new(), Vec::new()),
    };
    // At most as many at a time as configured for nextest.
    let threads = thread::available_parallelism().map_or(1, |count| count.get().min(MOST_AT_ONCE));
    let result = match tests.is_empty() {
        // The caller prints the message.
        true => Ok(()),
        false => step(&mut prepare(
            selection.libtest(
                [format!("--test-threads={threads}")]
                    .into_iter()
                    .chain(selection.has_full().then(|| "--include-ignored".into())),
            ),
        )),
    };
    eprintln!("\ncargo-nextest 0.9.77 or later shows the time of each test");
    (result, tests, full)
}

/// Lets all tests share the shaders that Mesa's software adapter compiled, which takes most of a rendering test's time: 88 of 97 s of CPU time in one
/// that was measured. Left alone, Mesa divides its cache into 50 parts of 20 MB and uses one of them: two versions of all shaders fill it.
pub fn keep_shaders(command: &mut Command) {
    let ours = ["MESA_DISK_CACHE_MULTI_FILE", "MESA_SHADER_CACHE_DIR"];
    let target = env::current_exe().ok().and_then(|here| Some(here.parent()?.parent()?.to_owned()));
    if let Some(target) = target.filter(|_| ours.iter().all(|name| env::var_os(name).is_none())) {
        command.env(ours[0], "1").env(ours[1], target.join("shader_cache"));
    }
}

fn timed<T>(run: impl FnOnce() -> T) -> (T, Duration) {
    let started = Instant::now();
    (run(), started.elapsed())
}

/// Returns an error if a required test did not run.
fn check_left_out(lines: &[String], all_required: bool) -> Result<(), String> {
    let count = lines.iter().filter(|line| line.starts_with(LEFT_OUT)).count();
    if all_required && count > 0 {
        return Err(format!("{count} tests were left out, and LANTERNFISH_REQUIRE_ALL=1 wants all of them"));
    }
    Ok(())
}

/// The file that tests append to. Removed on drop.
struct List(PathBuf);

impl List {
    fn new() -> Self {
        let path = env::temp_dir().join(format!("lanternfish-left-out-{}", std::process::id()));
        // Remove the file of a killed process with the same id.
        let _ = fs::remove_file(&path);
        Self(path)
    }

    /// Sorted lines without duplicates: a test may run in several ways.
    fn lines(&self) -> Vec<String> {
        sorted_lines(&fs::read_to_string(Path::new(&self.0)).unwrap_or_default())
    }
}

impl Drop for List {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

fn sorted_lines(text: &str) -> Vec<String> {
    let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
    lines.sort();
    lines.dedup();
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_adapter_support_fails_only_if_all_tests_are_required() {
        let lines = sorted_lines(
            "LEFT OUT (shared): sponza: no assets\nLEFT OUT: rays: no ray query\nLEFT OUT: rays: no ray query\n",
        );
        assert_eq!(lines.len(), 2);
        assert!(check_left_out(&lines, true).unwrap_err().starts_with("1 tests"));
        assert_eq!(check_left_out(&lines, false), Ok(()));
        assert_eq!(check_left_out(&lines[..1], true), Ok(()));
    }
}
