//! `--outputs`: what is in the files, by their formats' specifications.

use std::{collections::BTreeMap, fs, path::Path};

use lanternfish_metrics::{RgbImage, exr_layers, read_exr, read_exr_attributes, read_exr_layer, read_png};
use serde_json::{Value, json};

use crate::support::{lanternfish, names, write_flying};

/// A camera at (0.1, 0.9, 3) that looks along −z, with its principal point beside the middle.
const CAMERA: &str = "--intrinsics 60,50,20,18 --pose 1,0,0,0.1,0,1,0,0.9,0,0,1,3,0,0,0,1";
const SIZE: [usize; 2] = [48, 32];

/// Runs `render` in a folder, and returns what it says to standard error.
#[track_caller]
fn render(folder: &Path, words: &str) -> (bool, String) {
    let words = format!("render {words} --adapter cpu --size 48x32 --indirect none");
    let output = lanternfish(folder).args(words.split_whitespace()).output().unwrap();
    (output.status.success(), String::from_utf8(output.stderr).unwrap())
}

#[track_caller]
fn rendered(folder: &Path, words: &str) {
    let (success, said) = render(folder, words);
    assert!(success, "{said}");
}

/// The stored files of an archive by name.
fn unzipped(bytes: &[u8]) -> BTreeMap<String, Vec<u8>> {
    let number =
        |at: usize, count: usize| bytes[at..at + count].iter().rev().fold(0, |n, byte| 256 * n + usize::from(*byte));
    let (mut files, mut at) = (BTreeMap::new(), 0);
    while bytes[at..].starts_with(b"PK\x03\x04") {
        let (size, length) = (number(at + 18, 4), number(at + 26, 2));
        let (name, content) = (&bytes[at + 30..at + 30 + length], at + 30 + length);
        files.insert(String::from_utf8(name.to_vec()).unwrap(), bytes[content..content + size].to_vec());
        at = content + size;
    }
    let end = bytes.len() - 22;
    assert!(bytes[end..].starts_with(b"PK\x05\x06") && number(end + 10, 2) == files.len());
    assert_eq!((number(end + 16, 4), number(end + 12, 4)), (at, end - at), "the directory is where it is said to be");
    files
}

/// The words of an array file, and its shape.
fn array(files: &BTreeMap<String, Vec<u8>>, name: &str) -> (String, Vec<u32>) {
    let bytes = &files[&format!("{name}.npy")];
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = std::str::from_utf8(&bytes[10..start]).unwrap();
    let shape = header.split(&['(', ')']).nth(1).unwrap().to_owned();
    (shape, bytes[start..].as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect())
}

fn floats(files: &BTreeMap<String, Vec<u8>>, name: &str) -> Vec<f32> {
    array(files, name).1.into_iter().map(f32::from_bits).collect()
}

#[test]
fn gpu_every_format_has_the_same_outputs() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, path) = (folder.path(), |name: &str| folder.path().join(name));
    let all = "depth,distance,normal,albedo,motion,instance,material,semantic";
    fs::write(path("classes.json"), r#"{"*block": 7, "left": 2}"#).unwrap();
    let words = format!("demo:cornell {CAMERA} --classes classes.json --outputs {all}");
    rendered(folder, &format!("{words},position -o a.npz"));
    rendered(folder, &format!("{words},position -o a.exr --accumulate 4"));
    rendered(folder, &format!("{words} -o a.png"));

    let files = unzipped(&fs::read(path("a.npz")).unwrap());
    assert_eq!(array(&files, "image").0, "32, 48, 3");
    assert_eq!((array(&files, "depth").0, array(&files, "motion").0), ("32, 48".to_owned(), "32, 48, 2".to_owned()));
    let (depth, position, distance) = (floats(&files, "depth"), floats(&files, "position"), floats(&files, "distance"));
    let (ids, semantic) = (array(&files, "instance").1, array(&files, "semantic").1);
    let listed: Value = serde_json::from_slice(&files["names.json"]).unwrap();
    for i in (0..depth.len()).filter(|i| depth[*i] > 0.0) {
        let ray = [(i % SIZE[0]) as f32 + 0.5 - 20.0, 18.0 - (i / SIZE[0]) as f32 - 0.5];
        let expected = [0.1 + ray[0] / 60.0 * depth[i], 0.9 + ray[1] / 50.0 * depth[i], 3.0 - depth[i]];
        let apart = (0..3).map(|axis| (position[3 * i + axis] - expected[axis]).abs()).fold(0.0, f32::max);
        assert!(apart < 1e-4, "{i}: {:?} is not {expected:?}", &position[3 * i..3 * i + 3]);
        let along = ((ray[0] / 60.0).powi(2) + (ray[1] / 50.0).powi(2) + 1.0).sqrt();
        assert!((distance[i] / depth[i] - along).abs() < 1e-4);
        let instance = &listed["instances"][ids[i] as usize - 1];
        let class = match instance["name"].as_str().unwrap() {
            "left" => 2,
            name if name.ends_with("block") => 7,
            _ => 0,
        };
        assert_eq!((&instance["semantic"], semantic[i]), (&json!(class), class));
    }
    assert!([2, 7, 0].iter().all(|class| semantic.contains(class)) && depth.contains(&0.0));
    // The back wall.
    assert!(depth.iter().any(|depth| (depth - 4.0).abs() < 1e-4));

    let layers = exr_layers(&path("a.exr")).unwrap();
    let expected =
        ["", "Depth", "DiffCol", "Distance", "IndexMA", "IndexOB", "Motion", "Normal", "Position", "Semantic"];
    assert_eq!(layers, expected);
    let albedo: Vec<[f32; 3]> = floats(&files, "albedo").as_chunks::<3>().0.to_vec();
    assert_eq!(read_exr_layer(&path("a.exr"), "DiffCol").unwrap(), RgbImage::new(SIZE[0], SIZE[1], albedo).unwrap());
    let told = &read_exr_attributes(&path("a.exr")).unwrap()["lanternfish.names"];
    assert_eq!(told.as_bytes(), files["names.json"]);
    rendered(folder, &format!("demo:cornell {CAMERA} -o plain.npz --accumulate 4"));
    let plain = unzipped(&fs::read(path("plain.npz")).unwrap());
    assert_eq!(plain.len(), 1);
    assert!(
        read_exr(&path("a.exr")).unwrap().pixels.as_flattened() == floats(&plain, "image"),
        "the image is as it was"
    );

    // Sixteen bits a channel: millimetres, and numbers of instances.
    let png = |name: &str| read_png(&path(name)).unwrap().pixels.into_iter().map(|pixel| pixel[0] * 65535.0);
    assert!(png("a.depth.png").zip(&depth).all(|(mm, depth)| mm.round() == (1000.0 * depth).round()));
    assert!(png("a.instance.png").zip(&ids).all(|(number, id)| number.round() == *id as f32));
    assert_eq!(&fs::read(path("a.depth.png")).unwrap()[24..26], [16, 0], "16 bits of grey");
    assert_eq!(fs::read(path("a.names.json")).unwrap(), files["names.json"]);
    assert_eq!(names(folder).iter().filter(|name| name.starts_with("a.") && name.ends_with("png")).count(), 9);
}

