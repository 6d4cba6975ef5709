//! Runs parts, each as a process of its own, and keeps what they write.

use std::{
    env,
    fs::{self, File},
    path::Path,
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use lanternfish_cli::{error::CliError, output::write_text};
use serde_json::{Value, json};

use super::{
    page::{Machine, RanPart},
    parts::{Part, TRACK, parts},
    rows::{Found, Reports},
};
use crate::{bench::make_folder, table::Row};

/// The file that says with which arguments a part was made, and how long that took; it is there only of complete ones.
const ARGUMENTS: &str = "arguments.json";
/// What a part says.
const ERRORS: &str = "errors.txt";
/// Between two looks whether a part has ended.
const LOOK: Duration = Duration::from_millis(50);
/// Lines of a program's error that are told.
const LINES: usize = 4;

/// What became of a part.
#[derive(Debug)]
pub struct Ran {
    pub outcome: Found<Value>,
    /// None where it did not run.
    pub seconds: Option<f64>,
    /// Of the sources by which it was made.
    pub commit: String,
}

impl Ran {
    /// Not run, for this reason.
    pub fn left_out(reason: &str) -> Self {
        Self { outcome: Err(reason.to_owned()), seconds: None, commit: String::new() }
    }
}

/// What `arguments.json` has, but for its seconds. `adapter`: its name.
pub fn made_with(arguments: &[String], adapter: &str, commit: &str) -> Value {
    json!({ "version": env!("CARGO_PKG_VERSION"), "commit": commit, "adapter": adapter, "arguments": arguments })
}

/// Git's description of the sources; empty without git, or outside a repository.
pub fn commit() -> String {
    let mut git = Command::new("git");
    let git = git.args(["describe", "--always", "--dirty"]).current_dir(env!("CARGO_MANIFEST_DIR"));
    let output = git.stdin(Stdio::null()).stderr(Stdio::null()).output().ok().filter(|output| output.status.success());
    output.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned()).unwrap_or_default()
}

