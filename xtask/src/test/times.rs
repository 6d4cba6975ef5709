//! The tests that ran, with their times from nextest's JUnit file, or without times from libtest's list.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use crate::command::workspace;

/// Seconds below which a folder is a part of its program's row.
const LEAST_OF_ROW: f64 = 10.0;

/// Number of slowest tests to print.
pub const SLOWEST: usize = 20;

/// A test that ran.
#[derive(Debug, PartialEq)]
pub struct Test {
    /// The test program, as named by nextest; empty if unknown.
    program: String,
    pub name: String,
    seconds: f64,
}

/// The JUnit file of a nextest profile. Its folder does not follow cargo's target folder.
pub struct JUnit(PathBuf);

impl JUnit {
    pub fn of(profile: &str) -> Self {
        Self(workspace().join("target/nextest").join(profile).join("junit.xml"))
    }

    /// Removes the file, so that results of an earlier run are not read.
    pub fn remove(&self) {
        let _ = fs::remove_file(&self.0);
    }

    /// The tests; empty if no test ran.
    pub fn tests(&self) -> Vec<Test> {
        junit_tests(&fs::read_to_string(&self.0).unwrap_or_default())
    }

    pub fn path(&self) -> &Path {
        self.0.strip_prefix(workspace()).unwrap_or(&self.0)
    }
}

/// Parses the test cases of a JUnit file. Output of tests contains no `<` there.
fn junit_tests(xml: &str) -> Vec<Test> {
    let cases = xml.split("<testcase").skip(1).filter_map(|rest| rest.split_once('>'));
    let test = |(attributes, _)| {
        let program = attribute(attributes, "classname")?;
        Some(Test {
            program,
            name: attribute(attributes, "name")?,
            seconds: attribute(attributes, "time")?.parse().ok()?,
        })
    };
    cases.filter_map(test).collect()
}

/// The value of `name="value"` among attributes.
fn attribute(attributes: &str, name: &str) -> Option<String> {
    let (_, rest) = attributes.split_once(&format!(" {name}=\""))?;
    rest.split_once('"').map(|(value, _)| value.to_owned())
}

/// The tests in nextest's list with a line each: program and name.
pub fn nextest_tests(list: &str) -> Vec<Test> {
    let test = |(program, name): (&str, &str)| Test { program: program.into(), name: name.into(), seconds: 0.0 };
    list.lines().filter_map(|line| line.split_once(' ')).map(test).collect()
}

/// Number and seconds of the tests of each folder, a line each: those that always run, and those of `full`. A folder is the first
/// module of a test's name; small ones are one row for their program.
pub fn by_folder(tests: &[Test], full: &[Test]) -> Vec<String> {
    let mut rows = BTreeMap::<(&str, &str), [(usize, f64); 2]>::new();
    for test in tests {
        let folder = test.name.split_once("::").map_or("", |(folder, _)| folder);
        let is_full = full.iter().any(|other| other.program == test.program && other.name == test.name);
        let (count, seconds) = &mut rows.entry((&test.program, folder)).or_default()[usize::from(is_full)];
        (*count, *seconds) = (*count + 1, *seconds + test.seconds);
    }
    let mut merged = BTreeMap::<(&str, &str), [(usize, f64); 2]>::new();
    for ((program, folder), row) in rows {
        let folder = if row[0].1 + row[1].1 < LEAST_OF_ROW { "others" } else { folder };
        let sum = merged.entry((program, folder)).or_default();
        sum.iter_mut().zip(row).for_each(|(sum, row)| *sum = (sum.0 + row.0, sum.1 + row.1));
    }
    let line = |(name, [fast, full]): (String, [(usize, f64); 2])| {
        format!("{:6} {:7.0} s {:6} {:7.0} s  {name}", fast.0, fast.1, full.0, full.1)
    };
    let sum = |tier: usize| merged.values().fold((0, 0.0), |sum, row| (sum.0 + row[tier].0, sum.1 + row[tier].1));
    let all = ("all".to_owned(), [sum(0), sum(1)]);
    let head = " tests      fast  tests      full  program and folder".to_owned();
    let rows = merged.iter().map(|((program, folder), row)| line((format!("{program} {folder}"), *row)));
    [head].into_iter().chain(rows).chain([line(all)]).collect()
}

