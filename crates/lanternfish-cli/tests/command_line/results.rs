//! Output files: long names, links, pipes, and files that must not be replaced. Tests `reference` and `compare`, which need no
//! adapter; `render` writes with the same functions.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use lanternfish_metrics::{read_exr, read_png};

use crate::support::{lanternfish, names};

fn output(folder: &Path, words: &[&str]) -> Output {
    lanternfish(folder).args(words).output().unwrap()
}

/// A run that writes an image of 4 × 4 pixels.
#[track_caller]
fn trace(folder: &Path, file: &str) {
    let output = output(folder, &["reference", "demo:cornell", "--size", "4x4", "--spp", "2", "-o", file]);
    assert!(output.status.success(), "{file}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Standard error of a run that fails before it reads its scene, which does not exist.
#[track_caller]
fn refused(folder: &Path, words: &[&str]) -> String {
    let output = output(folder, words);
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && output.stdout.is_empty() && !error.contains("No such file"), "{error}");
    assert_eq!(error.lines().filter(|line| line.starts_with("error")).count(), 1, "{error}");
    error
}

#[test]
fn names_may_have_the_longest_length() {
    let folder = tempfile::tempdir().unwrap();
    let name = |length: usize, ending: &str| "n".repeat(length - ending.len()) + ending;
    for length in [240, 255] {
        trace(folder.path(), &name(length, ".exr"));
        trace(folder.path(), &name(length, ".png"));
        read_exr(&folder.path().join(name(length, ".exr"))).unwrap();
        read_png(&folder.path().join(name(length, ".png"))).unwrap();
    }
    assert_eq!(names(folder.path()).len(), 4);
    for command in ["render", "reference"] {
        let error = refused(folder.path(), &[command, "nowhere.glb", "-o", &name(256, ".png")]);
        assert!(error.contains("File name too long") && error.contains("choose a shorter name"), "{error}");
    }
    assert_eq!(names(folder.path()).len(), 4);
}

#[test]
fn a_file_that_is_read_only_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("keep.png");
    fs::write(&path, "dear").unwrap();
    let mut permissions = fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).unwrap();
    for words in [
        &["render", "nowhere.glb", "-o", "keep.png"][..],
        &["render", "nowhere.glb", "-o", "a.png", "--report", "keep.png"],
        &["reference", "nowhere.glb", "-o", "keep.png"],
        &["deep-images", "nowhere.glb", "-o", "keep.png"],
        &["compare", "nowhere.png", "nowhere.png", "--map", "keep.png"],
        &["compare", "nowhere.png", "nowhere.png", "--json", "keep.png"],
    ] {
        let error = refused(folder.path(), words);
        assert!(error.contains("keep.png: this file is read-only"), "{words:?}: {error}");
    }
    assert_eq!(fs::read_to_string(&path).unwrap(), "dear");
    assert_eq!(names(folder.path()), ["keep.png"]);
}

#[cfg(unix)]
#[test]
fn a_link_is_followed() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("disk")).unwrap();
    std::os::unix::fs::symlink("disk/ground_truth.exr", folder.path().join("ground_truth.exr")).unwrap();
    for spp in ["1", "2"] {
        let words = ["reference", "demo:cornell", "--size", "4x4", "--spp", spp, "--resume", "-o", "ground_truth.exr"];
        assert!(output(folder.path(), &words).status.success());
        assert!(fs::symlink_metadata(folder.path().join("ground_truth.exr")).unwrap().is_symlink());
    }
    read_exr(&folder.path().join("disk/ground_truth.exr")).unwrap();
    assert_eq!(names(&folder.path().join("disk")), ["ground_truth.exr"]);
}

#[cfg(unix)]
#[test]
fn pipes_are_written_to_but_not_compared() {
    let folder = tempfile::tempdir().unwrap();
    trace(folder.path(), "file.exr");
    trace(folder.path(), "file.png");
    for (pipe, file) in [("pipe.exr", "file.exr"), ("pipe.png", "file.png")] {
        let path = folder.path().join(pipe);
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        let reader = std::thread::spawn(move || fs::read(path).unwrap());
        trace(folder.path(), pipe);
        assert!(reader.join().unwrap() == fs::read(folder.path().join(file)).unwrap(), "{pipe}");
        // Regression: it waited forever for a writer.
        for words in [["compare", pipe, file], ["compare", file, pipe]] {
            let error = refused(folder.path(), &words);
            assert!(error.contains(pipe) && error.contains("a pipe"), "{error}");
        }
    }
    let variance = refused(folder.path(), &["compare", "file.exr", "file.exr", "--variance-a", "pipe.exr"]);
    assert!(variance.contains("pipe.exr") && variance.contains("a pipe"), "{variance}");
    assert_eq!(names(folder.path()), ["file.exr", "file.png", "pipe.exr", "pipe.png"]);
}

#[cfg(target_os = "linux")]
#[test]
fn json_can_go_to_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    trace(folder.path(), "file.exr");
    let words = ["compare", "file.exr", "file.exr", "--json"];
    let piped = output(folder.path(), &[&words[..], &["/dev/stdout"]].concat());
    assert!(piped.status.success(), "{}", String::from_utf8_lossy(&piped.stderr));
    // If that is a file, its contents stay and further output is appended.
    let path = folder.path().join("both.txt");
    fs::write(&path, "before\n").unwrap();
    let both = fs::OpenOptions::new().append(true).open(&path).unwrap();
    let status = lanternfish(folder.path()).args(words).arg("/dev/stdout").stdout(both).status().unwrap();
    assert!(status.success());
    let said = String::from_utf8(piped.stdout).unwrap();
    assert!(said.starts_with('{') && said.contains("relMSE"), "the figures, and then the table: {said}");
    assert_eq!(fs::read_to_string(&path).unwrap(), "before\n".to_owned() + &said);
}
