//! The handling of mistakes: one clear error, a non-zero exit code, no files left behind.

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

use crate::support::{lanternfish, names};

/// The outcome of a run: success, output, and the files in its folder.
#[derive(Debug)]
struct Outcome {
    success: bool,
    stdout: String,
    stderr: String,
    files: Vec<String>,
}

fn run(folder: &Path, words: &[&str]) -> Outcome {
    outcome(folder, lanternfish(folder).args(words))
}

fn outcome(folder: &Path, command: &mut Command) -> Outcome {
    let output = command.output().unwrap();
    Outcome {
        success: output.status.success(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
        files: names(folder),
    }
}

impl Outcome {
    /// Asserts one error that contains each of `words`, no panic, no results, and only these files.
    #[track_caller]
    fn assert_refused(&self, words: &[&str], files: &[&str]) {
        assert!(!self.success, "this should have failed: {self:?}");
        let errors = self.stderr.lines().filter(|line| line.starts_with("error")).count();
        assert_eq!(errors, 1, "{}", self.stderr);
        for bug in ["panicked", "internal error", "RUST_BACKTRACE"] {
            assert!(!self.stderr.contains(bug), "{}", self.stderr);
        }
        for word in words {
            assert!(self.stderr.contains(word), "{word:?} is not in: {}", self.stderr);
        }
        assert_eq!(self.stdout, "");
        assert_eq!(self.files, files);
    }
}

#[test]
fn a_missing_file() {
    let folder = tempfile::tempdir().unwrap();
    for words in [&["render", "nowhere.glb", "-o", "a.png"][..], &["info", "nowhere.glb"], &["render", "nowhere.gltf"]]
    {
        run(folder.path(), words).assert_refused(&["nowhere.gl", "No such file", "hint: check the path"], &[]);
    }
    // A part of a scene of several files.
    let scene = r#"{ "asset": { "version": "2.0" }, "buffers": [{ "uri": "box.bin", "byteLength": 4 }] }"#;
    fs::write(folder.path().join("box.gltf"), scene).unwrap();
    let missing = run(folder.path(), &["render", "box.gltf", "-o", "a.png"]);
    missing.assert_refused(&["box.bin", "No such file", "hint: the scene consists of several files"], &["box.gltf"]);
}

#[test]
fn a_broken_file() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in [
        ("text.glb", &b"this is not a scene"[..]),
        ("empty.glb", b""),
        ("half.gltf", b"{ \"asset\": { \"version\": \"2.0\" }, \"meshes\": [ {"),
        ("far.gltf", b"{ \"asset\": { \"version\": \"2.0\" }, \"scene\": 0, \"scenes\": [ { \"nodes\": [ 7 ] } ] }"),
        ("binary.gltf", b"\xff\xfe\x00\x01"),
    ] {
        fs::write(folder.path().join(name), content).unwrap();
        run(folder.path(), &["render", name, "-o", "a.png"]).assert_refused(&[name], &[name]);
        run(folder.path(), &["info", name]).assert_refused(&[name], &[name]);
        fs::remove_file(folder.path().join(name)).unwrap();
    }
}

