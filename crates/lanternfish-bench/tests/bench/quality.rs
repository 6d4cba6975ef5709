//! `lanternfish-bench quality`, end to end on the software adapter: a test a promise, each of the ground truths that it is about.

use std::{fs, path::Path};

use serde_json::Value;

use crate::program;

/// What the bench says of the smallest shot.
struct Quality {
    shot: Value,
    commit: Value,
    /// What it said meanwhile.
    said: String,
}

/// Runs the bench on the smallest shot, with these ground truths alone.
#[track_caller]
fn bench(folder: &Path, ground_truths: &[&str]) -> Quality {
    bench_of(folder, ground_truths, &[])
}

/// The same of techniques alone whose names hold one of these words, or of all.
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

/// The same, where nobody looks at the files.
#[track_caller]
fn judged(ground_truths: &[&str]) -> Quality {
    judged_of(ground_truths, &[])
}

/// The same of techniques alone whose names hold one of these words.
#[track_caller]
fn judged_of(ground_truths: &[&str], words: &[&str]) -> Quality {
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
fn gpu_direct_light_is_its_truth_by_every_way_to_find_it() {
    let found = judged(&["direct", "direct-lambert"]);
    // The default is the ground truth up to the ground truth's noise, and to 16 samples a pixel. The light is 5 cm below the ceiling's lamp,
    // where few paths carry much: noise of more than one per cent in so small an image.
    let noise = found.shot["ground_truths"][0]["noise_energy"].as_f64().unwrap();
    assert!(noise > 0.0 && noise < 0.03, "{noise}");
    for name in ["default", "culling all", "culling tiled 32, aabb off", "shadows bvh", "materials lambert"] {
        let energy = found.energy(name);
        assert!((energy - 1.0).abs() < 0.01 + 4.0 * noise, "{name}: energy {energy}, noise {noise}");
    }
    let (default, bvh) = (&found.row("default")["figures"], &found.row("shadows bvh")["figures"]);
    assert_eq!((&bvh["differing_pixels"], &bvh["rendering"]), (&0.into(), &default["rendering"]));
    assert!(default["rays"].as_u64().unwrap() > 1000);

    // The harness can fail: without shadows an image is another.
    let none = &found.row("shadows none")["figures"];
    assert_eq!(none["rays"], 0);
    for figure in ["flip", "hdr_flip", "relative_mse"] {
        let (none, best) = (found.error("shadows none", figure), found.error("default", figure));
        assert!(none > 2.0 * best, "{figure}: {none} without shadows, default {best}");
    }
    assert!(found.energy("shadows none") > found.energy("default") + 0.01);

    // Shadows of deep images are better than none; a driver that crashes on them gives a reason instead.
    match found.row("shadows across-texels")["left_out"].as_str() {
        None => assert!(
            found.error("shadows across-texels", "relative_mse") < 0.3 * found.error("shadows none", "relative_mse")
        ),
        Some(reason) => assert!(reason.contains("Mesa"), "{reason}"),
    }
}

#[test]
fn gpu_lights_with_a_size_are_not_points() {
    let found = judged(&["direct-soft"]);
    let [point, disk] =
        ["0", "0.1, shadow-rays 64"].map(|radius| found.error(&format!("light-radius {radius}"), "relative_mse"));
    assert!(disk < point, "{disk} {point}");
}

#[test]
fn gpu_light_that_is_reflected_more_than_once_is_missed_without_indirect_light() {
    let found = judged_of(&["full"], &["indirect none", "indirect sampled"]);
    for figure in ["flip", "hdr_flip", "relative_mse"] {
        let [none, sampled] = ["none", "sampled"].map(|way| found.error(&format!("indirect {way}"), figure));
        assert!(none > 1.3 * sampled, "{figure}: {none} {sampled}");
    }
    assert!(found.energy("indirect none") < 0.8 * found.energy("indirect sampled"));
    // Every bounce, however long it takes.
    for way in ["", ", best", ", 64 frames"] {
        let [one, every] = [", one bounce", way].map(|way| found.energy(&format!("indirect sampled{way}")));
        assert!(one < 0.9 * every, "{way}: {one} {every}");
    }
    // What the path tracer takes for direct light is what an image without indirect light has: both are shares of one ground truth's energy.
    let [direct, noise] = ["energy_without_indirect", "noise_energy"]
        .map(|figure| found.shot["ground_truths"][0][figure].as_f64().unwrap());
    for way in ["none", "none, 64 frames"] {
        let energy = found.energy(&format!("indirect {way}"));
        assert!((energy - direct).abs() < 0.01 + 4.0 * noise, "{way}: {energy} {direct}, noise {noise}");
    }
}

#[test]
fn gpu_one_bounce_is_there_by_whatever_its_rays_are_traced_through() {
    // Of rays all, and one of photons and of virtual lights each.
    let requested =
        ["one-bounce none", "one-bounce bvh", "one-bounce across", "one-bounce within", "splat raster", "map 64"];
    let found = judged_of(&["one-bounce"], &requested);
    let energy = |technique| found.energy(&format!("one-bounce {technique}"));
    assert!(energy("none") < 0.9, "{}", energy("none"));
    assert!((energy("bvh, not clamped") - 1.0).abs() < 0.05, "{}", energy("bvh, not clamped"));
    // The clamp takes what few rays find: much, where the light is 5 cm below the lamp and the image so small.
    for technique in ["bvh", "across-texels 128", "within-texel 128"] {
        assert!((0.85..1.05).contains(&energy(technique)), "{technique}: {}", energy(technique));
    }
    // A quarter of the rays have twice the noise.
    let fourth = energy("bvh, every fourth pixel");
    assert!((0.85..1.1).contains(&fourth), "{fourth}");
    assert!(found.error("one-bounce bvh", "flip") < 0.7 * found.error("one-bounce none", "flip"));
}

#[test]
fn gpu_deep_images_know_what_occludes_from_afar() {
    // Better than the view's depth does, and that better than nothing.
    let found = judged_of(&["occlusion", "obscurance-far"], &["none", "hbao", "deep 128"]);
    for ground_truth in ["occlusion", "obscurance-far"] {
        let [deep, hbao, none] =
            ["deep 128", "hbao", "none"].map(|technique| found.error(&format!("{ground_truth} {technique}"), "flip"));
        assert!(deep < 0.6 * hbao && hbao < 0.7 * none, "{ground_truth}: {deep} {hbao} {none}");
    }
}

#[test]
fn gpu_deep_images_know_which_light_of_the_environment_arrives() {
    // Under whichever of the two skies.
    let found = judged(&["environment"]);
    let [deep, hbao, none] =
        ["deep 128", "hbao", "none"].map(|technique| found.error(&format!("environment {technique}"), "flip"));
    assert!(deep < 0.4 * hbao && deep < 0.4 * none, "{deep} {hbao} {none}");
    let energy = found.energy("environment deep 256");
    assert!((energy - 1.0).abs() < 0.06, "{energy}");
}

#[test]
fn gpu_near_obscurance_is_right_and_the_reports_name_what_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let found = bench(folder.path(), &["obscurance-near"]);
    for technique in ["deep 256", "hbao"] {
        let energy = found.energy(&format!("obscurance-near {technique}"));
        assert!((energy - 1.0).abs() < 0.02, "{technique}: {energy}");
    }

    // Three reports.
    assert_eq!(found.commit, "test");
    let read = |name: &str| fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let (markdown, html) = (read("report.md"), read("report.html"));
    assert!(found.rows().len() > 3);
    for row in found.rows() {
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
fn gpu_truths_are_kept_and_a_broken_one_is_traced_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let ground_truths = || {
        let entries = fs::read_dir(folder.path().join("out/ground_truths")).unwrap().map(|entry| entry.unwrap());
        let mut files: Vec<_> = entries.map(|entry| (entry.path(), fs::read(entry.path()).unwrap())).collect();
        files.sort();
        files
    };
    let requested = ["direct-lambert", "direct-soft"];
    let first = bench(folder.path(), &requested);
    // Twice as many as were requested: short paths are cheap.
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
fn a_shot_that_is_not_known_is_refused_with_the_list() {
    let output = program(Path::new(".")).args(["quality", "--only", "bistro"]).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && stderr.contains("cornell") && stderr.contains("sponza-ten"), "{stderr}");
}
