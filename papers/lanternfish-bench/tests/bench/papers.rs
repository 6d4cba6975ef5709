//! `lanternfish-bench papers`, end to end on the software adapter: parts by name, and the time that they have.

use std::fs;

use serde_json::Value;

use crate::{bench, program};

#[test]
fn gpu_papers_leave_out_what_has_no_time_and_keep_what_they_have() {
    let folder = tempfile::tempdir().unwrap();
    let run = |words: &str| {
        let words = words.split(' ').chain(["--quick", "--adapter", "cpu", "-o", "papers"]);
        let output = program(folder.path()).arg("papers").args(words).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{said}");
        let page: Value = serde_json::from_slice(&fs::read(folder.path().join("papers/papers.json")).unwrap()).unwrap();
        (page["parts"].as_array().unwrap().clone(), said)
    };
    let both = "--part attenuation --part crossings";
    let (parts, _) = run(&format!("{both} --seconds 0"));
    assert_eq!(parts.len(), 2);
    assert!(parts.iter().all(|part| part["outcome"] == "not measured, because no time was left"), "{parts:?}");
    let (parts, _) = run("--part attenuation --seconds 60 --commit abc");
    assert!(parts[0]["outcome"] == "measured" && parts[0]["commit"] == "abc", "{parts:?}");
    let (again, said) = run("--part attenuation --resume --commit abc");
    assert!(said.contains("kept") && again == parts, "the seconds of the run are kept: {said}");
    assert!(!run("--part attenuation --resume --commit abd").1.contains("kept"), "other sources");
}

#[test]
fn gpu_rows_after_the_deadline_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let (report, said) = bench(
        folder.path(),
        "deep-images demo:cornell --quick --rays 1024 --runs 1 --seconds 0 --tables stores,directions",
        "report",
    );
    assert_eq!(report["built"].as_array().unwrap().len(), 1, "the first row is measured");
    let left_out = report["left_out"].as_array().unwrap();
    assert!(left_out.iter().any(|left_out| left_out["reason"] == "no time left"), "{left_out:?}");
    assert!(said.contains("- Directions: no time left"), "{said}");
    // Tables that were not requested are not measured either.
    assert!(left_out.iter().all(|left_out| left_out["what"] != "Builders"), "{left_out:?}");
}