#[test]
fn an_environment_that_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let render = |words: &[&str]| run(folder.path(), &[&["render", "demo:cornell", "-o", "a.png"], words].concat());
    render(&["--environment", "nowhere.hdr"]).assert_refused(&["nowhere.hdr", "No such file", "hint"], &[]);
    fs::write(folder.path().join("sky.hdr"), "this is no image").unwrap();
    render(&["--environment", "sky.hdr"])
        .assert_refused(&["sky.hdr: not a Radiance image", "--environment"], &["sky.hdr"]);
    render(&["--environment", "sky.png"]).assert_refused(&["sky.png", ".hdr or .exr", "--sky"], &["sky.hdr"]);
    render(&["--environment", "sky.hdr", "--report", "sky.hdr"])
        .assert_refused(&["both --environment and --report"], &["sky.hdr"]);
    // Regression: the environment was overwritten by the image without a warning.
    let sky = fs::read(folder.path().join("sky.hdr")).unwrap();
    fs::rename(folder.path().join("sky.hdr"), folder.path().join("sky.exr")).unwrap();
    run(folder.path(), &["render", "demo:cornell", "--environment", "sky.exr", "-o", "./sky.exr"])
        .assert_refused(&["./sky.exr: both --environment and the image"], &["sky.exr"]);
    assert_eq!(fs::read(folder.path().join("sky.exr")).unwrap(), sky);
    fs::rename(folder.path().join("sky.exr"), folder.path().join("sky.hdr")).unwrap();
    // The largest number of the format, and one beyond it.
    fs::write(folder.path().join("sky.hdr"), b"#?RADIANCE\n\n-Y 1 +X 1\n\xff\xff\xff\xff").unwrap();
    let bright = ["--environment", "sky.hdr", "--environment-scale", "3"];
    render(&bright).assert_refused(&["--environment-scale 3", "smaller"], &["sky.hdr"]);
    render(&["--environment-rotation", "wide"]).assert_refused(&["-3600 to 3600"], &["sky.hdr"]);
    render(&["--environment-scale", "0"]).assert_refused(&["above 0"], &["sky.hdr"]);
}

#[test]
fn something_that_is_no_scene() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.fbx"), "x").unwrap();
    run(folder.path(), &["render", "scene.fbx", "-o", "a.png"]).assert_refused(&["scene.fbx", ".glb"], &["scene.fbx"]);
    run(folder.path(), &["render", "."]).assert_refused(&["this is a folder"], &["scene.fbx"]);
}

#[test]
#[cfg(unix)]
fn something_without_an_end() {
    let folder = tempfile::tempdir().unwrap();
    // Regression: the file was read until memory ran out.
    std::os::unix::fs::symlink("/dev/zero", folder.path().join("zeros.glb")).unwrap();
    for scene in ["zeros.glb", "/dev/null"] {
        run(folder.path(), &["render", scene]).assert_refused(&[scene, "no file"], &["zeros.glb"]);
        run(folder.path(), &["info", scene]).assert_refused(&[scene, "no file"], &["zeros.glb"]);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_standard_error_is_no_second_error() {
    let folder = tempfile::tempdir().unwrap();
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let status = lanternfish(folder.path()).args(["info", "nowhere.glb"]).stderr(full).status().unwrap();
    assert_eq!(status.code(), Some(1), "regression: a panic while printing aborted the process");
}

#[test]
fn an_unknown_demo() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &["render", "demo:moonbase"]).assert_refused(&["demo:moonbase", "there are"], &[]);
    run(folder.path(), &["info", "demo:moonbase"]).assert_refused(&["demo:moonbase"], &[]);
}

#[test]
fn sizes_out_of_range() {
    let folder = tempfile::tempdir().unwrap();
    for size in ["0x0", "0", "0x720", "1280x0", "100000", "100000x100000", "16385x16", "-5x5", "wide"] {
        run(folder.path(), &["render", "demo:atrium", "--size", size, "-o", "a.png"])
            .assert_refused(&["--size", "from 1 to 16384"], &[]);
    }
}