#[test]
fn gpu_motion_leads_to_the_next_frame_and_classes_are_the_files() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_flying(folder, "kite", 2.4);
    // The triangle flies 0.1 m from one frame to the next, seen from 3 m.
    let words = format!("kite.gltf {CAMERA} --frames 1-2 --outputs semantic,motion,depth");
    rendered(folder, &format!("{words} -o a.npz"));
    for frame in ["a.0001.npz", "a.0002.npz"] {
        let files = unzipped(&fs::read(folder.join(frame)).unwrap());
        let (motion, semantic) = (floats(&files, "motion"), array(&files, "semantic").1);
        assert!(semantic.contains(&8));
        for (motion, class) in motion.as_chunks::<2>().0.iter().zip(semantic) {
            let expected = if class == 8 { 60.0 * 0.1 / 3.0 } else { 0.0 };
            assert!((motion[0] - expected).abs() < 1e-3 && motion[1].abs() < 1e-3, "{motion:?}: {class}");
        }
    }
    // Moving the scene there and back changes no image.
    rendered(folder, &format!("kite.gltf {CAMERA} --frames 1-2 -o b.npz"));
    let image = |name: &str| array(&unzipped(&fs::read(folder.join(name)).unwrap()), "image");
    assert_eq!([image("a.0001.npz"), image("a.0002.npz")], [image("b.0001.npz"), image("b.0002.npz")]);
    // What is complete is not rendered again; what lacks an output is.
    let skipped = |words: &str| render(folder, &format!("{words} --skip-existing")).1.contains("2 of 2 images exist");
    assert!(skipped(&format!("{words} -o a.npz")) && !skipped(&format!("{words} -o b.npz")));
}

#[test]
fn gpu_opencv_cameras_and_files_of_poses_are_the_same_camera() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("pose.txt"), "[[1, 0, 0, 0.1],\n [0, -1, 0, 0.9],\n [0, 0, -1, 3],\n [0, 0, 0, 1]]\n")
        .unwrap();
    rendered(folder, &format!("demo:cornell {CAMERA} -o a.exr"));
    rendered(folder, "demo:cornell --intrinsics 60,50,20,18 --pose pose.txt --pose-convention opencv -o b.exr");
    let read = |name: &str| read_exr(&folder.join(name)).unwrap();
    assert_eq!(read("a.exr"), read("b.exr"));
    // Without a legend a debug view has the size of the image.
    rendered(folder, "demo:cornell --debug-view depth --legend off -o c.png");
    let view = read_png(&folder.join("c.png")).unwrap();
    assert_eq!([view.width, view.height], SIZE);
}

#[test]
fn outputs_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("classes.json"), r#"{"a": "b"}"#).unwrap();
    for (words, said) in [
        ("--outputs depth,norml", &["distance, position, normal", "did you mean \"normal\""][..]),
        ("--outputs position -o a.png", &["position", ".exr or .npz"]),
        ("--outputs depth --stereo vive", &["--stereo"]),
        ("--outputs semantic --classes classes.json", &["classes.json", "whole numbers"]),
        ("--classes classes.json", &["--outputs"]),
        ("--pose 1,0,0,0", &["16 numbers"]),
        ("--pose 2,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1", &["scales"]),
        ("--pose 1,0,0,0,0,1,0,0,0,0,1,0,1,2,3,1", &["last row"]),
        ("--intrinsics 0,1,2,3", &["fx,fy,cx,cy"]),
    ] {
        let (success, text) = render(folder.path(), &format!("demo:cornell {words}"));
        assert!(!success && said.iter().all(|part| text.contains(part)), "{words}: {text}");
    }
    assert_eq!(names(folder.path()), ["classes.json"]);
}
