//! End-to-end tests of the benchmarks, in one program, so that it is linked once.

mod clustered;
mod deep_images;
mod indirect;
mod one_bounce;
mod papers;
mod quality;

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

use serde_json::Value;

/// The program in a folder, without standard input and `RUST_LOG`.
fn program(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanternfish-bench"));
    command.current_dir(folder).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// Runs a benchmark on the software adapter, with its report in the folder `name`. Returns the report and standard
/// output.
#[track_caller]
fn bench(folder: &Path, words: &str, name: &str) -> (Value, String) {
    let words = words.split_whitespace().chain(["--adapter", "cpu", "-o", name]);
    let output = program(folder).args(words).output().unwrap();
    let [said, errors] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert!(output.status.success(), "{errors}");
    let report = fs::read(folder.join(name).join("report.json")).unwrap();
    (serde_json::from_slice(&report).unwrap(), said)
}

/// A shot of a scene with a track between two views.
fn walk(folder: &Path, scene: &str, frames: u32, [from, to]: [&str; 2]) {
    let shot = format!(
        "scene = \"{scene}\"\n[track]\nframes = {frames}\nkeyframes = [{{ time = 0, {from} }}, {{ time = 1, {to} }}]\n"
    );
    fs::write(folder.join("walk.toml"), shot).unwrap();
}

#[test]
fn help_lists_every_benchmark() {
    let said = |words: &[&str]| {
        let output = program(Path::new(".")).args(words).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (output.status.success(), text(output.stdout), text(output.stderr))
    };
    let (success, help, _) = said(&["help"]);
    for name in
        ["forward-plus", "deep-images", "indirect", "virtual-lights", "photons", "clustered", "quality", "papers"]
    {
        assert!(success && help.contains(name), "{name} is not in\n{help}");
        let (success, help, _) = said(&["help", name, "--all"]);
        assert!(
            success && help.contains(&format!("Usage: lanternfish-bench {name}")) && help.contains("--adapter"),
            "{help}"
        );
    }
    let help = said(&["help", "indirect", "--all"]).1;
    for word in ["rays per second", "FLIP", "energy", "memory", "filter", "384"] {
        assert!(help.split_whitespace().collect::<Vec<_>>().join(" ").contains(word), "{word:?} is not in\n{help}");
    }
    // Benchmarks have different defaults.
    for (name, default) in [
        ("forward-plus", "every image, pixels [default: 1280x720]"),
        ("photons", "every image, pixels [default: 480x270]"),
        ("clustered", "one warm-up run [default: 1]"),
    ] {
        let help = said(&["help", name]).1.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(help.contains(default), "{default} is not in\n{help}");
    }
    // What is not known is refused with the list of what is.
    for (words, known) in
        [(["quality", "--only", "bistro"], "sponza-ten"), (["papers", "--part", "all"], "the parts are deep-images, ")]
    {
        let (success, _, error) = said(&words);
        assert!(!success && error.contains(known), "{error}");
    }
    let (success, _, error) = said(&["help", "beauty"]);
    assert!(!success && error.starts_with("error: lanternfish-bench beauty: no such command"), "{error}");
    assert!(error.contains("quality"), "{error}");
    for word in ["moving", "history", "probes"] {
        let (success, _, error) = said(&[word]);
        assert!(!success && error.contains("`lanternfish-bench walks`"), "{error}");
    }
}
