//! Runs parts, each as a process of its own, and keeps what they write.

use std::{
    env, fs,
    path::Path,
    process::{Command, Stdio},
    time::Instant,
};

use lanternfish_cli::{error::CliError, output::write_text};
use serde_json::{Value, json};

use super::{
    parts::{Part, TRACK},
    query::Found,
};
use crate::bench::make_folder;

/// The file that says with which arguments a part was made; it is there only of complete ones.
const ARGUMENTS: &str = "arguments.json";
/// Lines of a program's error that are told.
const LINES: usize = 4;

/// What became of a part.
#[derive(Debug)]
pub struct Ran {
    pub outcome: Found<Value>,
    /// None where it was made before.
    pub seconds: Option<f64>,
}

/// What `arguments.json` has. `adapter`: its name.
pub fn made_with(arguments: &[String], adapter: &str) -> Value {
    json!({ "version": env!("CARGO_PKG_VERSION"), "adapter": adapter, "arguments": arguments })
}

/// What a part left in its folder, if it is complete and was made so.
pub fn kept(part: &Part, folder: &Path, made_with: &Value) -> Option<Value> {
    let known: Value = serde_json::from_slice(&fs::read(folder.join(ARGUMENTS)).ok()?).ok()?;
    if known == *made_with { product(part, folder).ok() } else { None }
}

/// The report that a part wrote, or the text of its plot.
fn product(part: &Part, folder: &Path) -> Found<Value> {
    let text =
        fs::read_to_string(folder.join(part.product())).map_err(|error| format!("{}: {error}", part.product()))?;
    if part.product().ends_with(".svg") {
        let is_whole = text.trim_end().ends_with("</svg>");
        return if is_whole { Ok(text.into()) } else { Err("the plot is not complete".to_owned()) };
    }
    serde_json::from_str(&text).map_err(|error| format!("{}: {error}", part.product()))
}

/// Runs a part, and reads what it wrote. An error only where nothing can be written.
pub fn run(part: &Part, arguments: &[String], folder: &Path, made_with: &Value) -> Result<Ran, CliError> {
    make_folder(folder)?;
    // Those of an earlier run are not this one's; what the path tracer left is found again.
    for name in [ARGUMENTS, part.product()] {
        let _ = fs::remove_file(folder.join(name));
    }
    if arguments.iter().any(|argument| Path::new(argument) == folder.join(TRACK.0)) {
        write_text(&folder.join(TRACK.0), TRACK.1)?;
    }
    let started = Instant::now();
    let program = env::current_exe().map_err(|error| CliError::new(error, "start the program by its path"))?;
    let output = Command::new(program).args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).output();
    let outcome = match output {
        Err(error) => Err(error.to_string()),
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stderr);
            write_text(&folder.join("errors.txt"), &said)?;
            if output.status.success() {
                product(part, folder)
            } else {
                Err(last_lines(&said, &output.status.to_string()))
            }
        }
    };
    if outcome.is_ok() {
        write_text(&folder.join(ARGUMENTS), &format!("{made_with:#}\n"))?;
    }
    Ok(Ran { outcome, seconds: Some(started.elapsed().as_secs_f64()) })
}

/// The last lines of what a program says when it fails, in one; its status where it says nothing.
fn last_lines(said: &str, status: &str) -> String {
    let lines: Vec<&str> = said.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let last = lines[lines.len().saturating_sub(LINES)..].join(" / ");
    if last.is_empty() { status.to_owned() } else { last }
}

#[cfg(test)]
mod tests {
    use super::{super::parts::parts, *};

    #[test]
    fn only_what_is_complete_and_made_so_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let (part, write) = (&parts()[0], |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap());
        let words = ["forward-plus".to_owned(), "demo:atrium".to_owned()];
        let with = made_with(&words, "card");
        let kept = |with: &Value| kept(part, folder.path(), with);
        assert_eq!(kept(&with), None, "nothing is there");
        write("report.json", "{\"rows\": []}");
        assert_eq!(kept(&with), None, "it was cut off before it said with what it was made");
        write(ARGUMENTS, &with.to_string());
        assert_eq!(kept(&with), Some(json!({ "rows": [] })));
        assert_eq!(kept(&made_with(&words[..1], "card")), None, "other arguments");
        assert_eq!(kept(&made_with(&words, "another card")), None, "another adapter");
        write("report.json", "{\"rows\": [");
        assert_eq!(kept(&with), None, "half a report");
    }

    /// The program of the tests stands for the benches'.
    #[test]
    fn a_process_that_fails_or_writes_nothing_is_not_kept() {
        let folder = tempfile::tempdir().unwrap();
        let run = |words: &[&str]| {
            let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
            fs::write(folder.path().join("report.json"), "{}").unwrap();
            let with = made_with(&words, "card");
            let ran = run(&parts()[0], &words, folder.path(), &with).unwrap();
            assert_eq!(kept(&parts()[0], folder.path(), &with), None, "{words:?}");
            assert!(ran.seconds.is_some());
            ran.outcome.unwrap_err()
        };
        let error = run(&["--no-such-flag"]);
        assert!(error.contains("no-such-flag"), "{error}");
        let error = run(&["--exact", "no such test"]);
        assert!(error.starts_with("report.json: "), "the report of an earlier run is not this one's: {error}");
    }

    #[test]
    fn a_failure_is_told_by_its_last_lines() {
        assert_eq!(last_lines("a\nb\n\n  c\nd\ne\n", "exit status: 1"), "b / c / d / e");
        assert_eq!(last_lines("\n", "signal: 9"), "signal: 9");
    }
}
