//! `lanternfish deep-images`, end to end on the software adapter.

use std::{fs, path::Path};

use crate::support::lanternfish;

/// Success, standard output and standard error.
fn deep_images(folder: &Path, words: &str) -> (bool, String, String) {
    let output = lanternfish(folder)
        .arg("deep-images")
        .args(words.split_whitespace())
        .args(["--adapter", "cpu"])
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.success(), text(output.stdout), text(output.stderr))
}

fn said(folder: &Path, words: &str) -> String {
    let (success, stdout, stderr) = deep_images(folder, words);
    assert!(success, "{words}: {stderr}");
    stdout
}

/// Width, height and pixels.
fn rendering(path: &Path) -> (usize, usize, Vec<[f32; 3]>) {
    let scene = lanternfish_metrics::read_png(path).unwrap();
    (scene.width, scene.height, scene.pixels)
}

const SMALL: &str = "demo:cornell --directions stacks:3x4 --resolution 32";

#[test]
fn gpu_every_view_gives_an_image() {
    let folder = tempfile::tempdir().unwrap();
    for (view, size, lines) in [
        ("points --size 96x54", (96, 54), &["shown       all images"][..]),
        ("points --size 96x54 --image 11", (96, 54), &["shown       image 11, along "]),
        ("layer --layer -1 --upscale 3", (96, 96), &["layers      -1", "dark blue: no fragment"]),
        ("layers --layers 2 --image 5 --upscale 1", (2 * 32 + 8, 32), &["layers      0, 1", "scale       white -"]),
        ("transparent --upscale 1", (3 * 32 + 16, 2 * 32 + 8), &["shown       image 0, along ", "image 10, along "]),
        ("transparent --image 7 --upscale 2", (64, 64), &["shown       image 7, along "]),
        ("count --upscale 2", (64, 64), &[" per texel on average, ", "scale       black 0, blue "]),
    ] {
        let said = said(folder.path(), &format!("{SMALL} -o a.png --view {view}"));
        assert_eq!(said.lines().last(), Some("a.png"), "{said}");
        for line in
            ["directions  stacks:3x4\n", "images      12 of 32 x 32 texels, per_triangle\n", "bytes  ", "build  "]
        {
            assert!(said.contains(line), "{line:?} is not in\n{said}");
        }
        for line in lines {
            assert!(said.contains(line), "{line:?} is not in\n{said}");
        }
        let (width, height, pixels) = rendering(&folder.path().join("a.png"));
        assert_eq!((width, height), size, "{view}");
        assert!(pixels.iter().any(|pixel| *pixel != pixels[0]), "{view}: the image is uniform");
    }
}

#[test]
fn gpu_missing_images_and_layers_are_refused_with_the_valid_range() {
    let folder = tempfile::tempdir().unwrap();
    for (words, known) in [
        ("--image 12", "there is no image 12: 12 directions have images 0 to 11"),
        ("--view count --image 12", "images 0 to 11"),
        ("--view layer --image 3 --layer 99", "there is no layer 99: the longest list of image 3 holds "),
        ("--view layer --layer -99", "there is no layer -99"),
        ("--view count --upscale 1024", "choose a smaller --upscale"),
        ("--view layers --image 3 --upscale 512", "choose a smaller --upscale"),
        ("--directions zonal:4096 --resolution 1024", "at most 2147483648 are supported"),
        ("--builder single_pass --resolution 2500", "choose a smaller --resolution"),
    ] {
        let (success, stdout, stderr) = deep_images(folder.path(), &format!("{SMALL} -o a.png {words}"));
        assert!(!success && stdout.is_empty() && stderr.contains(known), "{words}: {stderr}");
        assert!(!stderr.contains("panicked") && !stderr.contains("internal error"), "{words}: {stderr}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn invalid_flags_are_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    for (words, known) in [
        ("demo:cornell --directions ball:9", "zonal:169, stacks:13x13 or cube:5"),
        ("demo:cornell --directions cube:99", "29403 directions: expected 1 to 4096"),
        ("demo:cornell -o a.exr", "end the name with .png"),
        ("demo:cornell --builder magic", "single_pass"),
        ("demo:cornell --view all", "layers"),
        ("nowhere.glb", "No such file"),
    ] {
        let (success, stdout, stderr) = deep_images(folder.path(), words);
        assert!(!success && stdout.is_empty() && stderr.contains(known), "{words}: {stderr}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn gpu_a_shot_gives_scene_and_camera() {
    let folder = tempfile::tempdir().unwrap();
    let shot = "scene = \"demo:cornell\"\n[output]\noutput = \"other.png\"\nsize = [80, 60]\n[view]\neye = [0, 1, 2]\n";
    fs::write(folder.path().join("a.toml"), shot).unwrap();
    let words = "--directions cube:1 --resolution 32";
    assert!(said(folder.path(), &format!("a.toml {words}")).ends_with("\na.deep-images.png\n"));
    let (width, height, from_shot) = rendering(&folder.path().join("a.deep-images.png"));
    assert_eq!((width, height), (80, 60));
    said(folder.path(), &format!("demo:cornell {words} --eye 0,1,2 --size 80x60 -o b.png"));
    assert_eq!(rendering(&folder.path().join("b.png")).2, from_shot);
    // A flag overrides the shot's key.
    said(folder.path(), &format!("a.toml {words} --eye 0.3,1,2 -o c.png"));
    assert_ne!(rendering(&folder.path().join("c.png")).2, from_shot);
}
