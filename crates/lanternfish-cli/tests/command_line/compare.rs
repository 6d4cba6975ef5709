//! Tests of `lanternfish compare`: its results and its errors.

use std::{fs, path::Path};

use lanternfish_metrics::{RgbImage, read_exr, read_png, write_exr, write_exr_layers, write_jpeg};

use crate::support::{lanternfish, names};

/// Images with reference values from the FLIP authors' evaluator.
const PAIRS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../lanternfish-metrics/tests/pairs/");

#[derive(Debug)]
struct Outcome {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

fn compare(folder: &Path, words: &[&str]) -> Outcome {
    let output = lanternfish(folder).arg("compare").args(words).output().unwrap();
    Outcome {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

impl Outcome {
    #[track_caller]
    fn assert_said(&self, words: &[&str]) {
        assert_eq!((self.code, self.stderr.as_str()), (Some(0), ""), "{self:?}");
        for word in words {
            assert!(self.stdout.contains(word), "{word:?} is not in\n{}", self.stdout);
        }
        assert!(self.stdout.lines().all(|line| line == line.trim_end()));
    }

    /// Asserts one error that contains each of `words`, and no other output.
    #[track_caller]
    fn assert_refused(&self, words: &[&str]) {
        assert_eq!((self.code, self.stdout.as_str()), (Some(2), ""), "{self:?}");
        let errors = self.stderr.lines().filter(|line| line.starts_with("error")).count();
        assert_eq!(errors, 1, "{}", self.stderr);
        for word in words {
            assert!(self.stderr.contains(word), "{word:?} is not in: {}", self.stderr);
        }
    }

    fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).unwrap()
    }
}

fn pair(name: &str) -> String {
    format!("{PAIRS}{name}")
}

#[test]
fn radiance_is_compared_with_every_measure() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (pair("scene-noise.exr"), pair("scene.exr"));
    let table = compare(folder.path(), &[&a, &b]);
    // The mean is that of the authors' evaluator, 0.1316474.
    table.assert_said(&[
        "relMSE",
        "HDR-FLIP                        0.13164",
        "15 of -11.33 to 3.44 stops, aces",
        "SSIM",
        "PSNR, dB",
    ]);
    assert!(table.stdout.lines().last().unwrap().starts_with("A has 1.0"), "{}", table.stdout);

    let outcome = compare(folder.path(), &[&a, &b, "--json", "-", "--flip-tone-map", "reinhard"]);
    outcome.assert_said(&[]);
    let json = outcome.json();
    let mean = json["linear"]["hdr_flip"]["mean"].as_f64().unwrap();
    assert!((mean - 0.167_529_2).abs() < 1e-5, "{mean}");
    assert_eq!(json["linear"]["hdr_flip_exposure_count"], 15);
    assert_eq!((&json["pixels_compared"], &json["faults"]["nan"]), (&6144.into(), &0.into()));
    assert!(json["z_test"].is_null());
    // No files except the requested ones.
    assert!(names(folder.path()).is_empty());
}

#[test]
fn display_colours_are_compared_with_display_measures() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = compare(folder.path(), &[&pair("scene-noise.png"), &pair("scene.png")]);
    // The authors' evaluator of FLIP gives 0.1108573, scikit-image's SSIM 0.7803154.
    outcome.assert_said(&["LDR-FLIP                        0.110857", "SSIM                            0.780315"]);
    for word in ["relMSE", "HDR-FLIP", "energy"] {
        assert!(!outcome.stdout.contains(word), "{}", outcome.stdout);
    }
    // At a smaller viewing distance, errors are more visible.
    let json = |words: &[&str]| compare(folder.path(), words).json()["display"]["ldr_flip"]["mean"].as_f64().unwrap();
    let (a, b) = (pair("scene-noise.png"), pair("scene.png"));
    assert!((json(&[&a, &b, "--json", "-", "--pixels-per-degree", "30"]) - 0.204_013_6).abs() < 1e-5);
}

#[test]
fn jpeg_images_are_compared_like_png_images() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.jpg");
    let image = read_png(Path::new(&pair("scene.png"))).unwrap();
    let bytes: Vec<u8> = image.pixels.as_flattened().iter().map(|value| (255.0 * value).round() as u8).collect();
    write_jpeg(&path, [image.width as u32, image.height as u32], &bytes).unwrap();
    compare(folder.path(), &["scene.jpg", &pair("scene.png"), "--max-flip", "0.1"]).assert_said(&["LDR-FLIP", "SSIM"]);
    compare(folder.path(), &["scene.jpg", "scene.jpg"]).assert_said(&["A and B are equal"]);
    compare(folder.path(), &["scene.jpg", &pair("scene.exr")]).assert_refused(&["display colours (PNG, JPEG)"]);
    fs::write(&path, "no image").unwrap();
    compare(folder.path(), &["scene.jpg", &pair("scene.png")]).assert_refused(&["scene.jpg", "not a JPEG image"]);
}

