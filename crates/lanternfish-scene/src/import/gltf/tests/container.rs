//! Tests of GLB and JSON, URIs, versions and extensions.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::json;

use super::{File, assert_contains, load_bytes};
use crate::{SceneError, import::load};

/// A triangle file whose buffer is at `uri`.
fn with_uri(uri: &str) -> File {
    let mut file = File::with_triangle();
    file.json["buffers"] = json!([{ "byteLength": 36, "uri": uri }]);
    file
}

#[test]
fn a_truncated_glb_is_refused() {
    let glb = File::with_triangle().glb();
    assert_eq!(load_bytes(&glb).expect("the complete file").triangle_counts(), (1, 1));
    for length in 0..glb.len() {
        // Once unchanged, once with the true length in the header.
        let mut cut = glb[..length].to_vec();
        assert!(matches!(load_bytes(&cut), Err(SceneError::Invalid { .. })), "{length} bytes");
        if length >= 12 {
            cut[8..12].copy_from_slice(&(length as u32).to_le_bytes());
            assert!(matches!(load_bytes(&cut), Err(SceneError::Invalid { .. })), "{length} bytes, admitted");
        }
    }
}

#[test]
fn no_single_changed_byte_of_a_glb_panics() {
    let glb = File::with_triangle().glb();
    let mut refused = 0;
    for at in 0..glb.len() {
        for value in [0, b'9', b'-', 0xff] {
            let mut changed = glb.clone();
            changed[at] = value;
            refused += usize::from(load_bytes(&changed).is_err());
        }
    }
    assert!(refused > glb.len(), "only {refused} refused");
}

#[test]
fn bytes_after_a_glb_and_unknown_chunks_are_ignored() {
    let mut glb = File::with_triangle().glb();
    let json_length = u32::from_le_bytes(glb[12..16].try_into().expect("four bytes")) as usize;
    let chunk = [&4_u32.to_le_bytes(), &b"????"[..], &[0; 4]].concat();
    glb.splice(20 + json_length..20 + json_length, chunk);
    let length = glb.len() as u32;
    glb[8..12].copy_from_slice(&length.to_le_bytes());
    glb.extend_from_slice(b"more");
    assert_eq!(load_bytes(&glb).expect("both are allowed").triangle_counts(), (1, 1));
}

#[test]
fn data_uris_are_decoded() {
    let bytes = File::with_triangle().bin;
    let base64 = STANDARD.encode(&bytes);
    let percent: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    for uri in [
        format!("data:application/octet-stream;base64,{base64}"),
        format!("data:;base64,{}", base64.trim_end_matches('=')),
        format!("data:,{percent}"),
    ] {
        let file = with_uri(&uri);
        let scene = load_bytes(file.json.to_string().as_bytes()).unwrap_or_else(|error| panic!("{uri}: {error}"));
        assert_eq!(scene.triangle_counts(), (1, 1), "{uri}");
    }
    assert_contains(&with_uri("data:;base64,A*").fault(), "buffers[0]: data URI");
    assert_contains(&with_uri("data:nothing").fault(), "no comma");
    assert_contains(&with_uri("data:,short").fault(), "36 bytes stated, 5 there");
}

#[test]
fn files_beside_the_scene_are_found() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let path = folder.path().join("scene.GLTF");
    let path_text = path.to_str().expect("UTF-8");
    std::fs::create_dir(folder.path().join("parts")).expect("created");
    std::fs::write(folder.path().join("parts/a b%.bin"), File::with_triangle().bin).expect("written");
    std::fs::write(&path, with_uri("parts/a%20b%25.bin").json.to_string()).expect("written");
    let scene = load(path_text).expect("the buffer is there");
    assert_eq!((scene.triangle_counts(), scene.name.as_str()), ((1, 1), "scene"));

    std::fs::write(&path, with_uri("parts/other.bin").json.to_string()).expect("written");
    match load(path_text) {
        Err(SceneError::Io { path, .. }) => assert!(path.ends_with("parts/other.bin"), "{}", path.display()),
        other => panic!("{other:?}"),
    }
}

#[test]
fn files_that_are_not_there_or_elsewhere_are_named() {
    match load("no such folder/scene.glb") {
        Err(SceneError::Io { path, .. }) => assert_eq!(path, Path::new("no such folder/scene.glb")),
        other => panic!("{other:?}"),
    }
    assert!(matches!(load("scene.fbx"), Err(SceneError::UnknownFormat { .. })));
    assert!(matches!(load("demo:no such demo"), Err(SceneError::UnknownDemo { .. })));
    let error = with_uri("https://example.org/a.bin").load().expect_err("it is elsewhere");
    assert!(matches!(&error, SceneError::Unsupported { what, .. } if what.contains("https://example.org")), "{error}");
    for (uri, fault) in [("/root.bin", "not a path relative"), ("", "not a path relative"), ("%ff.bin", "not UTF-8")] {
        assert_contains(&with_uri(uri).fault(), fault);
    }
}

#[test]
fn a_buffer_without_content_is_refused_only_when_used() {
    let mut file = File::with_triangle();
    let length = file.bin.len();
    file.json["buffers"] = json!([{ "byteLength": length }, { "byteLength": 8 }]);
    assert_eq!(file.scene().triangle_counts(), (1, 1));
    file.json["bufferViews"][0]["buffer"] = json!(1);
    assert_contains(&file.fault(), "buffers[1] has no content");
}

#[test]
fn required_extensions_are_understood_or_named() {
    let mut file = File::with_triangle();
    file.json["extensionsUsed"] = json!(["EXT_unheard_of"]);
    assert_eq!(file.scene().triangle_counts(), (1, 1), "used is not required");
    file.json["extensionsRequired"] = json!(["KHR_materials_unlit", "EXT_unheard_of"]);
    let error = file.load().expect_err("it is required");
    assert!(matches!(&error, SceneError::Unsupported { what, .. } if what == "EXT_unheard_of"), "{error}");
}

#[test]
fn versions_are_checked() {
    let mut file = File::with_triangle();
    for (asset, is_read) in [
        (json!({ "version": "2.0" }), true),
        (json!({ "version": "2.7" }), true),
        (json!({ "version": "2.7", "minVersion": "2.0" }), true),
        (json!({ "version": "2.7", "minVersion": "2.1" }), true),
        (json!({ "version": "3.0", "minVersion": "2.0" }), true),
        (json!({ "version": "2.0", "minVersion": "3.0" }), false),
        (json!({ "version": "1.0" }), false),
    ] {
        file.json["asset"] = asset.clone();
        match file.load() {
            Ok(_) => assert!(is_read, "{asset}"),
            Err(SceneError::Unsupported { .. }) => assert!(!is_read, "{asset}"),
            Err(error) => panic!("{error}"),
        }
    }
    file.json["asset"] = json!({});
    assert_contains(&file.fault(), "version");
}

#[test]
fn text_that_is_not_json_is_refused_with_its_place() {
    let fault = load_bytes(b"{\n \"asset\": oops").expect_err("not JSON");
    assert_contains(&fault.to_string(), "folder/test.glb: JSON: ");
    assert_contains(&fault.to_string(), "line 2");
}
