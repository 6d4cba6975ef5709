//! Tables, figures and exit codes, of images with reference values from the authors' evaluators.

use std::path::Path;

use lanternfish_metrics::{RgbImage, read_exr, read_png, write_exr, write_exr_layers, write_jpeg};
use serde_json::Value;

use super::*;
use crate::{
    cli::Command,
    testing::{Place, parsed},
};

const PAIRS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../lanternfish-metrics/tests/pairs/");

/// These words, in which `@` stands for the folder of pairs and `%` for the place.
fn words(place: &Place, words: &str) -> String {
    format!("compare {words}").replace('@', PAIRS).replace('%', &format!("{}/", place.path("").display()))
}

/// The figures, whose tables have all of these parts, with single spaces.
#[track_caller]
fn compared(place: &Place, line: &str, parts: &[&str]) -> Value {
    let line = words(place, line);
    let Ok(Command::Compare(args)) = parsed(&line) else { panic!("{line}") };
    let inputs = Inputs::read(&args).unwrap();
    let measures = Measures::take(&args, &inputs).unwrap();
    let tables = report::to_tables(&args, &inputs, &measures);
    let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ") + "\n";
    let lines: String = tables.lines().map(words).collect();
    for part in parts {
        assert!(lines.contains(part), "{part:?} is not in\n{tables}");
    }
    serde_json::from_str(&report::json_of(&args, &inputs, &measures)).unwrap()
}

#[test]
fn measures_are_those_of_the_authors() {
    let place = Place::new();
    // The mean of HDR-FLIP is 0.1316474 and 0.1675292, of LDR-FLIP 0.1108573, and scikit-image's SSIM 0.7803154.
    let hdr = ["relMSE", "HDR-FLIP 0.13164", "15 of -11.33 to 3.44 stops, aces", "SSIM", "PSNR, dB"];
    let linear = compared(&place, "@scene-noise.exr @scene.exr", &hdr);
    assert_eq!((&linear["linear"]["hdr_flip_exposure_count"], &linear["z_test"]), (&15.into(), &Value::Null));
    assert_eq!((&linear["pixels_compared"], &linear["faults"]["nan"]), (&6144.into(), &0.into()));
    assert!(linear["conclusion"].as_str().unwrap().starts_with("A has 1.0"), "{linear}");
    let reinhard = compared(&place, "@scene-noise.exr @scene.exr --flip-tone-map reinhard", &[]);
    assert!((reinhard["linear"]["hdr_flip"]["mean"].as_f64().unwrap() - 0.167_529_2).abs() < 1e-5, "{reinhard}");
    // The exposure affects display measures only.
    let flip = |figures: &Value| figures["display"]["ldr_flip"]["mean"].as_f64().unwrap();
    let dark = compared(&place, "@scene-noise.exr @scene.exr --exposure -12", &[]);
    assert!(flip(&dark) < flip(&linear) && dark["linear"] == linear["linear"]);
    let ldr = ["LDR-FLIP 0.110857", "SSIM 0.780315"];
    let display = compared(&place, "@scene-noise.png @scene.png", &ldr);
    assert_eq!(display["linear"], Value::Null);
    // At a smaller viewing distance, errors are more visible.
    let near = compared(&place, "@scene-noise.png @scene.png --pixels-per-degree 30", &[]);
    assert!((flip(&near) - 0.204_013_6).abs() < 1e-5, "{near}");
}

#[test]
fn equal_images_are_equal_and_jpeg_is_compared_like_png() {
    let place = Place::new();
    let image = read_png(Path::new(&format!("{PAIRS}scene.png"))).unwrap();
    let bytes: Vec<u8> = image.pixels.as_flattened().iter().map(|value| (255.0 * value).round() as u8).collect();
    write_jpeg(&place.path("scene.jpg"), [image.width as u32, image.height as u32], &bytes).unwrap();
    for both in ["@scene.exr @scene.exr", "@scene.png @scene.png", "%scene.jpg %scene.jpg"] {
        let figures = compared(&place, both, &["A and B are equal", "inf"]);
        assert!(figures["display"]["psnr_db"].is_null() && figures["is_equal"] == true, "{figures}");
    }
    compared(&place, "%scene.jpg @scene.png", &["LDR-FLIP", "SSIM"]);
    assert_eq!(place.run(&words(&place, "%scene.jpg @scene.png --max-flip 0.1")), Ok(0));
}

#[test]
fn limits_are_an_exit_code() {
    let place = Place::new();
    let mut broken = read_exr(Path::new(&format!("{PAIRS}scene.exr"))).unwrap();
    broken.pixels[100] = [f32::NAN; 3];
    broken.pixels[200] = [1.0, f32::INFINITY, 1.0];
    write_exr(&place.path("broken.exr"), &broken).unwrap();
    for (line, code) in [
        ("@scene-noise.exr @scene.exr --max-flip 0.14 --max-relmse 0.1", 0),
        ("@scene-noise.exr @scene.exr --max-flip 0.13", 1),
        ("@scene-noise.exr @scene.exr --max-relmse 0.001", 1),
        ("@scene.exr @scene.exr --max-flip 0", 0),
        // Pixels that are not finite exceed every limit.
        ("%broken.exr @scene.exr --max-flip 1", 1),
        ("%broken.exr @scene.exr --map %map.png --side-by-side %both.png", 0),
    ] {
        assert_eq!(place.run(&words(&place, line)), Ok(code), "{line}");
    }
    let counted = ["6,142 compared, 2 left out", "1 NaN, 1 +inf", "A and B are equal"];
    compared(&place, "%broken.exr @scene.exr", &counted);
    // Cyan in the map; three images and two gaps side by side.
    let map = read_png(&place.path("map.png")).unwrap();
    assert_eq!((map.pixels[100], map.pixels[200]), ([0.0, 1.0, 1.0], [0.0, 1.0, 1.0]));
    assert_eq!(map.pixels[101].map(|v| (255.0 * v) as u8), [0, 0, 4]);
    let both = read_png(&place.path("both.png")).unwrap();
    assert_eq!((both.width, both.height), (3 * 96 + 16, 64));
    let row = &both.pixels[20 * both.width..][..both.width];
    assert_eq!(row[..96], row[104..200]);
    assert!(place.contents().keys().eq(["both.png", "broken.exr", "map.png"]));
}