#[test]
fn the_exposure_affects_display_measures_only() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (pair("scene-noise.exr"), pair("scene.exr"));
    let json = |ev: &str| compare(folder.path(), &[&a, &b, "--json", "-", "--exposure", ev]).json();
    let (dark, normal) = (json("-12"), json("0"));
    assert!(dark["display"]["ldr_flip"]["mean"].as_f64() < normal["display"]["ldr_flip"]["mean"].as_f64());
    assert_eq!(dark["linear"], normal["linear"]);
}

#[test]
fn equal_images_are_equal() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["scene.exr", "scene.png"] {
        let outcome = compare(folder.path(), &[&pair(name), &pair(name), "--max-flip", "0"]);
        outcome.assert_said(&["A and B are equal", "inf"]);
    }
    let json = compare(folder.path(), &[&pair("scene.png"), &pair("scene.png"), "--json", "-"]).json();
    assert!(json["display"]["psnr_db"].is_null() && json["is_equal"] == true);
}

#[test]
fn limits_are_an_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (pair("scene-noise.exr"), pair("scene.exr"));
    compare(folder.path(), &[&a, &b, "--max-flip", "0.14", "--max-relmse", "0.1"]).assert_said(&["HDR-FLIP"]);
    for (flag, limit, word) in [("--max-flip", "0.13", "HDR-FLIP 0.1316"), ("--max-relmse", "0.001", "relMSE")] {
        let outcome = compare(folder.path(), &[&a, &b, flag, limit]);
        assert_eq!(outcome.code, Some(1), "{outcome:?}");
        assert!(outcome.stderr.contains(word) && outcome.stderr.contains(flag), "{outcome:?}");
        assert!(outcome.stdout.contains("HDR-FLIP"), "the table is printed nevertheless");
    }
}

#[test]
fn pixels_that_are_not_finite_are_counted_and_exceed_every_limit() {
    let folder = tempfile::tempdir().unwrap();
    let reference = read_exr(Path::new(&pair("scene.exr"))).unwrap();
    let mut broken = reference.clone();
    broken.pixels[100] = [f32::NAN; 3];
    broken.pixels[200] = [1.0, f32::INFINITY, 1.0];
    write_exr(&folder.path().join("broken.exr"), &broken).unwrap();
    let b = pair("scene.exr");
    compare(folder.path(), &["broken.exr", &b, "--map", "map.png", "--side-by-side", "both.png"]).assert_said(&[
        "6,142 compared, 2 left out",
        "1 NaN, 1 +inf",
        "A and B are equal",
    ]);
    let outcome = compare(folder.path(), &["broken.exr", &b, "--max-flip", "1"]);
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    assert!(outcome.stderr.contains("1 NaN, 1 +inf"), "{outcome:?}");

    // Cyan in the map; three images and two gaps side by side.
    let map = read_png(&folder.path().join("map.png")).unwrap();
    assert_eq!((map.pixels[100], map.pixels[200]), ([0.0, 1.0, 1.0], [0.0, 1.0, 1.0]));
    assert_eq!(map.pixels[101].map(|v| (255.0 * v) as u8), [0, 0, 4]);
    let both = read_png(&folder.path().join("both.png")).unwrap();
    assert_eq!((both.width, both.height), (3 * 96 + 16, 64));
    let row = &both.pixels[20 * both.width..][..both.width];
    assert_eq!(row[..96], row[104..200]);
    assert_eq!(names(folder.path()), ["both.png", "broken.exr", "map.png"]);
}

/// An image with normal noise of a tenth, and its variances as a layer.
fn write_noisy(path: &Path, seed: u64, factor: f32) -> RgbImage {
    let mut state = seed;
    let mut uniform = move || {
        // SplitMix64.
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (((z ^ (z >> 31)) >> 40) as f32 + 0.5) / (1u32 << 24) as f32
    };
    let mut normal = || (-2.0 * uniform().ln()).sqrt() * (std::f32::consts::TAU * uniform()).cos();
    let value = |i: usize| 0.5 + (i % 64) as f32 / 64.0;
    let pixels = (0..4096).map(|i| [(); 3].map(|()| factor * value(i) * (1.0 + 0.1 * normal()))).collect();
    let image = RgbImage::new(64, 64, pixels).unwrap();
    let variance = RgbImage::new(64, 64, (0..4096).map(|i| [(0.1 * value(i)).powi(2); 3]).collect()).unwrap();
    write_exr_layers(path, &[("", &image), ("variance", &variance)], &[]).unwrap();
    variance
}

