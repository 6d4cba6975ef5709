//! `lanternfish-bench quality`, end to end on the software adapter: one test per claim, each with the ground truths that it needs.

use std::{fs, path::Path};

use serde_json::Value;

use crate::program;

/// Results of the benchmark on the smallest shot.
struct Quality {
    shot: Value,
    commit: Value,
    /// Standard error.
    said: String,
}

/// Runs the benchmark on the smallest shot, with these ground truths only.
#[track_caller]
fn bench(folder: &Path, ground_truths: &[&str]) -> Quality {
    bench_of(folder, ground_truths, &[])
}

/// As [`bench`], with techniques whose names contain one of these words, or with all if there are none.
#[track_caller]
fn bench_of(folder: &Path, ground_truths: &[&str], words: &[&str]) -> Quality {
    let output = program(folder)
        .args(["quality", "--output", "out", "--adapter", "cpu", "--commit", "test"])
        .args(["--only", "cornell", "--size", "32x32", "--spp", "64", "--runs", "1"])
        .args(ground_truths.iter().flat_map(|ground_truth| ["--ground-truth", ground_truth]))
        .args(words.iter().flat_map(|words| ["--technique", words]))
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    let stdout = String::from_utf8(output.stdout).unwrap();
    assert_eq!(stdout.lines().last(), Some("out/report.html"));
    let mut report: Value = serde_json::from_slice(&fs::read(folder.join("out/report.json")).unwrap()).unwrap();
    Quality { shot: report["shots"][0].take(), commit: report["commit"].take(), said }
}

/// As [`bench`], in a temporary folder.
#[track_caller]
fn results(ground_truths: &[&str]) -> Quality {
    results_of(ground_truths, &[])
}

/// As [`bench_of`], in a temporary folder.
#[track_caller]
fn results_of(ground_truths: &[&str], words: &[&str]) -> Quality {
    bench_of(tempfile::tempdir().unwrap().path(), ground_truths, words)
}

impl Quality {
    fn rows(&self) -> &[Value] {
        self.shot["rows"].as_array().unwrap()
    }

    #[track_caller]
    fn row(&self, name: &str) -> &Value {
        let rows = self.rows();
        rows.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("no row {name}: {rows:?}"))
    }

    #[track_caller]
    fn error(&self, name: &str, figure: &str) -> f64 {
        let row = self.row(name);
        row["figures"]["errors"][figure].as_f64().unwrap_or_else(|| panic!("{figure} of {row}"))
    }

    #[track_caller]
    fn energy(&self, name: &str) -> f64 {
        self.error(name, "energy_ratio")
    }
}

#[test]
fn gpu_direct_light_matches_its_ground_truth_with_every_technique() {
    let actual = results(&["direct", "direct-lambert"]);
    // The default matches the ground truth within its noise and the error of 16 samples per pixel. The light is 5 cm below the ceiling's
    // lamp, where few paths carry much light, which causes noise of more than 1 % in a small image.
    let noise = actual.shot["ground_truths"][0]["noise_energy"].as_f64().unwrap();
    assert!(noise > 0.0 && noise < 0.03, "{noise}");
    for name in ["default", "culling all", "culling tiled 32, aabb off", "shadows bvh", "materials lambert"] {
        let energy = actual.energy(name);
        assert!((energy - 1.0).abs() < 0.01 + 4.0 * noise, "{name}: energy {energy}, noise {noise}");
    }
    let (default, bvh) = (&actual.row("default")["figures"], &actual.row("shadows bvh")["figures"]);
    assert_eq!((&bvh["differing_pixels"], &bvh["rendering"]), (&0.into(), &default["rendering"]));
    assert!(default["rays"].as_u64().unwrap() > 1000);

    // Negative control: an image without shadows has a larger error.
    let none = &actual.row("shadows none")["figures"];
    assert_eq!(none["rays"], 0);
    for figure in ["flip", "hdr_flip", "relative_mse"] {
        let (none, best) = (actual.error("shadows none", figure), actual.error("default", figure));
        assert!(none > 2.0 * best, "{figure}: {none} without shadows, default {best}");
    }
    assert!(actual.energy("shadows none") > actual.energy("default") + 0.01);

    // Shadows of deep images are better than none. With a driver that crashes on them, the row has a reason instead.
    match actual.row("shadows across-texels")["left_out"].as_str() {
        None => assert!(
            actual.error("shadows across-texels", "relative_mse") < 0.3 * actual.error("shadows none", "relative_mse")
        ),
        Some(reason) => assert!(reason.contains("Mesa"), "{reason}"),
    }
}

#[test]
fn gpu_area_lights_are_not_points() {
    let actual = results(&["direct-soft"]);
    let [point, disk] =
        ["0", "0.1, shadow-rays 64"].map(|radius| actual.error(&format!("light-radius {radius}"), "relative_mse"));
    assert!(disk < point, "{disk} {point}");
}

#[test]
fn gpu_multi_bounce_light_is_missing_without_indirect_light() {
    let actual = results_of(&["full"], &["indirect none", "indirect sampled"]);
    for figure in ["flip", "hdr_flip", "relative_mse"] {
        let [none, sampled] =
            ["none", "sampled"].map(|technique| actual.error(&format!("indirect {technique}"), figure));
        assert!(none > 1.3 * sampled, "{figure}: {none} {sampled}");
    }
    assert!(actual.energy("indirect none") < 0.8 * actual.energy("indirect sampled"));
    // All bounces have more energy than one.
    for technique in ["", ", best", ", 64 frames"] {
        let [one, every] =
            [", one bounce", technique].map(|technique| actual.energy(&format!("indirect sampled{technique}")));
        assert!(one < 0.9 * every, "{technique}: {one} {every}");
    }
    // The path tracer's direct light equals that of an image without indirect light: both are fractions of the ground truth's energy.
    let [direct, noise] = ["energy_without_indirect", "noise_energy"]
        .map(|figure| actual.shot["ground_truths"][0][figure].as_f64().unwrap());
    for technique in ["none", "none, 64 frames"] {
        let energy = actual.energy(&format!("indirect {technique}"));
        assert!((energy - direct).abs() < 0.01 + 4.0 * noise, "{technique}: {energy} {direct}, noise {noise}");
    }
}

