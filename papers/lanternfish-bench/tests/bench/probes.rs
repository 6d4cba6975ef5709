//! `lanternfish-bench probes`, end to end on the software adapter. Its controls must show their faults.

use serde_json::Value;

/// A figure of a technique's row in a table.
#[track_caller]
fn figure(report: &Value, table: &str, technique: &str, key: &str) -> f64 {
    let row = report[table].as_array().unwrap().iter().find(|row| row["technique"] == technique);
    row.and_then(|row| row[key].as_f64()).unwrap_or_else(|| panic!("no {table} {technique} {key} in {report}"))
}

/// Without indirect light every error is greater; every frame with a reference has an image, and so has its reference.
#[test]
#[ignore = "full"]
fn gpu_probes_walk() {
    let folder = tempfile::tempdir().unwrap();
    let words = "probes --quick --runs 1 --shared none --scene cornell --technique good, --size 36x36";
    let report = crate::bench(folder.path(), words, "report").0;
    for key in ["flip", "error"] {
        let [none, good] = ["none", "good, history"].map(|technique| figure(&report, "walk", technique, key));
        println!("{key}: {none}, {good}");
        assert!(good > 0.0 && good < none, "{key}: {report}");
    }
    assert!(report["flicker"].as_array().is_some_and(|rows| rows.len() == 1), "{report}");
    for name in ["good-history", "reference"] {
        assert!(folder.path().join(format!("report/walk-{name}-002.png")).is_file(), "{name}");
    }
}
