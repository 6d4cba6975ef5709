//! `lanternfish-bench deep-images`, end to end on the software adapter.

use std::fs;

use crate::bench;

const QUICK: &str = "--quick --runs 1 --rays 4096";

#[test]
#[ignore = "full"]
fn gpu_deep_images_are_built_and_traced_in_every_way() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("shot.toml"), "scene = \"demo:cornell\"\n").unwrap();
    let (first, said) = bench(folder.path(), &format!("deep-images shot.toml {QUICK}"), "first");
    assert_eq!(said.lines().last(), Some("first/report.md"));
    assert!(folder.path().join("first/layers.png").exists());
    let built = first["built"].as_array().unwrap();
    let drawn = |builder: &str| {
        let row = built.iter().find(|row| row["builder"] == builder && row["directions"] == 4);
        row.unwrap()["drawn"].as_u64().unwrap() as f64
    };
    // Both sample texel centres.
    let ratio = drawn("depth_peeling") / drawn("per_direction");
    assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
    for row in built {
        let draw_passes = row["draw_passes"].as_u64().unwrap();
        match row["builder"].as_str().unwrap() {
            "single_pass" | "single_pass_literal" => assert_eq!(draw_passes, 1, "{row}"),
            "per_triangle" => assert_eq!(draw_passes, 0, "{row}"),
            "per_direction" => assert_eq!(draw_passes, 1, "{row}"),
            // A closed box is at least two surfaces deep.
            _ => assert!(draw_passes > 2, "{row}"),
        }
        assert!(row["kept"].as_u64() <= row["drawn"].as_u64() && row["total_ms"].is_f64(), "{row}");
    }

    let crossings = first["crossings"].as_array().unwrap();
    let texels = |row: usize| crossings[row]["texels_a_ray"].as_f64().unwrap();
    let names: Vec<_> = crossings.iter().map(|row| row["what"].as_str().unwrap()).collect();
    assert_eq!(names, ["the scene", "the scene", "a Cornell box", "four of the scene"]);
    // Fewer images have more; the claims of `lanternfish-bench papers` have the rest.
    assert!(texels(0) > 1.2 * texels(1) && texels(1) > 1.0, "{crossings:?}");

    for row in first["traced"].as_array().unwrap() {
        let figure = |name: &str| row[name].as_f64().unwrap();
        let is_exact = row["structure"] == "bvh" || row["structure"] == "ray-query";
        assert!(row["rate_random"].is_f64() && row["rate_by_direction"].is_f64(), "{row}");
        // Most of the three directions of 32² texels by the literal single pass, within a texel.
        assert!(figure("missed") + figure("false_hits") < 0.35, "{row}");
        assert_eq!(is_exact, figure("error_p95") < 1e-3, "{row}");
        match row["structure"].as_str().unwrap() {
            "across-texels" => assert!(figure("texels_a_ray") > 1.0 && figure("fragments_a_ray") > 0.0, "{row}"),
            "within-texel" => assert_eq!(figure("texels_a_ray"), 1.0, "{row}"),
            _ => assert!(row["texels_a_ray"].is_null(), "{row}"),
        }
    }
}