#[test]
fn gpu_one_bounce_has_the_right_energy_with_every_tracer() {
    // All rows of rays, and one each of photons and of virtual lights.
    let requested =
        ["one-bounce none", "one-bounce bvh", "one-bounce across", "one-bounce within", "splat raster", "map 64"];
    let actual = results_of(&["one-bounce"], &requested);
    let energy = |technique| actual.energy(&format!("one-bounce {technique}"));
    assert!(energy("none") < 0.9, "{}", energy("none"));
    assert!((energy("bvh, not clamped") - 1.0).abs() < 0.05, "{}", energy("bvh, not clamped"));
    // The firefly clamp removes light that few rays hit: much of it here, as the light is 5 cm below the lamp and the image is small.
    for technique in ["bvh", "across-texels 128", "within-texel 128"] {
        assert!((0.85..1.05).contains(&energy(technique)), "{technique}: {}", energy(technique));
    }
    // A quarter of the rays has twice the noise.
    let fourth = energy("bvh, every fourth pixel");
    assert!((0.85..1.1).contains(&fourth), "{fourth}");
    assert!(actual.error("one-bounce bvh", "flip") < 0.7 * actual.error("one-bounce none", "flip"));
}

#[test]
fn gpu_deep_images_include_distant_occluders() {
    // Deep images are better than the view's depth, which is better than no occlusion.
    let actual = results_of(&["occlusion", "obscurance-far"], &["none", "hbao", "deep 128"]);
    for ground_truth in ["occlusion", "obscurance-far"] {
        let [deep, hbao, none] =
            ["deep 128", "hbao", "none"].map(|technique| actual.error(&format!("{ground_truth} {technique}"), "flip"));
        assert!(deep < 0.6 * hbao && hbao < 0.7 * none, "{ground_truth}: {deep} {hbao} {none}");
    }
}

#[test]
fn gpu_deep_images_occlude_light_of_the_environment() {
    // Holds for both environments, the file and the built-in sky.
    let actual = results(&["environment"]);
    let [deep, hbao, none] =
        ["deep 128", "hbao", "none"].map(|technique| actual.error(&format!("environment {technique}"), "flip"));
    assert!(deep < 0.4 * hbao && deep < 0.4 * none, "{deep} {hbao} {none}");
    let energy = actual.energy("environment deep 256");
    assert!((energy - 1.0).abs() < 0.06, "{energy}");
}

#[test]
fn gpu_near_obscurance_is_exact_and_the_reports_list_all_rows() {
    let folder = tempfile::tempdir().unwrap();
    let actual = bench(folder.path(), &["obscurance-near"]);
    for technique in ["deep 256", "hbao"] {
        let energy = actual.energy(&format!("obscurance-near {technique}"));
        assert!((energy - 1.0).abs() < 0.02, "{technique}: {energy}");
    }

    // All three reports are complete.
    assert_eq!(actual.commit, "test");
    let read = |name: &str| fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let (markdown, html) = (read("report.md"), read("report.html"));
    assert!(actual.rows().len() > 3);
    for row in actual.rows() {
        let name = row["name"].as_str().unwrap();
        assert!(markdown.contains(&format!("| {name} |")), "{name}\n{markdown}");
        for rendering in ["rendering", "map"] {
            let rendering = row["figures"][rendering].as_str().unwrap();
            assert!(html.contains(&format!("src=\"{rendering}\"")), "{rendering}");
            assert!(folder.path().join("out").join(rendering).is_file(), "{rendering}");
        }
    }
}

#[test]
fn gpu_ground_truths_are_reused_and_a_broken_one_is_traced_again_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let ground_truths = || {
        let entries = fs::read_dir(folder.path().join("out/ground_truths")).unwrap().map(|entry| entry.unwrap());
        let mut files: Vec<_> = entries.map(|entry| (entry.path(), fs::read(entry.path()).unwrap())).collect();
        files.sort();
        files
    };
    let requested = ["direct-lambert", "direct-soft"];
    let first = bench(folder.path(), &requested);
    // Twice the requested samples, because short paths are cheap.
    assert!(first.said.contains("ground truth direct-lambert: tracing 128 samples"), "{}", first.said);
    let traced = ground_truths();
    let (broken, _) = traced.iter().find(|(path, _)| path.to_string_lossy().contains("cornell-direct-soft-")).unwrap();
    fs::write(broken, "broken").unwrap();

    let second = bench(folder.path(), &requested);
    let said = &second.said;
    assert!(
        said.contains("ground truth direct-lambert: reused") && said.contains("ground truth direct-soft: tracing"),
        "{said}"
    );
    assert!(ground_truths() == traced, "the same ground truths, byte for byte");
    for ground_truth in second.shot["ground_truths"].as_array().unwrap() {
        assert_eq!(ground_truth["reused"], ground_truth["name"] != "direct-soft", "{ground_truth}");
    }
    for (a, b) in first.rows().iter().zip(second.rows()) {
        assert_eq!(a["figures"]["errors"], b["figures"]["errors"], "{}", a["name"]);
    }
}

#[test]
fn an_unknown_shot_is_refused_with_the_list() {
    let output = program(Path::new(".")).args(["quality", "--only", "bistro"]).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && stderr.contains("cornell") && stderr.contains("sponza-ten"), "{stderr}");
}
