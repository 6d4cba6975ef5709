//! `lanternfish-bench virtual-lights`, end to end on the software adapter.

use crate::{bench, walk};

/// Counts and errors are equal in every run. Flicker is measured along the shot's track. Images are written to the report's folder.
#[test]
fn gpu_virtual_lights_are_compared_with_the_ground_truth() {
    let folder = tempfile::tempdir().unwrap();
    walk(
        folder.path(),
        "demo:cornell",
        10,
        ["eye = [0, 1, 4.2], target = [0, 1, 0]", "eye = [0.5, 1, 4.0], target = [0, 1, 0]"],
    );
    let words = "virtual-lights walk.toml --quick --runs 1 --size 48x36 --spp 32";
    let (first, said) = bench(folder.path(), words, "first");
    let rows = first["rows"].as_array().unwrap();
    let figure = |row: &str, name: &str| {
        let row = rows.iter().find(|other| other["name"] == row).unwrap_or_else(|| panic!("no {row}"));
        row[name].as_f64().unwrap_or_else(|| panic!("{name} of {row}"))
    };
    // The image is small and has few samples: the ground truth has an error of a few percent.
    assert!((figure("virtual-lights", "indirect_energy") - 1.0).abs() < 0.15, "{rows:?}");
    assert!(figure("as in the paper", "indirect_energy") < 0.5 && figure("none", "indirect_energy") == 0.0);
    for name in ["as in the paper", "as in the paper, single_pass"] {
        // Holes, and samples beside their texel's axis, change the light, but hardly the image.
        assert!(figure(name, "builder_flip") < 0.05 && figure(name, "builder_energy") > 0.7, "{rows:?}");
    }
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
    let (second, _) = bench(folder.path(), words, "second");
    for (a, b) in rows.iter().zip(second["rows"].as_array().unwrap()) {
        for exact in ["name", "unique", "listed", "too_large", "indirect_energy", "flip"] {
            assert_eq!(a[exact], b[exact], "{exact} of {a}");
        }
    }
    assert_eq!(first["flicker"], second["flicker"]);
}