/// What a part left in its folder, if it is complete and was made so.
pub fn kept(part: &Part, folder: &Path, made_with: &Value) -> Option<Ran> {
    let mut known: Value = serde_json::from_slice(&fs::read(folder.join(ARGUMENTS)).ok()?).ok()?;
    let seconds = known.as_object_mut()?.remove("seconds").and_then(|seconds| seconds.as_f64());
    let commit = known["commit"].as_str().unwrap_or_default().to_owned();
    let report = product(part, folder).ok().filter(|_| known == *made_with)?;
    Some(Ran { outcome: Ok(report), seconds, commit })
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

/// A stored run: the reports FOLDER/PART.json, the machine, and what FOLDER.json says of the parts.
pub fn stored(folder: &Path) -> Result<(Reports, Machine, Vec<RanPart>), CliError> {
    let read = |file: &Path| -> Found<Value> {
        let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
        serde_json::from_str(&text).map_err(|error| format!("{}: {error}", file.display()))
    };
    let page = read(&folder.with_extension("json")).map_err(|error| CliError::new(error, "name a stored run"))?;
    let words = |of: &Value, key: &str| of[key].as_str().unwrap_or_default().to_owned();
    let [adapter, driver] = ["adapter", "driver"].map(|key| words(&page, key));
    let machine = Machine { adapter, driver, is_software: page["software"] == true };
    let mut reports = Reports::of(machine.is_software);
    for Part { name, .. } in parts() {
        let file = folder.join(format!("{name}.json"));
        reports.add(&name, if file.is_file() { read(&file) } else { Err("it is not stored".to_owned()) });
    }
    let part = |row: &Value| {
        let text = |told: Row, key: &'static str| told.text(key, key, words(row, key));
        let told = ["part", "command"].into_iter().fold(Row::default(), text);
        RanPart(
            ["commit", "outcome"].into_iter().fold(told.maybe("seconds", "seconds", 0, row["seconds"].as_f64()), text),
        )
    };
    Ok((reports, machine, page["parts"].as_array().into_iter().flatten().map(part).collect()))
}

/// Runs a part, and reads what it wrote. It is stopped after `most`. An error only where nothing can be written.
pub fn run(
    part: &Part,
    arguments: &[String],
    folder: &Path,
    made_with: &Value,
    most: Option<Duration>,
) -> Result<Ran, CliError> {
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
    let errors = folder.join(ERRORS);
    let said = File::create(&errors)
        .map_err(|error| CliError::new(format_args!("{}: {error}", errors.display()), "choose a writable folder"))?;
    let mut command = Command::new(program);
    let status = ended(command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(said), most);
    let seconds = started.elapsed().as_secs_f64();
    let outcome = status.and_then(|is_success| match is_success {
        true => product(part, folder),
        false => Err(last_lines(&fs::read_to_string(&errors).unwrap_or_default(), "it failed")),
    });
    if outcome.is_ok() {
        let mut made = made_with.clone();
        made["seconds"] = json!(seconds);
        write_text(&folder.join(ARGUMENTS), &format!("{made:#}\n"))?;
    }
    let commit = made_with["commit"].as_str().unwrap_or_default().to_owned();
    Ok(Ran { outcome, seconds: Some(seconds), commit })
}

/// Waits until a program ends; true if it succeeded. Ends it after `most`, which is an error.
fn ended(command: &mut Command, most: Option<Duration>) -> Found<bool> {
    let (mut program, started) = (command.spawn().map_err(|error| error.to_string())?, Instant::now());
    loop {
        if let Some(status) = program.try_wait().map_err(|error| error.to_string())? {
            return Ok(status.success());
        }
        if most.is_some_and(|most| started.elapsed() > most) {
            let _ = program.kill();
            let _ = program.wait();
            return Err("no time left: it was stopped".to_owned());
        }
        thread::sleep(LOOK);
    }
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
        let with = made_with(&words, "card", "abc");
        let kept =
            |with: &Value| kept(part, folder.path(), with).map(|ran| (ran.outcome.unwrap(), ran.seconds, ran.commit));
        assert_eq!(kept(&with), None, "nothing is there");
        write("report.json", "{\"rows\": []}");
        assert_eq!(kept(&with), None, "it was cut off before it said with what it was made");
        let mut made = with.clone();
        made["seconds"] = json!(2.5);
        write(ARGUMENTS, &made.to_string());
        assert_eq!(kept(&with), Some((json!({ "rows": [] }), Some(2.5), "abc".to_owned())));
        assert_eq!(kept(&made_with(&words[..1], "card", "abc")), None, "other arguments");
        assert_eq!(kept(&made_with(&words, "another card", "abc")), None, "another adapter");
        assert_eq!(kept(&made_with(&words, "card", "abc-dirty")), None, "other sources");
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
            let with = made_with(&words, "card", "");
            let ran = run(&parts()[0], &words, folder.path(), &with, None).unwrap();
            assert!(kept(&parts()[0], folder.path(), &with).is_none(), "{words:?}");
            assert!(ran.seconds.is_some());
            ran.outcome.unwrap_err()
        };
        let error = run(&["--no-such-flag"]);
        assert!(error.contains("no-such-flag"), "{error}");
        let error = run(&["--exact", "no such test"]);
        assert!(error.starts_with("report.json: "), "the report of an earlier run is not this one's: {error}");
    }

    #[cfg(unix)]
    #[test]
    fn what_takes_too_long_is_stopped() {
        let started = Instant::now();
        let error = ended(Command::new("sleep").arg("60"), Some(Duration::from_millis(20))).unwrap_err();
        assert!(error.starts_with("no time left") && started.elapsed() < Duration::from_secs(30), "{error}");
        assert_eq!(
            [ended(&mut Command::new("true"), None), ended(&mut Command::new("false"), None)],
            [Ok(true), Ok(false)]
        );
    }

    #[test]
    fn a_failure_is_told_by_its_last_lines() {
        assert_eq!(last_lines("a\nb\n\n  c\nd\ne\n", "exit status: 1"), "b / c / d / e");
        assert_eq!(last_lines("\n", "signal: 9"), "signal: 9");
    }
}
