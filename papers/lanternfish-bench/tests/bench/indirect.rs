//! `lanternfish-bench indirect`, end to end on the software adapter.

use std::fs;

use crate::{bench, program};

const QUICK: &str = "--quick --runs 1 --size 40x30";

#[test]
#[ignore = "full"]
fn gpu_every_speed_has_its_error() {
    let folder = tempfile::tempdir().unwrap();
    // The lamp, whose few pixels would be most of the light, is out of sight.
    let view = "[view]\neye = [0, 0.6, 2.8]\ntarget = [0, 0.4, 0]\nfov-y = 30\n";
    fs::write(folder.path().join("shot.toml"), format!("scene = \"demo:cornell\"\n{view}")).unwrap();
    let (first, said) = bench(folder.path(), &format!("indirect shot.toml {QUICK}"), "first");
    assert_eq!(said.lines().last(), Some("first/report.md"));

    // Through the BVH: three BRDFs, and diffuse light in three more ways. Through images of two
    // resolutions: three BRDFs, each through his number.
    let rows = first["rows"].as_array().unwrap();
    let left_out = first["left_out"].as_array().unwrap();
    assert_eq!(rows.len(), 6 + 2 * 3, "{left_out:?}");
    let soft = first["soft_shadows"].as_array().unwrap();
    // Through the BVH, and through the coarser images twice.
    assert_eq!(soft.len() + left_out.len(), 3, "{left_out:?}");
    for left_out in left_out {
        // Some drivers crash there; nothing else may be refused.
        assert!(left_out["reason"].as_str().unwrap().contains("shadows"), "{left_out}");
        assert!(!left_out["reason"].as_str().unwrap().is_empty());
        assert!(said.contains(left_out["reason"].as_str().unwrap()));
    }
    for row in rows {
        let figure = |name: &str| row[name].as_f64().unwrap_or_else(|| panic!("{name} of {row}"));
        // Each time is present; its value depends on the machine.
        for time in ["rate_traced", "rate_shaded", "trace_ms", "shade_ms", "filter_ms", "images_ms", "frame_ms"] {
            figure(time);
        }
        let a_frame = figure("rays") / figure("accumulate");
        let a_pixel = match row["brdf"].as_str().unwrap() {
            "diffuse" => 8.0,
            "glossy" => 16.0,
            _ => 1.0,
        };
        assert!(a_frame > 0.5 * a_pixel * 1200.0 && a_frame <= a_pixel * 1200.0, "{row}");

        let energies = [figure("energy_ratio"), figure("indirect_energy_ratio")];
        if row["tracer"] == "bvh" {
            assert_eq!((energies, figure("flip")), ([1.0; 2], 0.0), "{row}");
        } else {
            // Images of 16 and 32 texels have errors, which are large for a lamp that few rays hit.
            assert!(figure("flip") > 1e-4 && figure("flip") < 0.5, "{row}");
            assert!(energies.iter().all(|energy| *energy != 1.0) && (0.5..2.0).contains(&energies[0]), "{row}");
        }
        assert!(figure("converged_flip") > 1e-3, "{row}");
    }
    let filters = first["filters"].as_array().unwrap();
    let of = |name: &str| filters.iter().map(|row| row[name].as_f64().unwrap()).collect::<Vec<_>>();
    let (flips, energies) = (of("many_flip"), of("indirect_energy_ratio"));
    // A filter of 11 x 11 blurs an image of 40 x 30; ours stops at edges.
    assert!(flips.len() == 4 && [0, 2, 3].iter().all(|i| flips[*i] < flips[1]), "{filters:?}");
    // Ours gives back most of the light that the firefly clamp took.
    let lost = |i: usize| (1.0 - energies[i]).abs();
    assert!(lost(1) > 0.2 && lost(2).max(lost(3)) < 0.5 * lost(0), "{filters:?}");
    for row in soft {
        let figure = |name: &str| row[name].as_f64().unwrap_or_else(|| panic!("{name} of {row}"));
        assert!(figure("rays") >= 16.0 && figure("rate_traced") >= figure("rate_shaded"), "{row}");
        assert_eq!(row["tracer"] == "bvh", figure("flip") == 0.0, "{row}");
        // Coarser images are farther from many rays than the BVH's, and the filter changes the image.
        assert!(figure("converged_flip") >= soft[0]["converged_flip"].as_f64().unwrap(), "{row}");
        assert_ne!(figure("filtered_flip"), figure("converged_flip"), "{row}");
    }
    let files = ["diffuse", "glossy", "mirror", "across-texels-mirror-150x16", "across-texels-mirror-150x32"];
    let soft = ["soft-bvh", "soft-bvh-filtered", "soft-many-rays"];
    let parts = ["parts-direct", "parts-diffuse", "parts-glossy", "parts-all"];
    for rendering in files.into_iter().chain(soft).chain(parts) {
        let rendering = lanternfish_metrics::read_png(&folder.path().join(format!("first/{rendering}.png"))).unwrap();
        assert_eq!((rendering.width, rendering.height), (40, 30));
    }
    let images = first["images"].as_array().unwrap();
    assert_eq!(images.len(), 4);
    assert!(images.iter().all(|images| images["total_ms"].is_f64() && images["bytes"].as_u64() > Some(0)));
}

#[test]
fn gpu_a_scene_without_light_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("dark.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let words = format!("indirect dark.obj {QUICK} --adapter cpu -o report");
    let output = program(folder.path()).args(words.split(' ')).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && output.stdout.is_empty() && error.contains("the image is black"), "{error}");
    assert!(!folder.path().join("report/report.json").exists());
}
