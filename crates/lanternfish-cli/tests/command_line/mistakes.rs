//! Mistakes where the process counts. `src/mistakes/tests.rs` has all others, without a process.

use std::process::Stdio;

use crate::support::{Folder, Ran};

/// A triangle without data.
const TRIANGLE: &str = r#"{ "asset": { "version": "2.0" }, "nodes": [ { "mesh": 0 } ],
    "meshes": [ { "primitives": [ { "attributes": { "POSITION": 0 } } ] } ],
    "accessors": [ { "componentType": 5126, "count": 3, "type": "VEC3" } ] }"#;

/// A word that the parser refuses, a file that a command refuses, and one that a comparison refuses, of which 1 is a result.
#[test]
fn a_mistake_is_one_error_and_an_exit_code() {
    let folder = Folder::new();
    for (words, code, parts) in [
        ("render demo:atrium --size 0x0 -o a.png", 2, ["--size", "from 1 to 16384"]),
        ("render nowhere.glb -o a.png", 1, ["nowhere.glb", "hint: check the path"]),
        ("compare nowhere.exr nowhere.exr --map a.png", 2, ["nowhere.exr", "hint: check the path"]),
    ] {
        let ran = folder.run(words);
        ran.was_refused(&parts);
        assert_eq!((ran.code, folder.names("")), (Some(code), Vec::new()), "{words}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_standard_error_is_no_second_error() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let status = Folder::new().program().args(["info", "nowhere.glb"]).stderr(full).status().unwrap();
    assert_eq!(status.code(), Some(1), "regression: a panic while printing aborted the process");
}

#[test]
fn no_adapter() {
    let folder = Folder::with(&[("triangle.gltf", TRIANGLE)]);
    let without_driver = |words: &str| {
        let mut command = folder.program();
        command.args(words.split(' ')).env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
        Ran::of(&mut command)
    };
    // These variables remove all adapters only where every adapter uses Vulkan.
    if cfg!(any(target_os = "linux", target_os = "android")) {
        for words in ["render triangle.gltf -o a.png", "info --adapters"] {
            without_driver(words).was_refused(&["no graphics adapter", "mesa-vulkan-drivers"]);
        }
        assert_eq!(folder.names(""), ["triangle.gltf"]);
    }
    // Reading a scene needs no adapter.
    assert!(without_driver("info triangle.gltf").succeeded().stdout.contains("1 stored, 1 placed"));
}

/// A program prints what the parser has, and what a command has.
#[test]
#[cfg(target_os = "linux")]
fn a_failed_print_fails_the_run() {
    let folder = Folder::with(&[("triangle.gltf", TRIANGLE)]);
    for words in ["--help", "info triangle.gltf"] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut command = folder.program();
        command.args(words.split(' ')).stderr(Stdio::piped());
        let output = command.stdout(full).spawn().unwrap().wait_with_output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{words}");
        assert!(error.starts_with("error: standard output: No space left"), "{words}: {error}");

        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = command.stdout(writer).spawn().unwrap().wait_with_output().unwrap();
        assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]), "{words}");
    }
    // The exit code is that of the work: both frames are missing.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let words = ["frames", "triangle.gltf", "1-2", "-o", "frame.png"];
    assert_eq!(folder.program().args(words).stdout(writer).status().unwrap().code(), Some(1));
}
