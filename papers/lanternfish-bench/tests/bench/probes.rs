//! `lanternfish-bench probes`, end to end on the software adapter. Its controls must show their faults.

use std::path::Path;

use serde_json::Value;

/// Runs parts of the benchmark at test size, and returns the report.
#[track_caller]
fn bench(folder: &Path, words: &str) -> Value {
    crate::bench(folder, &format!("probes --quick --runs 1 --shared none {words}"), "report").0
}

/// A figure of a table's row of this scene, if rows have scenes, and technique.
#[track_caller]
fn figure(report: &Value, table: &str, scene: &str, technique: &str, key: &str) -> f64 {
    let is = |row: &&Value| row["technique"] == technique && row.get("scene").is_none_or(|name| name == scene);
    let row = report[table].as_array().unwrap().iter().find(is);
    row.and_then(|row| row[key].as_f64()).unwrap_or_else(|| panic!("no {table} {scene} {technique} {key} in {report}"))
}

/// A technique without bounces has no energy, one with a single bounce less than one with all, which has what the path tracer has.
#[test]
#[ignore = "full"]
fn gpu_probes_report_lost_light() {
    let folder = tempfile::tempdir().unwrap();
    let report = bench(folder.path(), "--only right --scene cornell --technique good, --size 36x36 --spp 64");
    let of = |technique, key| figure(&report, "right", "cornell", technique, key);
    assert_eq!(of("none", "energy"), 0.0);
    let [one, all] = ["good, one bounce", "good, history"].map(|technique| of(technique, "energy"));
    println!("energy {one} by one bounce, {all} by all");
    assert!((all - 1.0).abs() < 0.15 && one < all - 0.1, "{report}");
    assert!((of("good, mean", "energy") - 1.0).abs() < 0.15, "{report}");
    assert!(of("none", "flip") > 2.0 * of("good, history", "flip"), "{report}");
    assert!(of("good, history", "flicker") > 0.0 && of("none", "indirect_ms") == 0.0, "{report}");
    assert!(folder.path().join("report/right-cornell-good-history.png").is_file());
}

/// Rays are counted, and passes are listed.
#[test]
fn gpu_probes_count_rays() {
    let folder = tempfile::tempdir().unwrap();
    let report = bench(folder.path(), "--only price --scene hall --technique good, --warm 2 --size 36x36");
    let rays = |key| figure(&report, "price", "hall", "good, history", key);
    assert!(
        rays("rays") > 6.0 && rays("rays") <= 12.0 && rays("all_rays") > rays("rays") + rays("shadow_rays"),
        "{report}"
    );
    assert!(report["passes"].as_array().unwrap().iter().any(|row| row["pass"] == "indirect/trace"), "{report}");
}

/// Light through a gap is reported as a leak, and closed rooms are dark.
#[test]
#[ignore = "full"]
fn gpu_probes_report_leaks() {
    let folder = tempfile::tempdir().unwrap();
    let report = bench(folder.path(), "--only leaks --technique good,");
    let of = |scene| figure(&report, "leaks", scene, "good, history", "leak");
    println!("{} {} {}", of("box, wall of 50 cm"), of("wall of 1 cm"), of("gap"));
    assert!(of("gap") > 0.02 && of("box, wall of 50 cm") < 0.005, "{report}");
    assert!(folder.path().join("report/leaks-gap-good-history-bright.png").is_file());
}

/// Without indirect light every error is greater; every frame with a reference is an image and a column of the sheet.
#[test]
#[ignore = "full"]
fn gpu_probes_walk() {
    let folder = tempfile::tempdir().unwrap();
    let report = bench(folder.path(), "--only motion --scene cornell --technique good, --size 36x36 --warm 2");
    let of = |table, technique, key| figure(&report, table, "", technique, key);
    for (table, key) in [("walk", "flip"), ("walk", "error"), ("lamp", "flip_16"), ("object", "error_around")] {
        let [none, good] = ["none", "good, history"].map(|technique| of(table, technique, key));
        println!("{table} {key}: {none}, {good}");
        assert!(good > 0.0 && good < none, "{table} {key}: {report}");
    }
    assert!(report["flicker"].as_array().is_some_and(|rows| rows.len() == 1), "{report}");
    let sheet = lanternfish_metrics::read_png(&folder.path().join("report/walk-sheet.png")).unwrap();
    assert_eq!((sheet.width, sheet.height), (2 * 36 + 4, 3 * 36 + 2 * 4));
    for file in ["walk-good-history-002.png", "lamp-sheet.png", "object-sheet.png"] {
        assert!(folder.path().join("report").join(file).is_file(), "{file}");
    }
}