/// What other programs call otherwise, and a file without a command.
#[test]
fn flags_and_forms_of_other_programs() {
    let folder = tempfile::tempdir().unwrap();
    for (words, tip) in [
        (&["render", "demo:cornell", "--width", "640"][..], "tip: --size WIDTHxHEIGHT sets both sides"),
        (&["render", "demo:cornell", "--spp", "64"], "--accumulate N"),
        (&["reference", "demo:cornell", "-s", "64"], "--size"),
        (&["render", "demo:cornell", "--samples", "16"], "--accumulate N averages N frames"),
        (&["render", "demo:cornell", "--eye", "1", "2", "3"], "joined by commas: 1,2,3"),
        (&["render", "demo:cornell", "--camera-position", "1,2,3"], "--eye X,Y,Z is the camera's position"),
        (&["render", "demo:cornell", "--animation-time", "1"], "--time SECONDS"),
        (&["render", "demo:cornell", "--bg", "white"], "--background COLOR"),
        (&["reference", "demo:cornell", "--background", "white"], "the path tracer shows the environment"),
        (&["render", "demo:cornell", "--denoiser", "off"], "indirect light is always denoised"),
        (&["render", "demo:cornell", "--threads", "4"], "only `lanternfish reference` traces on CPU threads"),
        (&["turntable", "box.glb"], "`lanternfish render SCENE --orbit N`"),
        (&["render", "demo:cornell", "--indirect", "path"], "`lanternfish reference SCENE` is the path tracer"),
        (&["farm", "demo:cornell", "--orbit", "8"], "`lanternfish shot SCENE --orbit N -o shot.toml`"),
        (&["farm", "demo:cornell", "--frames", "1-4", "--size", "8x8"], "`lanternfish shot SCENE FLAGS -o shot.toml`"),
        (&["frames", "shot.toml", "--frames", "1-4"], "`lanternfish frames SHOT A-B`"),
        (&["render", "demo:cornell", "out.png"], "-o FILE names the image"),
        (&["--size", "64x64", "render", "demo:cornell"], "flags go after the command"),
        (&["box.glb"], "`lanternfish view box.glb` opens a window"),
        (&["demo:cornell"], "`lanternfish render demo:cornell` writes an image"),
    ] {
        let outcome = run(folder.path(), words);
        outcome.assert_refused(&[tip], &[]);
        assert!(!outcome.stderr.contains("as a value"), "{}", outcome.stderr);
    }
    // Neither a flag of ours nor of others.
    let unknown = run(folder.path(), &["render", "demo:cornell", "--xyzzy"]);
    unknown.assert_refused(&["--xyzzy"], &[]);
    assert!(!unknown.stderr.contains("as a value"), "{}", unknown.stderr);
}

#[test]
fn unknown_values_and_flags() {
    let folder = tempfile::tempdir().unwrap();
    for (flag, value, known) in [
        ("--shadows", "soft", "ray-query"),
        ("--tile-size", "12", "16"),
        ("--tone-map", "film", "neutral"),
        ("--point", "1,2", "x,y,z,cd"),
        ("--disk", "0,1,0,0,-1,0,0,1", "radius 0"),
        ("--rectangle", "0,1,0,0,-1,0,1,1", "width,height,nits"),
        ("--sun", "0,0,0,1", "direction"),
        ("--lights", "snow:5", "rain:N"),
        ("--fov-y", "180", "179"),
        ("--eye", "here", "x,y,z"),
        ("--seed", "-1", "--seed"),
        ("--accumulate", "0", "1.."),
        ("--accumulate", "-4", "1.."),
        ("--accumulate", "many", "--accumulate"),
        ("--exposure", "NaN", "stops"),
        // Regression: it ran out of memory and aborted.
        ("--lights", "rain:4000000000", "at most 2097152"),
        ("--lights", "rain:5:inf", "radius"),
        ("--fov-y", "0", "0.1"),
        ("--target", "1,NaN,0", "x,y,z"),
        ("--eye", "1e30,0,0", "1e12 m"),
        ("--view", "side", "front, back, left, right, top, iso"),
        ("--light-rig", "lamp", "studio, sun, none"),
    ] {
        run(folder.path(), &["render", "demo:atrium", flag, value]).assert_refused(&[flag, value, known], &[]);
    }
    run(folder.path(), &["render", "demo:atrium", "--shadow", "none"]).assert_refused(&["--shadow", "--shadows"], &[]);
    run(folder.path(), &["render"]).assert_refused(&["SCENE"], &[]);
    run(folder.path(), &["info"]).assert_refused(&["SCENE"], &[]);
    run(folder.path(), &["render", ""]).assert_refused(&["SCENE"], &[]);
    run(folder.path(), &["render", "demo:atrium", "-o", ""]).assert_refused(&["--output"], &[]);
}

