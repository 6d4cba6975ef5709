//! Tests of files with several scenes and files with unusual names.

use serde_json::json;

use super::{File, TRIANGLE, assert_contains, bytes_of, load_with_options};
use crate::import::{LoadOptions, load, load_with};

fn named(scene: Option<&str>) -> LoadOptions {
    LoadOptions { scene: scene.map(str::to_owned), ..LoadOptions::default() }
}

#[test]
fn scenes_are_selected_by_name_or_index() {
    let mut file = File::with_triangle();
    for x in 1..6 {
        file.push("nodes", json!({ "mesh": 0, "translation": [x, 0, 0] }));
    }
    file.json["scenes"] =
        json!([{ "name": "one", "nodes": [0] }, { "nodes": [1, 2] }, { "name": "1", "nodes": [3, 4, 5] }]);
    file.json["scene"] = json!(1);
    for (scene, count) in [(None, 2), (Some("one"), 1), (Some("0"), 1), (Some("2"), 3), (Some("1"), 3)] {
        assert_eq!(
            load_with_options(&file, &named(scene)).expect("there is one").instances.len(),
            count,
            "{scene:?}: names go before indices"
        );
    }
    for scene in ["3", "-1", "One", ""] {
        let error = load_with_options(&file, &named(Some(scene))).expect_err("there is none").to_string();
        assert_contains(&error, &format!("file.glb: no scene {scene:?}; there are: 0 \"one\", 1, 2 \"1\""));
    }
    let error = load_with_options(&File::with_triangle(), &named(Some("0"))).expect_err("nodes without a scene");
    assert_contains(&error.to_string(), "only one, which has neither name nor index");
    assert!(load_with("demo:cornell", &named(Some("0"))).is_ok());
    for source in ["demo:cornell", "some.obj"] {
        let error = load_with(source, &named(Some("x"))).expect_err("there is only one").to_string();
        assert_contains(&error, &format!("{source}: no scene \"x\"; there are: only one, 0"));
    }
}

#[test]
fn names_may_be_of_any_script_and_percent_encoded() {
    let folder = tempfile::tempdir().expect("a folder");
    let inner = folder.path().join("Straße 東京");
    std::fs::create_dir(&inner).expect("a folder");
    std::fs::create_dir(inner.join("ü#&+ 100%")).expect("a folder");
    std::fs::write(inner.join("ü#&+ 100%/ñ [1].bin"), bytes_of(&TRIANGLE)).expect("written");
    let mut file = File::with_triangle();
    let path = inner.join("Lichtfänger 灯.gltf");
    // Percent-encoded in full, in part, and not at all.
    for uri in [
        "%C3%BC%23%26%2B%20100%25/%C3%B1%20%5B1%5D.bin",
        "ü%23&+ 100%25/ñ%20[1].bin",
        "ü#&+ 100%/ñ [1].bin",
        "./ü#&+ 100%/../ü#&+ 100%/ñ [1].bin",
    ] {
        file.json["buffers"] = json!([{ "byteLength": 36, "uri": uri }]);
        std::fs::write(&path, file.json.to_string()).expect("written");
        let scene = load(path.to_str().expect("UTF-8")).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((scene.triangle_counts().0, scene.name.as_str()), (1, "Lichtfänger 灯"), "{uri}");
    }
    for uri in ["%FF.bin", "%00.bin", "missing%20file.bin"] {
        file.json["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, file.json.to_string()).expect("written");
        load(path.to_str().expect("UTF-8")).expect_err(uri);
    }
}

#[cfg(unix)]
#[test]
fn only_regular_files_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.gltf");
    std::os::unix::fs::symlink("/dev/zero", folder.path().join("endless.bin")).expect("a link");
    let status = std::process::Command::new("mkfifo").arg(folder.path().join("silent.bin")).status();
    assert!(status.expect("mkfifo runs").success());
    std::fs::create_dir(folder.path().join("folder.bin")).expect("a folder");
    let mut file = File::with_triangle();
    for uri in ["endless.bin", "silent.bin", "folder.bin"] {
        file.json["buffers"] = json!([{ "byteLength": 36, "uri": uri }]);
        std::fs::write(&path, file.json.to_string()).expect("written");
        let error = load(path.to_str().expect("UTF-8")).expect_err("it has no end").to_string();
        assert_contains(&error, &format!("{uri}: not a regular file"));
    }
    // A link to a regular file is read.
    std::fs::write(folder.path().join("real"), bytes_of(&TRIANGLE)).expect("written");
    std::os::unix::fs::symlink("real", folder.path().join("link.bin")).expect("a link");
    file.json["buffers"][0]["uri"] = json!("link.bin");
    std::fs::write(&path, file.json.to_string()).expect("written");
    assert!(load(path.to_str().expect("UTF-8")).is_ok());
}

#[test]
fn files_that_are_no_scenes_are_refused() {
    let fault = |bytes: &[u8]| super::load_bytes(bytes).expect_err("no scene").to_string();
    assert_contains(&fault(b""), "the file is empty");
    assert_contains(&fault(b" \n"), "the file is empty");
    assert_contains(&fault(b"\x89PNG\r\n"), "not glTF: starts like neither GLB");
    assert_contains(&fault(b"[]"), "not glTF");
    assert_contains(&fault(b"glT"), "not glTF");
    assert_contains(&fault(b"glTF\x02\0"), "GLB: ends within the header");
}