#[test]
fn noise_is_distinguished_from_a_change_of_1_per_cent() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let variance = write_noisy(&path("a.exr"), 1, 1.0);
    write_noisy(&path("b.exr"), 2, 1.0);
    write_noisy(&path("brighter.exr"), 3, 1.01);
    write_exr_layers(&path("variance-of-a.exr"), &[("", &variance)], &[]).unwrap();
    compare(folder.path(), &["a.exr", "b.exr"]).assert_said(&[
        "a.exr, layer variance",
        "12,288",
        "mean z²",
        "4.550 %",
        "Noise explains the difference",
    ]);
    compare(folder.path(), &["brighter.exr", "b.exr"])
        .assert_said(&["Noise does not explain the difference in brightness"]);
    let json = compare(folder.path(), &["brighter.exr", "b.exr", "--json", "-"]).json();
    assert_eq!((&json["z_test"]["verdict"], &json["z_test"]["values"]), (&"offset".into(), &12288.into()));

    // Variances from separate files; an image without variances counts as exact.
    let a = read_exr(&path("a.exr")).unwrap();
    write_exr_layers(&path("plain.exr"), &[("", &a)], &[]).unwrap();
    compare(folder.path(), &["plain.exr", "b.exr", "--variance-a", "variance-of-a.exr"])
        .assert_said(&["variances of A            variance-of-a.exr\n", "Noise explains the difference"]);
    compare(folder.path(), &["plain.exr", "b.exr"]).assert_said(&["none: taken to be exact", "does not explain"]);
    let zero = RgbImage::new(64, 64, vec![[0.0; 3]; 4096]).unwrap();
    write_exr_layers(&path("sure.exr"), &[("", &a), ("variance", &zero)], &[]).unwrap();
    compare(folder.path(), &["sure.exr", "plain.exr"])
        .assert_said(&["no variance, equal                12,288", "equal, value by value"]);
    compare(folder.path(), &["plain.exr", "b.exr", "--variance-b", "sure.exr"])
        .assert_said(&["12,288 values without variance differ: no noise explains those."]);
    compare(folder.path(), &["plain.exr", "b.exr", "--variance-a", &pair("scene.exr")])
        .assert_refused(&["96×64", "64×64"]);
}

#[test]
fn json_goes_to_a_file_beside_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = compare(folder.path(), &[&pair("scene-tinted.exr"), &pair("scene.exr"), "--json", "figures.json"]);
    outcome.assert_said(&["relMSE"]);
    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("figures.json")).unwrap()).unwrap();
    assert!(json["conclusion"].as_str().unwrap().contains("relMSE"));
}

#[test]
fn incomparable_images_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("text.exr"), "this is no image").unwrap();
    fs::write(folder.path().join("text.png"), "this is no image").unwrap();
    let small = RgbImage::new(4, 4, vec![[f32::NAN; 3]; 16]).unwrap();
    write_exr(&folder.path().join("nan.exr"), &small).unwrap();
    write_exr_layers(&folder.path().join("layer.exr"), &[("albedo", &small)], &[]).unwrap();
    let before = names(folder.path());
    let (exr, png) = (pair("scene.exr"), pair("scene.png"));
    for (words, said) in [
        (&["nowhere.exr", &exr][..], &["nowhere.exr", "No such file", "hint: check the path"][..]),
        (&["text.exr", &exr], &["text.exr", "not an OpenEXR image"]),
        (&["text.png", &png], &["text.png", "not a PNG image"]),
        (&["nan.exr", &exr], &["4×4", "96×64"]),
        (&["nan.exr", "nan.exr"], &["no pixel is finite"]),
        (&["layer.exr", &exr], &["layer.exr", "albedo.B, albedo.G, albedo.R"]),
        (&["a.jpg", &exr], &["a.jpg", ".exr", ".png"]),
        (&[&png, &exr], &["scene.png", "scene.exr", "both as"]),
        (&[&exr], &["<B>"]),
        (&[&png, &png, "--exposure", "1"], &["--exposure", ".exr"]),
        (&[&png, &png, "--max-relmse", "1"], &["--max-relmse", ".exr"]),
        (&[&png, &png, "--variance-b", &exr], &["--variance-b", ".exr"]),
        (&[&exr, &exr, "--variance-a", &png], &["scene.png", ".exr"]),
        (&[&exr, &exr, "--max-flip", "-1"], &["--max-flip", "0 or more"]),
        (&[&exr, &exr, "--max-flip", "NaN"], &["--max-flip", "0 or more"]),
        (&[&exr, &exr, "--pixels-per-degree", "0"], &["--pixels-per-degree", "2 to 1000"]),
        (&[&exr, &exr, "--flip-tone-map", "film"], &["--flip-tone-map", "aces"]),
        (&[&exr, &exr, "--map", "map.exr"], &["--map", "map.exr", ".png"]),
        (&[&exr, &exr, "--map", "missing/map.png"], &["missing/map.png", "no folder missing"]),
        (&[&exr, &exr, "--map", "a.png", "--side-by-side", "./a.png"], &["a.png", "twice"]),
        (&["text.png", "text.png", "--map", "./text.png"], &["text.png", "twice"]),
    ] {
        compare(folder.path(), words).assert_refused(said);
        assert_eq!(names(folder.path()), before, "{words:?}");
    }
}