#[test]
fn cameras_that_are_not_there() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &["render", "demo:cornell", "--camera", "99"])
        .assert_refused(&["99", "by its number or name: 0"], &[]);
    for (other, value) in [("--eye", "1,2,3"), ("--camera", "0"), ("--target", "0,0,0")] {
        run(folder.path(), &["render", "demo:cornell", "--view", "top", other, value])
            .assert_refused(&["--view", other, "cannot be used with"], &[]);
    }
    run(folder.path(), &["render", "demo:cornell", "--pose-convention", "opencv"])
        .assert_refused(&["--pose-convention without --pose"], &[]);
    run(folder.path(), &["render", "demo:cornell", "--eye", "1,2,3", "--target", "1,2,3"])
        .assert_refused(&["look at itself"], &[]);
}

#[test]
fn the_studio_is_an_environment() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &["render", "demo:cornell", "--light-rig", "studio", "--sky", "1,1,1"])
        .assert_refused(&["--light-rig studio", "--sky", "hint"], &[]);
}

#[test]
fn outputs_are_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    // The scene does not exist either: the output is checked first.
    run(folder.path(), &["render", "nowhere.glb", "-o", "a.gif"]).assert_refused(&["a.gif", ".png", ".exr"], &[]);
    run(folder.path(), &["render", "nowhere.glb", "-o", "a"]).assert_refused(&["a:", ".png", ".exr"], &[]);
    run(folder.path(), &["render", "nowhere.glb", "-o", "missing/a.png"])
        .assert_refused(&["missing/a.png", "no folder missing"], &[]);
    run(folder.path(), &["render", "nowhere.glb", "-o", "a.png/"]).assert_refused(&["a.png/: this is a folder"], &[]);
    run(folder.path(), &["render", "nowhere.glb", "-o", "a.png", "--report", "missing/a.json"])
        .assert_refused(&["missing/a.json", "no folder missing"], &[]);
    run(folder.path(), &["render", "nowhere.glb", "-o", "a.png", "--report", "a.png"])
        .assert_refused(&["a.png", "--report"], &[]);
    run(folder.path(), &["render", "nowhere.glb", "-o", "a.png", "--report", "./a.png"])
        .assert_refused(&["a.png", "--report"], &[]);
    // Regression: it wrote the radiance instead of the requested debug view.
    run(folder.path(), &["render", "nowhere.glb", "-o", "a.exr", "--debug-view", "normal"])
        .assert_refused(&["a.exr", "--debug-view normal", ".png"], &[]);
}

#[test]
fn a_report_does_not_replace_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("triangle.gltf"), TRIANGLE).unwrap();
    run(folder.path(), &["render", "triangle.gltf", "--report", "./triangle.gltf"])
        .assert_refused(&["triangle.gltf", "--report"], &["triangle.gltf"]);
    assert_eq!(fs::read_to_string(folder.path().join("triangle.gltf")).unwrap(), TRIANGLE);
}

#[test]
fn no_adapter() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("triangle.gltf"), TRIANGLE).unwrap();
    let without_driver = |words: &[&str]| {
        let mut command = lanternfish(folder.path());
        command.args(words).env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
        outcome(folder.path(), &mut command)
    };
    // These variables remove all adapters only where every adapter uses Vulkan.
    if cfg!(any(target_os = "linux", target_os = "android")) {
        without_driver(&["render", "triangle.gltf", "-o", "a.png"])
            .assert_refused(&["no graphics adapter", "mesa-vulkan-drivers"], &["triangle.gltf"]);
        without_driver(&["info", "--adapters"])
            .assert_refused(&["no graphics adapter", "mesa-vulkan-drivers"], &["triangle.gltf"]);
    }
    // Reading a scene needs no adapter.
    let info = without_driver(&["info", "triangle.gltf"]);
    assert!(info.success && info.stdout.contains("1 stored, 1 placed"), "{info:?}");
}

