//! `lanternfish doctor` as a process.

use std::{fs, path::Path, process::Output};

use lanternfish_gpu::testing;

use crate::support::{lanternfish, names};

fn doctor(folder: &Path, words: &[&str]) -> (Output, String) {
    let output = lanternfish(folder).arg("doctor").args(words).output().unwrap();
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    (output, text)
}

#[test]
fn gpu_a_report_survives_writing_and_reading() {
    if testing::gpu("gpu_a_report_survives_writing_and_reading").is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let words = ["--adapter", "cpu", "--filter", "alpha mask", "--json", "report.json", "--images", "images"];
    let (output, table) = doctor(folder.path(), &words);
    assert!(output.status.success(), "{table}{}", String::from_utf8_lossy(&output.stderr));
    assert!(table.contains("0 failed") && table.contains("alpha mask") && table.contains("tracer auto"), "{table}");
    assert!(!names(&folder.path().join("images")).is_empty(), "an image beside its reference");
    assert_eq!(names(folder.path()), ["images", "report.json"], "nothing else is left");
    assert_eq!(doctor(folder.path(), &["--read", "report.json"]).1, table);
    let (_, page) = doctor(folder.path(), &["--read", "report.json", "--page"]);
    assert!(page.starts_with("# ") && page.contains("## Checks"), "{page}");
    let json = fs::read_to_string(folder.path().join("report.json")).unwrap();
    assert!(!json.contains(folder.path().to_str().unwrap()), "a report names no path of the user's");
}

#[test]
fn other_files_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("other.json"), "{}").unwrap();
    for file in ["other.json", "missing.json"] {
        let (output, text) = doctor(folder.path(), &["--read", file]);
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && text.is_empty(), "{file}");
        assert!(error.contains(file) && error.contains("lanternfish doctor --json"), "{error}");
    }
}
