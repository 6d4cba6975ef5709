//! `lanternfish-bench photons`, end to end on the software adapter.

use std::fs;

use serde_json::Value;

use crate::bench;

/// Counts and errors are equal in every run. Means of frames and flicker along a track are measured.
#[test]
fn gpu_photons_are_compared_with_the_ground_truth() {
    let folder = tempfile::tempdir().unwrap();
    // A lamp far in front of the box takes most of the photons, which hit nothing, so that few photons are split.
    let shot = "scene = \"demo:cornell\"\n[lights]\npoint = [[0, 1, 30, 100]]\n[track]\nframes = 8\n[[track.keyframes]]\ntime = 0\neye = [0, 1, 4.2]\ntarget = [0, 1, 0]\n\
                [[track.keyframes]]\ntime = 1\neye = [0.5, 1, 4.0]\ntarget = [0, 1, 0]\n";
    fs::write(folder.path().join("walk.toml"), shot).unwrap();
    let words = "photons walk.toml --quick --runs 1 --size 48x36 --spp 32";
    let (first, said) = bench(folder.path(), words, "first");
    let rows = first["rows"].as_array().unwrap();
    let figure = |row: &str, name: &str| {
        let row = rows.iter().find(|other| other["name"] == row).unwrap_or_else(|| panic!("no {row}"));
        row[name].as_f64().unwrap_or_else(|| panic!("{name} of {row}"))
    };
    // The image is small and has few samples: the ground truth has an error of a few percent.
    assert!((figure("photon-splatting", "indirect_energy") - 1.0).abs() < 0.15, "{rows:?}");
    assert!(figure("none", "indirect_energy") == 0.0 && figure("photon-splatting", "flip") < figure("none", "flip"));
    let counts = ["splatted", "off_screen", "hidden", "landed"].map(|name| figure("photon-splatting", name));
    assert!(counts[0] > 5_000.0 && counts[0] + counts[1] + counts[2] == counts[3], "{counts:?}");
    let means = first["means"].as_array().unwrap();
    assert!(means.len() == 8 && means.iter().any(|mean| mean["frames"] == 4), "{means:?}");
    let flicker = first["flicker"].as_array().unwrap();
    assert!(flicker.len() == 3 && flicker.iter().all(|row| row["places"].as_u64().unwrap() > 300), "{flicker:?}");
    assert!(said.contains("## Means of frames") && said.contains("## Flicker"), "{said}");
    for rendering in ["none", "photon-splatting", "photon-splatting-4-frames", "ground_truth-one-bounce"] {
        assert!(folder.path().join(format!("first/{rendering}.png")).is_file(), "{rendering}");
    }
    // A second run of photons only, with the stored ground truths.
    let (second, _) = bench(folder.path(), &format!("{words} --only photon-splatting"), "first");
    let mut compared = 0;
    for table in ["rows", "means", "flicker"] {
        for again in second[table].as_array().unwrap() {
            let is_this = |row: &&Value| row["name"] == again["name"] && row["frames"] == again["frames"];
            let row = first[table].as_array().unwrap().iter().find(is_this).unwrap();
            for exact in
                ["reflected", "landed", "splatted", "indirect_energy", "flip", "errors", "direct_flip", "places"]
            {
                assert_eq!(row[exact], again[exact], "{exact} of {row}");
            }
            compared += 1;
        }
    }
    assert!(compared > 6, "{compared} rows of {second}");
}
