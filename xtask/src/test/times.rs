//! The tests that ran, with their times from nextest's JUnit file, or without times from libtest's list.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::command::workspace;

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