/// The tests in libtest's list, without ignored ones.
pub fn listed_tests(all: &str, ignored: &str) -> Vec<Test> {
    let names = |list: &str| list.lines().filter_map(|line| Some(line.strip_suffix(": test")?.to_owned())).collect();
    let (mut all, ignored): (Vec<String>, Vec<String>) = (names(all), names(ignored));
    for name in ignored {
        // Programs may have tests with the same name.
        if let Some(at) = all.iter().position(|other| *other == name) {
            all.remove(at);
        }
    }
    all.into_iter().map(|name| Test { program: String::new(), name, seconds: 0.0 }).collect()
}

/// The slowest tests, one line each, the slowest first.
pub fn slowest(tests: &[Test]) -> Vec<String> {
    let mut tests: Vec<&Test> = tests.iter().collect();
    tests.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    tests.iter().take(SLOWEST).map(|test| format!("{:8.1} s  {} {}", test.seconds, test.program, test.name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const XML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<testsuites name="nextest-run" tests="3" failures="1" time="9.5">
    <testsuite name="lanternfish" tests="2" disabled="0" errors="0" failures="1">
        <testcase name="rays::tests::gpu_rays" classname="lanternfish" timestamp="2026-11-27T01:45:40.000+00:00" time="2.500">
            <failure type="test failure">time=&quot;1&quot; &lt;testcase name=&quot;none&quot;</failure>
        </testcase>
        <testcase name="lights::tests::one" classname="lanternfish" timestamp="2026-11-27T01:45:40.000+00:00" time="0.004"/>
    </testsuite>
    <testsuite name="lanternfish-cli::command_line" tests="1">
        <testcase name="shot::is_read" classname="lanternfish-cli::command_line" time="7.000" />
    </testsuite>
</testsuites>"#;

    #[test]
    fn test_cases_are_read_and_the_slowest_come_first() {
        let tests = junit_tests(XML);
        assert_eq!(tests.len(), 3);
        let first = Test { program: "lanternfish".to_owned(), name: "rays::tests::gpu_rays".to_owned(), seconds: 2.5 };
        assert_eq!(tests[0], first);
        assert_eq!(
            slowest(&tests),
            [
                "     7.0 s  lanternfish-cli::command_line shot::is_read",
                "     2.5 s  lanternfish rays::tests::gpu_rays",
                "     0.0 s  lanternfish lights::tests::one",
            ]
        );
    }

    #[test]
    fn times_are_summed_by_folder_and_tier() {
        let test = |program: &str, name: &str, seconds| Test { program: program.into(), name: name.into(), seconds };
        let tests = [
            test("lanternfish", "rays::tests::gpu_rays", 8.0),
            test("lanternfish", "rays::tests::gpu_walk", 40.0),
            test("lanternfish", "lights::tests::one", 1.0),
            test("lanternfish", "sky::tests::two", 2.0),
        ];
        let full = nextest_tests("lanternfish rays::tests::gpu_walk\nlanternfish-cli rays::tests::gpu_rays\n");
        assert_eq!(
            by_folder(&tests, &full)[1..],
            [
                "     2       3 s      0       0 s  lanternfish others",
                "     1       8 s      1      40 s  lanternfish rays",
                "     3      11 s      1      40 s  all",
            ]
        );
    }

    #[test]
    fn the_list_of_slowest_tests_is_limited() {
        let test = |seconds| Test { program: String::new(), name: String::new(), seconds };
        assert_eq!(slowest(&(0..50).map(|i| test(f64::from(i))).collect::<Vec<_>>()).len(), SLOWEST);
    }

    #[test]
    fn a_file_without_tests_has_none() {
        for xml in ["", "<testsuites name=\"nextest-run\" tests=\"0\"/>", "<testcase name=\"cut off"] {
            assert_eq!(junit_tests(xml), []);
        }
    }

    #[test]
    fn listed_tests_run_unless_ignored() {
        let all = "a::one: test\nb::two: test\n\n2 tests, 0 benchmarks\na::one: test\n\n1 test, 0 benchmarks\n";
        let names = |ignored| listed_tests(all, ignored).into_iter().map(|test| test.name).collect::<Vec<_>>();
        assert_eq!(names(""), ["a::one", "b::two", "a::one"]);
        assert_eq!(names("a::one: test\n\n1 test, 0 benchmarks\n"), ["b::two", "a::one"]);
    }
}
