//! Tests of path confinement and memory limits.

use std::fs;
use std::path::PathBuf;

use glam::Vec3;

use crate::{LoadOptions, SceneError, UpAxis, hold_files, load, load_files, load_with};

const CONFINED: LoadOptions =
    LoadOptions { scene: None, variant: None, up: UpAxis::Y, confine: true, memory_limit: None };

/// A folder with a file of 36 zero bytes (enough for a triangle), and the scene's folder inside it.
struct Place {
    root: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let root = tempfile::tempdir().unwrap();
        for name in ["secret.bin", "scene/own.bin", "scene/inner/deep.bin", "scene/a b.bin", "scene/.../odd.bin"] {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, [0; 36]).unwrap();
        }
        Self { root }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root.path().join(name)
    }

    /// A scene whose buffer is `uri`.
    fn scene(&self, uri: &str) -> PathBuf {
        let path = self.path("scene/scene.gltf");
        let json = serde_json::json!({
            "asset": { "version": "2.0" },
            "buffers": [{ "byteLength": 36, "uri": uri }],
            "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
            "accessors": [{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
            "nodes": [{ "mesh": 0 }],
        });
        fs::write(&path, json.to_string()).unwrap();
        path
    }
}

/// Every spelling of a path outside is refused, and no other path.
#[test]
fn a_confined_scene_reads_its_folder_alone() {
    let place = Place::new();
    let absolute = place.path("secret.bin");
    let absolute = absolute.to_str().unwrap();
    for uri in ["own.bin", "./own.bin", "inner/deep.bin", "inner/../own.bin", "a%20b.bin", "%6fwn.bin", ".../odd.bin"] {
        let scene = place.scene(uri);
        assert!(load_with(&scene, &CONFINED).is_ok() && load(&scene).is_ok(), "{uri}");
    }
    for uri in [
        "../secret.bin",
        "./../secret.bin",
        "..//secret.bin",
        "inner/../../secret.bin",
        "inner/../inner/../../secret.bin",
        "%2e%2e/secret.bin",
        "%2E%2E%2Fsecret.bin",
        ".%2e/secret.bin",
        "%2e./%73ecret.bin",
    ] {
        let scene = place.scene(uri);
        assert!(load(&scene).is_ok(), "{uri} is there");
        let refused = load_with(&scene, &CONFINED);
        assert!(matches!(refused, Err(SceneError::Outside { .. })), "{uri}: {refused:?}");
    }
    // Refused with and without confinement: absolute paths, other URI schemes, and URIs that decode to no path.
    let encoded = absolute.replace('/', "%2F");
    let file_uri = format!("file://{absolute}");
    for uri in
        [absolute, &encoded, &file_uri, "%252e%252e/secret.bin", "..%5csecret.bin", "%00", "..", ".", "inner", ""]
    {
        assert!(load_with(place.scene(uri), &CONFINED).is_err(), "{uri}");
    }
    // The error does not reveal whether a file outside exists.
    let missing = load_with(place.scene("../missing.bin"), &CONFINED);
    assert!(matches!(missing, Err(SceneError::Outside { .. })), "{missing:?}");
}

#[cfg(unix)]
#[test]
fn links_do_not_lead_out() {
    use std::os::unix::fs::symlink;
    let place = Place::new();
    symlink(place.path("secret.bin"), place.path("scene/link.bin")).unwrap();
    symlink("link.bin", place.path("scene/link of link.bin")).unwrap();
    symlink("../..", place.path("scene/inner/up")).unwrap();
    symlink("inner/deep.bin", place.path("scene/within.bin")).unwrap();
    for uri in ["link.bin", "link%20of%20link.bin", "inner/up/secret.bin"] {
        let scene = place.scene(uri);
        assert!(load(&scene).is_ok(), "{uri} is there");
        let refused = load_with(&scene, &CONFINED);
        assert!(matches!(refused, Err(SceneError::Outside { .. })), "{uri}: {refused:?}");
    }
    // The error does not reveal whether a link's target exists.
    symlink(place.path("missing.bin"), place.path("scene/dangling.bin")).unwrap();
    for uri in ["dangling.bin", "inner/up/missing.bin", "inner/up/missing/secret.bin"] {
        let refused = load_with(place.scene(uri), &CONFINED);
        assert!(matches!(refused, Err(SceneError::Outside { .. })), "{uri}: {refused:?}");
    }
    for uri in ["missing.bin", "inner/missing.bin", "inner/missing/../own.bin"] {
        let refused = load_with(place.scene(uri), &CONFINED);
        assert!(matches!(refused, Err(SceneError::Io { .. })), "{uri}: {refused:?}");
    }
    // Links within the folder are allowed, and so is a link to the complete folder.
    for uri in ["within.bin", "inner/up/scene/own.bin"] {
        assert!(load_with(place.scene(uri), &CONFINED).is_ok(), "{uri}");
    }
    place.scene("own.bin");
    symlink(place.path("scene"), place.path("elsewhere")).unwrap();
    assert!(load_with(place.path("elsewhere/scene.gltf"), &CONFINED).is_ok());
    // A scene that is itself a link to elsewhere is outside its folder.
    fs::create_dir(place.path("upload")).unwrap();
    symlink(place.path("scene/scene.gltf"), place.path("upload/scene.gltf")).unwrap();
    assert!(matches!(load_with(place.path("upload/scene.gltf"), &CONFINED), Err(SceneError::Outside { .. })));
}

/// A library or texture outside the folder is left out, as a missing one is.
#[test]
fn obj_files_are_confined_too() {
    let place = Place::new();
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbaImage::new(1, 1).write_to(&mut png, image::ImageFormat::Png).unwrap();
    fs::write(place.path("out side.png"), png.get_ref()).unwrap();
    fs::write(place.path("scene/own.png"), png.get_ref()).unwrap();
    fs::write(place.path("out.mtl"), "newmtl a\nKd 1 0 0\n").unwrap();
    let path = place.path("scene/scene.obj");
    let read = |library: &str, map: &str, options: &LoadOptions| {
        fs::write(place.path("scene/own.mtl"), format!("newmtl a\nKd 1 0 0\nmap_Kd {map}\n")).unwrap();
        let text = format!("mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
        fs::write(&path, text).unwrap();
        let scene = load_with(&path, options).unwrap();
        (scene.images.len(), scene.materials[0].base_color.y)
    };
    let free = LoadOptions::default();
    let absolute = place.path("out side.png");
    for map in ["../out side.png", "..\\out side.png", "-s 1 1 1 ../out side.png", "./../out side.png"] {
        assert_eq!((read("own.mtl", map, &free), read("own.mtl", map, &CONFINED)), ((1, 0.0), (0, 0.0)), "{map}");
    }
    assert_eq!(read("own.mtl", absolute.to_str().unwrap(), &free), (0, 0.0), "absolute paths are never read");
    assert_eq!(
        (read("own.mtl", "own.png", &CONFINED), read("own.mtl", "inner\\..\\own.png", &CONFINED)),
        ((1, 0.0), (1, 0.0))
    );
    // White, as without a material.
    assert_eq!((read("../out.mtl", "own.png", &free), read("../out.mtl", "own.png", &CONFINED)), ((0, 0.0), (0, 0.8)));
    assert_eq!(read("..\\out.mtl", "own.png", &CONFINED), (0, 0.8));
}

#[test]
fn coordinates_whose_squares_overflow_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("far.obj");
    let load_text = |text: &str| {
        fs::write(&path, text).unwrap();
        load(&path).map(|_| ()).map_err(|error| error.to_string())
    };
    let quad = |z: &str| format!("o wall\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 {z}\nf 1 2 3\nf 1 3 4\n");
    for z in ["-3.4e38", "1e20", "1.1e12"] {
        let error = load_text(&quad(z)).unwrap_err();
        assert!(error.contains("instance 0 (wall): ") && error.contains("farther than 1e12 m"), "{error}");
    }
    assert_eq!(load_text(&quad("-9e11")), Ok(()));
    // Unused vertices are dropped.
    assert_eq!(load_text("v 1e30 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 3 4\n"), Ok(()));
}

#[test]
fn memory_is_checked_before_allocation() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wide.obj");
    // One polygon of 100,000 corners: 300 kB of text, 64 MB of triangles.
    let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf{}\n", " 1 2 3".repeat(33_334));
    fs::write(&path, &text).unwrap();
    let within =
        |memory_limit: u64| load_with(&path, &LoadOptions { memory_limit: Some(memory_limit), ..Default::default() });
    let error = within(20_000_000).unwrap_err().to_string();
    assert!(error.contains("wide.obj: 100000 triangles need 64.0 MB of memory, the limit is 20.0 MB"), "{error}");
    let error = within(1000).unwrap_err().to_string();
    assert!(error.contains("wide.obj needs 200.0 kB of memory"), "{error}");
    assert!(within(100_000_000).is_ok());
    // Text alone: its cleaned form takes up to eight times as much.
    fs::write(&path, "# filler\n".repeat(100_000)).unwrap();
    let error = within(3_000_000).unwrap_err().to_string();
    assert!(error.contains("wide.obj: its text needs 2.7 MB"), "{error}");
    assert!(within(10_000_000).is_ok());
}

