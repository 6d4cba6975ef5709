//! `lanternfish-bench clustered` and `lanternfish-bench attenuation`, end to end on the software adapter.

use std::fs;

use crate::{bench, program, walk};

#[test]
#[ignore = "full"]
fn gpu_clusters_are_counted_for_every_scheme() {
    let folder = tempfile::tempdir().unwrap();
    let (first, said) = bench(folder.path(), "clustered demo:cornell --quick --size 32x18", "first");

    // Three shapes, three more sizes of cubes, and two numbers of lights: mono, stereo with one grid per eye and with one for both, and brute
    // force. Then of the three brute force for two eyes, and two views in opposite directions, which only boxes enclose.
    let [rows, others] = ["rows", "other_rows"].map(|rows| first[rows].as_array().unwrap());
    let left_out = first["left_out"].as_array().unwrap();
    assert_eq!(rows.len() + others.len() + left_out.len(), 2 * (3 * 8 + 3 * 4), "{left_out:?}");
    let unaligned = others.iter().filter(|row| row["views"] == "unaligned-enclosed");
    let unaligned: Vec<_> = unaligned.map(|row| row["clusters"].as_str().unwrap()).collect();
    assert_eq!(unaligned, ["ortho:4"; 2], "{left_out:?}");
    assert!(others.iter().all(|row| row["differing_pixels"] == 0), "{others:?}");
    for row in rows {
        let count = |name: &str| row["counts"][name].as_u64().unwrap();
        assert!(count("visible_clusters") > 0 && count("visible_clusters") <= count("clusters"), "{row}");
        assert!(count("fragments") <= 2 * 32 * 18 && count("lighting_operations") >= count("lights_listed"), "{row}");
        if row["assignment"] == "brute_force" {
            assert_eq!(count("light_tests"), count("visible_clusters") * row["lights"].as_u64().unwrap());
        }
    }
    // All schemes render the same image.
    let schemes = first["schemes"].as_array().unwrap();
    assert_eq!(schemes.len(), 3 * 2, "{schemes:?}");
    for row in schemes {
        assert!(["lights_listed", "light_tests", "bytes"].iter().all(|count| row[count].as_u64() > Some(0)), "{row}");
        assert_eq!(row["differing_pixels"], 0, "{row}");
    }
    assert!(said.contains("raster-grid 16, 32 layers"), "{said}");
    assert_eq!(said.lines().last(), Some("first/report.md"));
}

#[test]
fn the_attenuation_functions_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let output = program(folder.path()).args(["attenuation", "-o", "a.svg"]).output().unwrap();
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "a.svg\n");
    let svg = fs::read_to_string(folder.path().join("a.svg")).unwrap();
    assert!(svg.contains("physical_reduced_2") && !svg.contains("NaN"));
}

#[test]
#[ignore = "full"]
fn gpu_a_track_makes_the_figures_of_the_thesis() {
    let folder = tempfile::tempdir().unwrap();
    let views = ["eye = [0, 1, 3.4], target = [0, 1, 0]", "eye = [0.3, 1.2, 2.8], target = [0, 1, 0]"];
    walk(folder.path(), "demo:cornell", 9, views);
    let words = "clustered walk.toml --quick --frames 3 --size 32x18";
    let (report, said) = bench(folder.path(), words, "figures");
    assert_eq!(said.lines().last(), Some("figures/figures.html"));
    // Two numbers of lights: three shapes in mono, and two in stereo, with one grid per eye and with one for both.
    let played = report["played"].as_array().unwrap();
    assert_eq!((played.len(), report["left_out"].as_array().unwrap().len()), (2 * (3 + 2 * 2), 0));
    for row in played {
        let frames = row["report"]["frames"].as_array().unwrap();
        let moments: Vec<f64> =
            row["report"]["moments"].as_array().unwrap().iter().map(|t| t.as_f64().unwrap()).collect();
        assert_eq!((frames.len(), moments), (3, vec![0.0, 0.5, 1.0]));
        assert_eq!(row["lights"], row["report"]["lights"], "the scene's own are left out");
        assert_eq!(row["report"]["eyes"], if row["views"] == "mono" { 1 } else { 2 });
    }
    // Images do not depend on the clusters.
    let renderings = |clusters: &str, views: &str| {
        let row = played.iter().find(|row| row["clusters"] == clusters && row["views"] == views).unwrap();
        row["report"]["frames"].as_array().unwrap().iter().map(|frame| &frame["image"]).collect::<Vec<_>>()
    };
    assert_eq!(renderings("persp:4", "mono"), renderings("ortho:4", "mono"));
    assert_eq!(renderings("persp:4", "stereo-individual"), renderings("persp:4", "stereo-enclosed"));
    let page = fs::read_to_string(folder.path().join("figures/figures.html")).unwrap();
    for figure in 2..=10 {
        assert!(page.contains(&format!("<h2>Figure 6.{figure}: ")), "6.{figure}");
    }
    // For each number of lights: five plots in each of five figures, and three in each of four.
    assert_eq!(page.matches("<svg").count(), 2 * (5 * 5 + 4 * 3));
    assert!(!page.contains("NaN") && !page.contains("<script"));
}
