//! `--outputs`: what is in the files, by their formats' specifications.

use std::collections::BTreeMap;

use lanternfish_metrics::{RgbImage, exr_layers, read_exr_attributes, read_exr_layer};
use serde_json::{Value, json};

use crate::support::{Folder, write_flying};

/// A camera at (0.1, 0.9, 3) that looks along −z, with its principal point beside the middle; and the fastest light.
const CAMERA: &str = "--indirect none --intrinsics 60,50,20,18 --pose 1,0,0,0.1,0,1,0,0.9,0,0,1,3,0,0,0,1";
const SIZE: [usize; 2] = [48, 32];

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
    let folder = Folder::new();
    let path = |name: &str| folder.path(name);
    let all = "depth,distance,normal,albedo,motion,instance,material,semantic";
    folder.write("classes.json", r#"{"*block": 7, "left": 2}"#);
    let words = format!("demo:cornell {CAMERA} --classes classes.json --outputs {all}");
    folder.render(&format!("{words},position -o a.npz"));
    folder.render(&format!("{words},position -o a.exr --accumulate 2"));
    folder.render(&format!("{words} -o a.png"));

    let files = unzipped(&folder.read("a.npz"));
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
    folder.render(&format!("demo:cornell {CAMERA} -o plain.npz --accumulate 2"));
    let plain = unzipped(&folder.read("plain.npz"));
    assert_eq!(plain.len(), 1);
    assert!(folder.exr("a.exr").pixels.as_flattened() == floats(&plain, "image"), "the image is as it was");

    // Sixteen bits a channel: millimetres, and numbers of instances.
    let png = |name: &str| folder.png(name).pixels.into_iter().map(|pixel| pixel[0] * 65535.0);
    assert!(png("a.depth.png").zip(&depth).all(|(mm, depth)| mm.round() == (1000.0 * depth).round()));
    assert!(png("a.instance.png").zip(&ids).all(|(number, id)| number.round() == *id as f32));
    assert_eq!(folder.read("a.depth.png")[24..26], [16, 0], "16 bits of grey");
    assert_eq!(folder.read("a.names.json"), files["names.json"]);
    assert_eq!(folder.names("").iter().filter(|name| name.starts_with("a.") && name.ends_with("png")).count(), 9);
}

#[test]
#[ignore = "full"]
fn gpu_motion_leads_to_the_next_frame_and_classes_are_the_files() {
    let folder = Folder::new();
    write_flying(&folder.path(""), "kite", 2.4);
    // The triangle flies 0.1 m from one frame to the next, seen from 3 m.
    let words = format!("kite.gltf {CAMERA} --frames 1-2 --outputs semantic,motion,depth");
    folder.render(&format!("{words} -o a.npz"));
    for frame in ["a.0001.npz", "a.0002.npz"] {
        let files = unzipped(&folder.read(frame));
        let (motion, semantic) = (floats(&files, "motion"), array(&files, "semantic").1);
        assert!(semantic.contains(&8));
        for (motion, class) in motion.as_chunks::<2>().0.iter().zip(semantic) {
            let expected = if class == 8 { 60.0 * 0.1 / 3.0 } else { 0.0 };
            assert!((motion[0] - expected).abs() < 1e-3 && motion[1].abs() < 1e-3, "{motion:?}: {class}");
        }
    }
    // Moving the scene there and back changes no image.
    folder.render(&format!("kite.gltf {CAMERA} --frames 1-2 -o b.npz"));
    let image = |name: &str| array(&unzipped(&folder.read(name)), "image");
    assert_eq!([image("a.0001.npz"), image("a.0002.npz")], [image("b.0001.npz"), image("b.0002.npz")]);
    // A still is the frame of its time.
    folder.render(&format!("kite.gltf {CAMERA} --time 0.083333336 -o c.npz"));
    assert!(image("c.npz") == image("b.0002.npz") && image("c.npz") != image("b.0001.npz"));
    // What is complete is not rendered again; what lacks an output is.
    let skipped = |name: &str| {
        folder.render(&format!("{words} --skip-existing -o {name}")).stderr.contains("2 of 2 images exist")
    };
    assert!(skipped("a.npz") && !skipped("b.npz"));
}

#[test]
fn gpu_opencv_cameras_and_files_of_poses_are_the_same_camera() {
    let pose = "[[1, 0, 0, 0.1],\n [0, -1, 0, 0.9],\n [0, 0, -1, 3],\n [0, 0, 0, 1]]\n";
    let folder = Folder::with(&[("pose.txt", pose)]);
    folder.render(&format!("demo:cornell {CAMERA} -o a.exr"));
    let words = "--indirect none --intrinsics 60,50,20,18 --pose pose.txt --pose-convention opencv";
    folder.render(&format!("demo:cornell {words} -o b.exr"));
    assert_eq!(folder.exr("a.exr"), folder.exr("b.exr"));
}