/// Materials are counted before they are allocated; exceeding the budget is an error, not a missing file.
#[test]
fn libraries_and_textures_are_within_the_budget() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.obj");
    fs::write(&path, "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n").unwrap();
    let within = |library: &str| {
        fs::write(folder.path().join("a.mtl"), library).unwrap();
        load_with(&path, &LoadOptions { memory_limit: Some(5_000_000), ..Default::default() })
    };
    let refused = |library: &str| match within(library) {
        Err(SceneError::TooMuch { need, .. }) => need.what,
        other => panic!("not refused: {:?}", other.map(|scene| scene.materials.len())),
    };
    assert_eq!(refused(&"newmtl a\n".repeat(20_000)), "the materials of a.mtl need");
    assert_eq!(refused(&"# filler\n".repeat(1_000_000)), "a.mtl needs");
    fs::write(folder.path().join("wide.png"), vec![0; 6_000_000]).unwrap();
    assert_eq!(refused("newmtl a\nmap_Kd wide.png\n"), "wide.png needs");
    assert_eq!(within("newmtl a\nKd 1 0 0\n").unwrap().materials[0].base_color.y, 0.0);
}

/// With z up the file's +z is the scene's +y, and its +y the scene's -z.
#[test]
fn files_with_z_up_stand() {
    let place = Place::new();
    fs::write(place.path("point.obj"), "v 0 1 2\nv 0 1 2\nv 0 1 2\nf 1 2 3\n").unwrap();
    let nodes = r#"{ "asset": { "version": "2.0" }, "nodes": [{ "camera": 0, "translation": [0, 1, 2] }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }] }"#;
    fs::write(place.path("eye.gltf"), nodes).unwrap();
    for (up, expected) in [(UpAxis::Y, Vec3::new(0.0, 1.0, 2.0)), (UpAxis::Z, Vec3::new(0.0, 2.0, -1.0))] {
        let read = |name| load_with(place.path(name), &LoadOptions { up, ..LoadOptions::default() }).unwrap();
        assert_eq!(read("point.obj").bounds().center(), expected);
        let scene = read("eye.gltf");
        assert_eq!((scene.cameras[0].eye(), scene.motion.world_from_roots), (expected, up.world_from_file()));
    }
}