#[test]
fn help_has_examples_and_all_flags() {
    let folder = tempfile::tempdir().unwrap();
    let help = run(folder.path(), &["render", "--help"]);
    assert!(help.success);
    for word in ["Examples:", "rain:N", "1280x720", "help render --all"] {
        assert!(help.stdout.contains(word), "{word:?} is not in: {}", help.stdout);
    }
    assert_eq!(run(folder.path(), &["help", "render"]).stdout, help.stdout);
    assert_eq!(run(folder.path(), &["render", "-h"]).stdout, help.stdout);
    let all = run(folder.path(), &["help", "render", "--all"]);
    for word in [
        "Examples:",
        "x,y,z,cd[,r,g,b[,range]]",
        "rain:N:radius",
        "ray-query",
        "Fewest lights a pixel",
        "--cluster-test",
    ] {
        assert!(all.stdout.contains(word) && all.success, "{word:?} is not in: {}", all.stdout);
    }
    assert!(run(folder.path(), &["help"]).stdout.contains("deep-images"));
    run(folder.path(), &["help", "beauty"]).assert_refused(&["lanternfish beauty", "there are: render, view"], &[]);
    run(folder.path(), &["help", "render", "quality"]).assert_refused(&["lanternfish render quality"], &[]);
}

#[test]
fn the_bench_command_names_its_program() {
    let folder = tempfile::tempdir().unwrap();
    let known = ["error: bench: benches", "`lanternfish-bench quality --only cornell`"];
    run(folder.path(), &["bench", "quality", "--only", "cornell"]).assert_refused(&known, &[]);
    assert!(!run(folder.path(), &["help"]).stdout.contains("bench"));
}

#[test]
#[cfg(target_os = "linux")]
fn a_failed_print_fails_the_run() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("triangle.gltf"), TRIANGLE).unwrap();
    for words in [
        &["--help"][..],
        &["--version"],
        &["render", "--help"],
        &["help"],
        &["help", "render", "--all"],
        &["info", "triangle.gltf"],
        &["shot", "triangle.gltf"],
    ] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = lanternfish(folder.path()).args(words).stdout(full).stderr(Stdio::piped()).spawn();
        let output = output.unwrap().wait_with_output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{words:?}");
        assert!(error.starts_with("error: standard output: No space left"), "{words:?}: {error}");

        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = lanternfish(folder.path()).args(words).stdout(writer).stderr(Stdio::piped()).spawn();
        let output = output.unwrap().wait_with_output().unwrap();
        assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]), "{words:?}");
    }
    // The exit code is that of the work: both frames are missing.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let words = ["frames", "triangle.gltf", "1-2", "-o", "frame.png"];
    let status = lanternfish(folder.path()).args(words).stdout(writer).status().unwrap();
    assert_eq!(status.code(), Some(1));
}

/// A white triangle in the plane z = 0.
const TRIANGLE: &str = r#"{
  "asset": { "version": "2.0" },
  "scene": 0,
  "scenes": [ { "nodes": [ 0 ] } ],
  "nodes": [ { "mesh": 0 } ],
  "meshes": [ { "primitives": [ { "attributes": { "POSITION": 0 } } ] } ],
  "accessors": [ { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] } ],
  "bufferViews": [ { "buffer": 0, "byteLength": 36 } ],
  "buffers": [ { "byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" } ]
}"#;

#[test]
fn the_window_refuses_images_and_scenes_together() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.png"), "no image").unwrap();
    let files = ["a.png"];
    run(folder.path(), &["view", "demo:cornell", "a.png"]).assert_refused(&["a.png", "one scene", "hint"], &files);
    run(folder.path(), &["view", "a.png", "b.png", "--shadows", "bvh"]).assert_refused(&["--shadows", "hint"], &files);
    run(folder.path(), &["view", "a.png", "--record", "r.toml"]).assert_refused(&["--record", "hint"], &files);
    run(folder.path(), &["view", "a.png"]).assert_refused(&["a.png", "hint"], &files);
    run(folder.path(), &["view", "b.exr", "a.glb"]).assert_refused(&["b.exr", "No such file"], &files);
}