/// An image with normal noise of a tenth, and its variances as a layer.
fn write_noisy(path: &Path, seed: u64, factor: f32) -> RgbImage {
    let mut random = lanternfish_reference::Random::new(seed, 0, 0);
    let mut uniform = || random.unit().max(1e-9) as f32;
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
    let place = Place::new();
    let path = |name: &str| place.path(name);
    let variance = write_noisy(&path("a.exr"), 1, 1.0);
    write_noisy(&path("b.exr"), 2, 1.0);
    write_noisy(&path("brighter.exr"), 3, 1.01);
    write_exr_layers(&path("variance-of-a.exr"), &[("", &variance)], &[]).unwrap();
    // Variances from separate files; an image without variances counts as exact.
    let a = read_exr(&path("a.exr")).unwrap();
    write_exr_layers(&path("plain.exr"), &[("", &a)], &[]).unwrap();
    let zero = RgbImage::new(64, 64, vec![[0.0; 3]; 4096]).unwrap();
    write_exr_layers(&path("sure.exr"), &[("", &a), ("variance", &zero)], &[]).unwrap();
    let noise = ["a.exr, layer variance", "12,288", "mean z²", "4.550 %", "Noise explains the difference"];
    for (line, parts, verdict) in [
        ("%a.exr %b.exr", &noise[..], "noise"),
        ("%brighter.exr %b.exr", &["Noise does not explain the difference in brightness"], "offset"),
        ("%plain.exr %b.exr --variance-a %variance-of-a.exr", &["variance-of-a.exr\n", "Noise explains"], "noise"),
        ("%plain.exr %b.exr", &["none: taken to be exact", "does not explain"], "spread"),
        ("%sure.exr %plain.exr", &["no variance, equal 12,288", "equal, value by value"], "untested"),
        (
            "%plain.exr %b.exr --variance-b %sure.exr",
            &["12,288 values without variance differ: no noise explains those."],
            "untested",
        ),
    ] {
        let figures = compared(&place, line, parts);
        assert_eq!(figures["z_test"]["verdict"], verdict, "{line}");
    }
    place.refuses(&[(&words(&place, "%plain.exr %b.exr --variance-a @scene.exr"), "96×64 | 64×64")]);
}

#[test]
fn incomparable_images_are_refused() {
    let place = Place::with(&[("text.exr", "no image"), ("text.png", "no image"), ("text.jpg", "no image")]);
    // The decoder panics: the palette has an incomplete colour.
    place.write("palette.png", include_bytes!("../../tests/command_line/palette.png"));
    let small = RgbImage::new(4, 4, vec![[f32::NAN; 3]; 16]).unwrap();
    write_exr(&place.path("nan.exr"), &small).unwrap();
    write_exr_layers(&place.path("layer.exr"), &[("albedo", &small)], &[]).unwrap();
    for (line, said) in [
        ("%nowhere.exr @scene.exr", "nowhere.exr | No such file | hint: check the path"),
        ("%text.exr @scene.exr", "text.exr | not an OpenEXR image"),
        ("%text.png @scene.png", "text.png | not a PNG image"),
        ("%text.jpg @scene.png", "text.jpg | not a JPEG image"),
        ("%palette.png %palette.png", "palette.png: "),
        ("%nan.exr @scene.exr", "4×4 | 96×64"),
        ("%nan.exr %nan.exr", "no pixel is finite"),
        ("%layer.exr @scene.exr", "layer.exr | albedo.B, albedo.G, albedo.R"),
        ("%a.gif @scene.exr", "a.gif | .exr | .png"),
        ("@scene.png @scene.exr", "scene.png | scene.exr | both as"),
        ("%text.jpg @scene.exr", "display colours (PNG, JPEG)"),
        ("@scene.exr", "<B>"),
        ("@scene.png @scene.png --exposure 1", "--exposure | .exr"),
        ("@scene.png @scene.png --max-relmse 1", "--max-relmse | .exr"),
        ("@scene.png @scene.png --variance-b @scene.exr", "--variance-b | .exr"),
        ("@scene.exr @scene.exr --variance-a @scene.png", "scene.png | .exr"),
        ("@scene.exr @scene.exr --max-flip -1", "--max-flip | 0 or more"),
        ("@scene.exr @scene.exr --max-flip NaN", "--max-flip | 0 or more"),
        ("@scene.exr @scene.exr --pixels-per-degree 0", "--pixels-per-degree | 2 to 1000"),
        ("@scene.exr @scene.exr --flip-tone-map film", "--flip-tone-map | aces"),
        ("@scene.exr @scene.exr --map %map.exr", "--map | map.exr | .png"),
        ("@scene.exr @scene.exr --map %missing/map.png", "missing/map.png | no folder"),
        ("@scene.exr @scene.exr --map %a.png --side-by-side %./a.png", "a.png | twice"),
        ("%text.png %text.png --map %./text.png", "text.png | twice"),
    ] {
        place.refuses(&[(&words(&place, line), said)]);
    }
}
