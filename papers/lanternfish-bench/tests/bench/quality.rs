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

/// Runs the benchmark on the smallest shot, with these ground truths only, and with techniques whose names contain one of these words, or
/// with all if there are none.
#[track_caller]
fn bench(folder: &Path, size: &str, ground_truths: &[&str], words: &[&str]) -> Quality {
    let output = program(folder)
        .args(["quality", "--output", "out", "--adapter", "cpu", "--commit", "test"])
        .args(["--only", "cornell", "--size", size, "--spp", "64", "--runs", "1"])
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

/// As [`bench`], in a temporary folder, of 32 x 32 pixels.
#[track_caller]
fn results(ground_truths: &[&str], words: &[&str]) -> Quality {
    bench(tempfile::tempdir().unwrap().path(), "32x32", ground_truths, words)
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
#[ignore = "full"]
fn gpu_direct_light_matches_its_ground_truth_with_every_technique() {
    let actual = results(&["direct", "direct-lambert", "direct-soft"], &[]);
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

    // Area lights are not points.
    let [point, disk] =
        ["0", "0.1, shadow-rays 64"].map(|radius| actual.error(&format!("light-radius {radius}"), "relative_mse"));
    assert!(disk < point, "{disk} {point}");
}

/// Rows of every other ground truth: better ones have the energy and smaller errors.
#[test]
#[ignore = "full"]
fn gpu_other_light_is_compared_with_its_ground_truth() {
    let ground_truths = ["full", "one-bounce", "occlusion", "obscurance-far", "obscurance-near", "environment"];
    let words = ["none", "indirect sampled", "one-bounce bvh", "one-bounce across", "splat raster", "map 64"];
    let actual = results(&ground_truths, &[&words[..], &["hbao", "deep 128", "deep 256"]].concat());
    // The firefly clamp removes light that few rays hit: much of it here, as the light is 5 cm below the lamp and the image is small. A
    // quarter of the rays has twice the noise.
    for (row, energies) in [
        ("one-bounce none", 0.0..0.9),
        ("one-bounce bvh, not clamped", 0.95..1.05),
        ("one-bounce bvh", 0.85..1.05),
        ("one-bounce across-texels 128", 0.85..1.05),
        ("one-bounce bvh, every fourth pixel", 0.85..1.1),
        ("environment deep 256", 0.94..1.06),
        ("obscurance-near deep 256", 0.98..1.02),
        ("obscurance-near hbao", 0.98..1.02),
    ] {
        assert!(energies.contains(&actual.energy(row)), "{row}: {}", actual.energy(row));
    }
    // Deep images are better than the view's depth, which is better than no occlusion. The environment is a file or the built-in sky.
    for (better, worse, most) in [
        ("indirect sampled", "indirect none", 0.76),
        ("one-bounce bvh", "one-bounce none", 0.7),
        ("occlusion deep 128", "occlusion hbao", 0.6),
        ("occlusion hbao", "occlusion none", 0.7),
        ("obscurance-far deep 128", "obscurance-far hbao", 0.6),
        ("obscurance-far hbao", "obscurance-far none", 0.7),
        ("environment deep 128", "environment hbao", 0.4),
        ("environment deep 128", "environment none", 0.4),
    ] {
        let [better_flip, worse_flip] = [better, worse].map(|row| actual.error(row, "flip"));
        assert!(better_flip < most * worse_flip, "{better}: {better_flip}, {worse}: {worse_flip}");
    }
    // All bounces have more energy than one, and one more than none.
    for technique in ["", ", best", ", 64 frames"] {
        let [one, every] =
            [", one bounce", technique].map(|technique| actual.energy(&format!("indirect sampled{technique}")));
        assert!(one < 0.9 * every && actual.energy("indirect none") < 0.8 * every, "{technique}: {one} {every}");
    }
    // The path tracer's direct light equals that of an image without indirect light: both are fractions of the ground truth's energy.
    let [direct, noise] = ["energy_without_indirect", "noise_energy"].map(|figure| {
        let full = actual.shot["ground_truths"].as_array().unwrap().iter().find(|it| it["name"] == "full");
        full.and_then(|full| full[figure].as_f64()).unwrap()
    });
    let energy = actual.energy("indirect none, 64 frames");
    assert!((energy - direct).abs() < 0.01 + 4.0 * noise, "{energy} {direct}, noise {noise}");
}

#[test]
fn gpu_ground_truths_are_reused_and_the_reports_list_all_rows() {
    let folder = tempfile::tempdir().unwrap();
    let ground_truths = || {
        let entries = fs::read_dir(folder.path().join("out/ground_truths")).unwrap().map(|entry| entry.unwrap());
        let mut files: Vec<_> = entries.map(|entry| (entry.path(), fs::read(entry.path()).unwrap())).collect();
        files.sort();
        files
    };
    let requested = ["direct-lambert", "direct-soft"];
    let of = || bench(folder.path(), "16x16", &requested, &["lambert", "radius 0.1"]);
    let first = of();
    // Twice the requested samples, because short paths are cheap.
    assert!(first.said.contains("ground truth direct-lambert: tracing 128 samples"), "{}", first.said);
    let traced = ground_truths();
    let (broken, _) = traced.iter().find(|(path, _)| path.to_string_lossy().contains("cornell-direct-soft-")).unwrap();
    fs::write(broken, "broken").unwrap();

    let second = of();
    let said = &second.said;
    assert!(
        said.contains("ground truth direct-lambert: reused") && said.contains("ground truth direct-soft: tracing"),
        "{said}"
    );
    assert!(ground_truths() == traced, "the same ground truths, byte for byte");
    for ground_truth in second.shot["ground_truths"].as_array().unwrap() {
        assert_eq!(ground_truth["reused"], ground_truth["name"] != "direct-soft", "{ground_truth}");
    }

    // All three reports are complete.
    assert_eq!(first.commit, "test");
    let read = |name: &str| fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let (markdown, html) = (read("report.md"), read("report.html"));
    assert!(first.rows().len() > 1);
    for (row, again) in first.rows().iter().zip(second.rows()) {
        let name = row["name"].as_str().unwrap();
        assert_eq!(row["figures"]["errors"], again["figures"]["errors"], "{name}");
        assert!(markdown.contains(&format!("| {name} |")), "{name}\n{markdown}");
        for rendering in ["rendering", "map"] {
            let rendering = row["figures"][rendering].as_str().unwrap();
            assert!(html.contains(&format!("src=\"{rendering}\"")), "{rendering}");
            assert!(folder.path().join("out").join(rendering).is_file(), "{rendering}");
        }
    }
}
