//! `lanternfish-bench virtual-lights`, end to end on the software adapter.

use std::fs;

use serde_json::Value;

use crate::program;

/// Counts and errors are equal in every run. Flicker is measured along the shot's track. Images are written to the report's folder.
#[test]
fn gpu_virtual_lights_are_compared_with_the_ground_truth() {
    let folder = tempfile::tempdir().unwrap();
    let shot = "scene = \"demo:cornell\"\n[track]\nframes = 10\n[[track.keyframes]]\ntime = 0\neye = [0, 1, 4.2]\ntarget = [0, 1, 0]\n\
                [[track.keyframes]]\ntime = 1\neye = [0.5, 1, 4.0]\ntarget = [0, 1, 0]\n";
    fs::write(folder.path().join("walk.toml"), shot).unwrap();
    let report = |name: &str| -> (Value, String) {
        let words = ["virtual-lights", "walk.toml", "--quick", "--runs", "1", "--size", "48x36", "--spp", "32"];
        let more = ["--adapter", "cpu", "-o", name];
        let output = program(folder.path()).args(words).args(more).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let said = String::from_utf8(output.stdout).unwrap();
        (serde_json::from_slice(&fs::read(folder.path().join(name).join("report.json")).unwrap()).unwrap(), said)
    };
    let (first, said) = report("first");
    let rows = first["rows"].as_array().unwrap();
    let figure = |row: &str, name: &str| {
        let row = rows.iter().find(|other| other["name"] == row).unwrap_or_else(|| panic!("no {row}"));
        row[name].as_f64().unwrap_or_else(|| panic!("{name} of {row}"))
    };
    // The image is small and has few samples: the ground truth has an error of a few percent.
    assert!((figure("virtual-lights", "indirect_energy") - 1.0).abs() < 0.15, "{rows:?}");
    assert!(figure("as in the paper", "indirect_energy") < 0.5 && figure("none", "indirect_energy") == 0.0);
    assert!(figure("virtual-lights", "flip") < figure("none", "flip"));
    assert_eq!(figure("virtual-lights", "listed"), 4096.0);
    let flicker = first["flicker"].as_array().unwrap();
    assert!(flicker.len() == 4 && flicker.iter().all(|row| row["places"].as_u64().unwrap() > 300), "{flicker:?}");
    assert!(
        said.contains("| Build VPL buffer |") && said.contains("| 64² | ") && said.contains("## Flicker"),
        "{said}"
    );
    for rendering in ["none", "virtual-lights", "ground_truth-zero-bounces", "ground_truth-one-bounce"] {
        assert!(folder.path().join(format!("first/{rendering}.png")).is_file(), "{rendering}");
    }
    let (second, _) = report("second");
    for (a, b) in rows.iter().zip(second["rows"].as_array().unwrap()) {
        for exact in ["name", "unique", "listed", "too_large", "indirect_energy", "flip"] {
            assert_eq!(a[exact], b[exact], "{exact} of {a}");
        }
    }
    assert_eq!(first["flicker"], second["flicker"]);
}
