//! `lanternfish-bench photons` and `lanternfish-bench virtual-lights`, end to end on the software adapter.

use std::{fs, io::Write, path::Path};

use serde_json::Value;

use crate::{bench, walk};

/// Runs a benchmark along a walk in the Cornell box, and returns the report and standard output.
#[track_caller]
fn measured(folder: &Path, words: &str) -> (Value, String) {
    walk(
        folder,
        "demo:cornell",
        8,
        ["eye = [0, 1, 4.2], target = [0, 1, 0]", "eye = [0.5, 1, 4.0], target = [0, 1, 0]"],
    );
    if words.starts_with("photons") {
        // A lamp far in front of the box takes most of the photons, which hit nothing, so that few photons are split.
        let mut shot = fs::OpenOptions::new().append(true).open(folder.join("walk.toml")).unwrap();
        shot.write_all(b"[lights]\npoint = [[0, 1, 30, 100]]\n").unwrap();
    }
    bench(folder, &format!("{words} --quick --runs 1"), "first")
}

#[track_caller]
fn figure(report: &Value, row: &str, name: &str) -> f64 {
    let rows = report["rows"].as_array().unwrap();
    let row = rows.iter().find(|other| other["name"] == row).unwrap_or_else(|| panic!("no {row} in {rows:?}"));
    row[name].as_f64().unwrap_or_else(|| panic!("{name} of {row}"))
}

/// Checks the energy of a technique and that its image is closer to the path tracer's than without indirect light.
fn check_errors(report: &Value, row: &str, most_off: f64) {
    let [energy, flip] = ["indirect_energy", "flip"].map(|name| figure(report, row, name));
    assert!((energy - 1.0).abs() < most_off && figure(report, "none", "indirect_energy") == 0.0, "{report}");
    assert!(flip < figure(report, "none", "flip"), "{report}");
}

/// The image without indirect light is always compared.
#[test]
fn gpu_no_indirect_light_has_no_energy() {
    for name in ["photons", "virtual-lights"] {
        let folder = tempfile::tempdir().unwrap();
        let (report, _) = measured(folder.path(), &format!("{name} walk.toml --only nothing --size 24x18 --spp 8"));
        assert_eq!(figure(&report, "none", "indirect_energy"), 0.0);
        assert!(figure(&report, "none", "flip") > 0.01 && report["rows"].as_array().unwrap().len() == 1, "{report}");
        assert!(folder.path().join("first/ground_truth-one-bounce.png").is_file());
    }
}

#[test]
#[ignore = "full"]
fn gpu_photons_are_compared_with_the_ground_truth() {
    let folder = tempfile::tempdir().unwrap();
    let (report, _) = measured(folder.path(), "photons walk.toml --size 48x36 --spp 32");
    // The image is small and has few samples: the ground truth has an error of a few percent.
    check_errors(&report, "photon-splatting", 0.15);
    let counts = ["splatted", "off_screen", "hidden", "landed"].map(|name| figure(&report, "photon-splatting", name));
    assert!(counts[0] > 5_000.0 && counts[0] + counts[1] + counts[2] == counts[3], "{counts:?}");
}

#[test]
#[ignore = "full"]
fn gpu_virtual_lights_are_compared_with_the_ground_truth() {
    let folder = tempfile::tempdir().unwrap();
    let (report, said) = measured(folder.path(), "virtual-lights walk.toml --size 48x36 --spp 32");
    let of = |row, name| figure(&report, row, name);
    check_errors(&report, "virtual-lights", 0.15);
    assert!(of("as in the paper", "indirect_energy") < 0.5 && of("virtual-lights", "listed") == 4096.0, "{report}");
    for name in ["as in the paper", "as in the paper, single_pass"] {
        // Holes, and samples beside their texel's axis, change the light, but hardly the image.
        assert!(of(name, "builder_flip") < 0.05 && of(name, "builder_energy") > 0.7, "{report}");
    }
    // His steps, and their sum, of the three techniques that have them.
    for name in ["virtual-lights", "as in the paper", "as in the paper, our deep images"] {
        let table = report["archer_table_1"].as_array().unwrap();
        let row = table.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("no {name} in {table:?}"));
        let steps: Vec<f64> = (0..7).map(|i| row[format!("steps/{i}")].as_f64().unwrap()).collect();
        let sum: f64 = steps.iter().sum();
        assert!(
            steps.iter().all(|ms| *ms > 0.0) && (row["steps/*"].as_f64().unwrap() / sum - 1.0).abs() < 1e-6,
            "{row}"
        );
    }
    assert!(said.contains("## Table 1: steps, ms") && said.contains("| 64² | "), "{said}");
}