/// Files in memory are found by path, else by name; nothing else is read, and the budget counts them.
#[test]
fn a_scene_is_read_from_memory() {
    let place = Place::new();
    let json = fs::read(place.scene("inner/deep.bin")).unwrap();
    let load = |files: &[(&str, &[u8])], memory_limit| {
        let files: Vec<(PathBuf, Vec<u8>)> = files.iter().map(|(name, bytes)| (name.into(), bytes.to_vec())).collect();
        load_files(&files[0].0, &files, &LoadOptions { memory_limit, ..CONFINED })
    };
    let positions = |scene: &crate::Scene| scene.meshes[0].primitives[0].positions.clone();
    let (zeros, ones) = ([0; 36], [1; 36]);
    let on_disk = load_with(place.path("scene/scene.gltf"), &CONFINED).unwrap();
    for names in [["a/s.gltf", "a/inner/deep.bin"], ["s.gltf", "deep.bin"]] {
        let scene = load(&[(names[0], &json), (names[1], &zeros)], None).unwrap();
        assert_eq!(positions(&scene), positions(&on_disk));
    }
    let of_path = load(&[("s.gltf", &json), ("deep.bin", &ones), ("inner/deep.bin", &zeros)], None).unwrap();
    assert_eq!(positions(&of_path), positions(&on_disk));
    assert!(matches!(load(&[("s.gltf", &json)], None), Err(SceneError::Io { .. } | SceneError::Invalid { .. })));
    let path = place.path("scene/scene.gltf");
    assert!(load(&[(path.to_str().unwrap(), &json)], None).is_err(), "a file beside it was read");
    assert!(matches!(load(&[("s.gltf", &json), ("deep.bin", &zeros)], Some(100)), Err(SceneError::TooMuch { .. })));
    // The same of a thread that holds files.
    let held = [("s.gltf", &json[..]), ("deep.bin", &zeros[..])].map(|(name, bytes)| (name.into(), bytes.to_vec()));
    hold_files(held.to_vec());
    assert_eq!(positions(&crate::load("there/s.gltf").unwrap()), positions(&on_disk));
    assert!(crate::load(path).is_err(), "a file on disk was read");
    hold_files(Vec::new());
    assert!(crate::load("there/s.gltf").is_err());
}
