//! `lanternfish-bench history`, end to end on the software adapter.

use std::fs;

use crate::bench;

/// Temporal accumulation reduces error and flicker along a walk, and does not increase the error after a change of light.
#[test]
#[ignore = "full"]
fn gpu_a_walk_flickers_less_with_a_history() {
    let folder = tempfile::tempdir().unwrap();
    let shot = "scene = \"demo:atrium\"\n[lights]\npoint = [[2, 2, 0, 6, 40, 40, 40], [-2, 3, 1, 8, 60, 40, 20]]\n[track]\nframes = 20\n\
                [[track.keyframes]]\ntime = 0\neye = [8.2, 1.75, -2.7]\ntarget = [-4, 2.2, 0]\n\
                [[track.keyframes]]\ntime = 1\neye = [7.6, 1.75, -2.5]\ntarget = [-4, 2.2, 0]\n";
    fs::write(folder.path().join("walk.toml"), shot).unwrap();
    let (report, _) = bench(folder.path(), "history walk.toml --quick --runs 1 --size 48x36 --spp 64", "report");
    let figures = |table: &str, name: &str| -> Vec<f64> {
        report[table].as_array().unwrap().iter().map(|row| row[name].as_f64().unwrap()).collect()
    };
    let [without, with] = [0, 1].map(|row| figures("rows", "flip")[row]);
    println!("FLIP {without} without, {with} with");
    assert!(with < without && figures("rows", "frames") == [11.0, 11.0], "{report}");
    assert!(figures("rows", "indirect_energy").iter().all(|energy| (energy - 1.0).abs() < 0.15), "{report}");
    let flicker = figures("flicker", "step");
    assert!(flicker[1] < 0.75 * flicker[0], "{flicker:?}");
    // No light from before the change remains: the first frame after it is as without a history, and later frames are nearer.
    let after: Vec<Vec<f64>> = report["rows"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["after_change"].as_array().unwrap().iter().map(|flip| flip.as_f64().unwrap()).collect())
        .collect();
    let is_nearer = after[0].iter().zip(&after[1]).all(|(without, with)| *with < without + 1e-3);
    assert!(is_nearer, "{after:?}");
}
