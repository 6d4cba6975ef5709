//! Malformed files: each gives one error that names the fault, or an image.

use std::{fmt::Write as _, fs, path::Path, process::Command};

use lanternfish_metrics::{ColorType, RgbImage, read_exr, write_exr, write_png};

use crate::support::{lanternfish, write_flying};

/// Success, and all output.
fn said(command: &mut Command) -> (bool, String) {
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.success(), text)
}

/// Asserts one error that contains these words, and no panic.
#[track_caller]
fn assert_refused(command: &mut Command, words: &[&str]) {
    let (success, text) = said(command);
    assert!(!success, "{text}");
    assert_eq!(text.lines().filter(|line| line.starts_with("error")).count(), 1, "{text}");
    assert!(!text.contains("panicked") && !text.contains("internal error"), "{text}");
    for word in words {
        assert!(text.contains(word), "{word:?} is not in: {text}");
    }
}

fn crc32(bytes: &[u8]) -> [u8; 4] {
    let crc = bytes.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    });
    (!crc).to_be_bytes()
}

/// A PNG of these chunks.
fn png(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
    let chunk = |(kind, data): &(&[u8; 4], &[u8])| {
        let body = [&kind[..], data].concat();
        [&(data.len() as u32).to_be_bytes(), &body[..], &crc32(&body)].concat()
    };
    [b"\x89PNG\r\n\x1a\n".to_vec(), chunks.iter().flat_map(chunk).collect()].concat()
}

/// Deflated empty data.
const NOTHING: &[u8] = b"x\x9c\x03\0\0\0\0\x01";

/// A palette with an incomplete colour, on which the decoder panics.
fn broken_palette() -> Vec<u8> {
    let header = [0, 0, 0, 1, 0, 0, 0, 1, 8, 3, 0, 0, 0];
    let pixel = b"x\x9cc`\0\0\0\x02\0\x01";
    png(&[(b"IHDR", &header), (b"PLTE", &[0, 0, 0, 0, 2]), (b"tRNS", &[0, 1]), (b"IDAT", pixel), (b"IEND", &[])])
}

/// 68 bytes that claim 131,072 × 131,072 pixels.
fn enormous() -> Vec<u8> {
    png(&[(b"IHDR", &[0, 2, 0, 0, 0, 2, 0, 0, 8, 6, 0, 0, 0]), (b"IDAT", NOTHING), (b"IEND", &[])])
}

#[test]
fn images_are_as_large_as_memory_allows() {
    let folder = tempfile::tempdir().unwrap();
    let run = |words: &[&str]| {
        let mut command = lanternfish(folder.path());
        command.args(["compare", "--memory-limit", "1G"]).args(words);
        command
    };
    fs::write(folder.path().join("large.png"), enormous()).unwrap();
    let words = ["large.png: 131072 × 131072 pixels need 481.0 GB of memory, the limit is 1.0 GB", "--memory-limit"];
    assert_refused(&mut run(&["large.png", "large.png"]), &words);

    let path = folder.path().join("large.exr");
    write_exr(&path, &RgbImage::new(4, 4, vec![[1.0; 3]; 16]).unwrap()).unwrap();
    let mut bytes = fs::read(&path).unwrap();
    for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let at = bytes.windows(window.len()).position(|part| part == window).unwrap() + window.len() + 4 + 8;
        bytes[at..at + 8].copy_from_slice(&[0xff, 0xff, 1, 0, 0xff, 0xff, 1, 0]);
    }
    fs::write(&path, bytes).unwrap();
    assert_refused(&mut run(&["large.exr", "large.exr"]), &["large.exr: 131072 × 131072 pixels need 412.3 GB"]);

    fs::write(folder.path().join("palette.png"), broken_palette()).unwrap();
    assert_refused(&mut run(&["palette.png", "palette.png"]), &["palette.png: "]);

    // Two images that can be read but not compared: 331 MB and 1.2 GB.
    let path = folder.path().join("both.png");
    write_png(&path, [3500, 3500], ColorType::Rgb, &vec![0; 3 * 3500 * 3500]).unwrap();
    assert_refused(&mut run(&["both.png", "both.png"]), &["comparing the images needs 1.2 GB", "--memory-limit"]);

    fs::write(folder.path().join("wide.hdr"), "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4096 +X 8192\n").unwrap();
    let mut reference = lanternfish(folder.path());
    reference.args(["reference", "demo:cornell", "--environment", "wide.hdr", "--memory-limit", "500M"]);
    assert_refused(&mut reference, &["wide.hdr: 8192 × 4096 pixels need 805.3 MB of memory", "--memory-limit"]);
}

/// The image is counted before the scene is read and before anything is traced or rendered.
#[test]
fn images_to_make_are_counted_before_they_are_allocated() {
    let folder = tempfile::tempdir().unwrap();
    let run = |words: &str| {
        let mut command = lanternfish(folder.path());
        command.args(words.split_whitespace()).args(["--memory-limit", "300M"]);
        command
    };
    let size = "--size 16384x16384: the image and writing it need";
    for (words, bytes) in [
        // 96 bytes of sums per pixel, and 72 for mean and variance in the file.
        ("reference demo:furnace --size 16384x16384 --spp 1 -o r.exr", "45.1 GB"),
        ("render demo:furnace --size 16384x16384 -o r.png", "8.6 GB"),
        ("render demo:furnace --size 16384x16384 -o r.exr", "14.0 GB"),
    ] {
        let limit = "the limit is 300.0 MB";
        assert_refused(&mut run(words), &[size, bytes, limit, "smaller --size", "larger --memory-limit"]);
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// 10,000,000 triangles of a small file are counted before a camera is chosen, which takes seconds for so many.
#[test]
fn placed_triangles_are_counted_before_they_are_visited() {
    let folder = tempfile::tempdir().unwrap();
    let mut data: Vec<u8> = [0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|x| x.to_le_bytes()).collect();
    data.extend([0u16, 1, 2].repeat(10_000).iter().flat_map(|index| index.to_le_bytes()));
    fs::write(folder.path().join("many.bin"), &data).unwrap();
    let nodes = (0..1000).map(|i| format!(r#"{{"mesh": 0, "translation": [{i}, 0, 0]}}"#));
    let nodes = nodes.collect::<Vec<_>>().join(",");
    let scene = format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{nodes}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}},
        {{"bufferView": 1, "componentType": 5123, "count": 30000, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 60000}}],
        "buffers": [{{"byteLength": 60036, "uri": "many.bin"}}]}}"#
    );
    fs::write(folder.path().join("many.gltf"), scene).unwrap();
    let mut reference = lanternfish(folder.path());
    reference.args(["reference", "many.gltf", "--camera", "none", "--memory-limit", "300M"]);
    assert_refused(&mut reference, &["10000000 placed triangles need", "--memory-limit"]);
}

/// An animation within the limits of a file at first, and 9e12 m away after 0.9 s.
#[test]
fn an_animation_that_goes_too_far_is_refused_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    write_flying(folder.path(), "far", 1e13);
    let mut reference = lanternfish(folder.path());
    reference.args(["reference", "far.gltf", "--time", "0.9", "--size", "8x8", "--spp", "1"]);
    let (success, text) = said(&mut reference);
    assert!(!success && !text.contains("bug") && !text.contains("Scene::validate"), "{text}");
    assert_refused(&mut reference, &["far: its animation 0 (fly)", "instance 0", "in the file", "--animation"]);
}

/// The limit of the address space is detected automatically.
#[cfg(target_os = "linux")]
#[test]
fn a_limited_process_is_refused_and_not_ended() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("wide.png"), {
        // 20,000 pixels per side: 11 GB.
        png(&[(b"IHDR", &[0, 0, 0x4e, 0x20, 0, 0, 0x4e, 0x20, 8, 6, 0, 0, 0]), (b"IDAT", NOTHING), (b"IEND", &[])])
    })
    .unwrap();
    let mut limited = Command::new("sh");
    limited.current_dir(folder.path()).args(["-c", "ulimit -v 6000000; exec \"$0\" \"$@\""]);
    limited.arg(env!("CARGO_BIN_EXE_lanternfish")).args(["compare", "wide.png", "wide.png"]);
    assert_refused(&mut limited, &["20000 × 20000 pixels need 11.2 GB of memory, and ", "are free"]);
}

#[test]
fn a_decoder_that_panics_is_a_warning_about_the_image() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("palette.png"), broken_palette()).unwrap();
    let scene = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"uri": "palette.png"}],
        "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}]}"#;
    fs::write(folder.path().join("scene.gltf"), scene).unwrap();
    let (success, text) = said(lanternfish(folder.path()).args(["info", "scene.gltf"]));
    assert!(success && text.contains("scene.gltf: surfaces lack a texture: images[0]: "), "{text}");
    assert!(!text.contains("panicked") && !text.contains("internal error"), "{text}");
}

#[test]
fn far_corners_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 -3.4e38\nf 1 2 3\nf 1 3 4\n";
    fs::write(folder.path().join("far.obj"), text).unwrap();
    for command in ["render", "reference", "info"] {
        let words = ["far.obj: instance 0 (", "3.4e38 m from the origin", "hint: "];
        assert_refused(lanternfish(folder.path()).args([command, "far.obj"]), &words);
    }
    fs::write(folder.path().join("bad.obj"), "v 0 0\n").unwrap();
    let (_, text) = said(lanternfish(folder.path()).args(["info", "bad.obj"]));
    assert!(text.contains("line 1") && !text.contains("glTF validator"), "{text}");
}

/// A thousand nodes that instance one mesh of 100,000 triangles.
fn place_a_hundred_million(folder: &Path) {
    let mut nodes = String::new();
    for x in 0..1000 {
        write!(nodes, r#"{}{{"mesh": 0, "translation": [{x}, 0, 0]}}"#, if x == 0 { "" } else { ", " }).unwrap();
    }
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2].repeat(100_000).iter().flat_map(|i| i.to_le_bytes()));
    fs::write(folder.join("many.bin"), bytes).unwrap();
    let scene = format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{nodes}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}},
                      {{"bufferView": 1, "componentType": 5123, "count": 300000, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 600000}}],
        "buffers": [{{"byteLength": 600036, "uri": "many.bin"}}]}}"#
    );
    fs::write(folder.join("many.gltf"), scene).unwrap();
}

#[test]
fn placed_triangles_are_counted_before_they_are_gathered() {
    let folder = tempfile::tempdir().unwrap();
    place_a_hundred_million(folder.path());
    let (success, text) = said(lanternfish(folder.path()).args(["info", "many.gltf", "--memory-limit", "500M"]));
    assert!(success && text.contains("100,000 stored, 100,000,000 placed"), "{text}");
    let mut reference = lanternfish(folder.path());
    reference.args(["reference", "many.gltf", "--sky", "1,1,1", "--memory-limit", "2G"]);
    assert_refused(
        &mut reference,
        &["100000000 placed triangles need", "the limit is 2.0 GB", "larger --memory-limit"],
    );
}

#[test]
fn gpu_an_upload_is_counted_before_it_is_made() {
    let folder = tempfile::tempdir().unwrap();
    place_a_hundred_million(folder.path());
    let mut render = lanternfish(folder.path());
    let words = ["--adapter", "cpu", "--sky", "1,1,1", "--memory-limit", "3G", "--shadows", "bvh"];
    render.args(["render", "many.gltf"]).args(words);
    // What would help is said.
    let two_levels = "100000000 placed triangles (with `shadows two-level` 102000 triangles), 1000 draws";
    assert_refused(&mut render, &[two_levels, "the limit is 3.0 GB"]);
}

/// A million coincident instances are drawn as one, with a note.
#[test]
fn coincident_instances_are_drawn_once() {
    let folder = tempfile::tempdir().unwrap();
    let scene = r#"{"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                      {"componentType": 5126, "count": 1000000, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "buffers": [{"byteLength": 36, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    fs::write(folder.path().join("crowd.gltf"), scene).unwrap();
    let words = ["reference", "crowd.gltf", "--sky", "1,1,1", "--size", "8x8", "--spp", "1", "-o", "crowd.exr"];
    let (success, text) = said(lanternfish(folder.path()).args(words));
    assert!(success && text.contains("left out: duplicate instances (999999)"), "{text}");
    assert!(folder.path().join("crowd.exr").is_file());
}

/// Many coincident triangles in one mesh, which no BVH can separate: the image shows one of them.
#[test]
fn a_pile_of_triangles_is_traced() {
    let folder = tempfile::tempdir().unwrap();
    let rendering = |name: &str, count: usize| {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned() + &"f 1 2 3\n".repeat(count);
        fs::write(folder.path().join(name).with_extension("obj"), text).unwrap();
        let words = ["--integrator", "normal", "--size", "16x16", "--spp", "1", "--view", "front"];
        let (success, text) = said(lanternfish(folder.path()).args(["reference", name]).args(words));
        assert!(success, "{text}");
        read_exr(&folder.path().join(name).with_extension("reference.exr")).unwrap()
    };
    let (one, pile) = (rendering("one.obj", 1), rendering("pile.obj", 20_000));
    assert!(one == pile && one.pixels.iter().any(|pixel| *pixel != one.pixels[0]));
}

#[test]
fn a_confined_run_reads_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("scene")).unwrap();
    fs::write(folder.path().join("secret.bin"), [0; 36]).unwrap();
    let scene = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": "../secret.bin"}]}"#;
    fs::write(folder.path().join("scene/out.gltf"), scene).unwrap();
    // The command line and the shot may name files anywhere.
    fs::write(folder.path().join("scene/shot.toml"), "scene = \"../scene/out.gltf\"\n").unwrap();
    assert!(said(lanternfish(folder.path()).args(["info", "scene/out.gltf"])).0);
    for words in [
        &["info", "scene/out.gltf", "--confine"][..],
        &["--confine", "info", "scene/out.gltf"],
        &["render", "scene/out.gltf", "--confine"],
        &["render", "scene/shot.toml", "--confine"],
        &["reference", "scene/out.gltf", "--confine"],
        &["deep-images", "scene/out.gltf", "--confine"],
    ] {
        let expected = ["secret.bin: not within the scene's folder", "leave --confine out"];
        assert_refused(lanternfish(folder.path()).args(words), &expected);
    }
}

#[cfg(unix)]
#[test]
fn names_need_not_be_utf8() {
    use std::{ffi::OsStr, os::unix::ffi::OsStrExt};
    let folder = tempfile::tempdir().unwrap();
    let name = |bytes: &'static [u8]| OsStr::from_bytes(bytes);
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    fs::write(folder.path().join(name(b"caf\xe9.obj")), text).unwrap();
    let (success, text) = said(lanternfish(folder.path()).arg("info").arg(name(b"caf\xe9.obj")));
    assert!(success && text.contains("triangles    1 stored"), "{text}");
    let mut reference = lanternfish(folder.path());
    reference.arg("reference").arg(name(b"caf\xe9.obj")).args(["--sky", "1,1,1", "--size", "8x8", "--spp", "1"]);
    let (success, text) = said(reference.arg("-o").arg(name(b"t\xe9.exr")));
    assert!(success && folder.path().join(name(b"t\xe9.exr")).is_file(), "{text}");
    // A shot is text.
    let mut shot = lanternfish(folder.path());
    assert_refused(shot.arg("shot").arg(name(b"caf\xe9.obj")), &["not UTF-8", "another name"]);
}

/// Names and paths from files cannot move the cursor of a terminal, set its title or fake lines, and do not fill it.
#[test]
fn names_from_files_are_escaped_and_cut() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let escape = "\\u001b]0;title\\u0007\\nerror: none";
    let camera = r#"{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 }, "name": "NAME" }"#;
    let scene = |camera: &str, more: &str| {
        format!(
            r#"{{ "asset": {{ "version": "2.0" }}, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "camera": 0, "name": "{escape}" }}],
            "cameras": [{camera}]{more} }}"#
        )
    };
    write("camera.gltf", &scene(&camera.replace("NAME", escape), ""));
    write("extension.gltf", &scene(camera, &format!(r#", "extensionsRequired": ["{escape}"]"#)));
    let textured = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "nodes": [{{ "mesh": 0 }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "material": 0 }}] }}],
        "materials": [{{ "emissiveTexture": {{ "index": 0 }} }}], "textures": [{{ "source": 0 }}],
        "images": [{{ "uri": "none.png", "name": "{escape}" }}],
        "accessors": [{{ "componentType": 5126, "count": 3, "type": "VEC3" }}] }}"#
    );
    write("image.gltf", &textured);
    let long = "b".repeat(1 << 20);
    write("buffer.gltf", &scene(camera, &format!(r#", "buffers": [{{ "byteLength": 4, "uri": "a://{long}" }}]"#)));
    write("key.toml", "scene = \"demo:cornell\"\n\"\\u001b[31mkey\" = 1\n");
    for words in [
        ["info", "camera.gltf"],
        ["info", "extension.gltf"],
        ["info", "buffer.gltf"],
        ["info", "image.gltf"],
        ["render", "key.toml"],
    ] {
        let (_, text) = said(lanternfish(folder.path()).args(words));
        let is_plain = |character: char| character == '\n' || !character.is_control();
        assert!(text.chars().all(is_plain), "{words:?}: {text:?}");
        assert!(!text.lines().any(|line| line == "error: none") && text.len() < 3000, "{words:?}: {text}");
    }
}

/// A glTF file of these members beside `asset`.
fn gltf(folder: &Path, members: &str) -> std::path::PathBuf {
    let path = folder.join("scene.gltf");
    fs::write(&path, format!(r#"{{"asset":{{"version":"2.0"}},{members}}}"#)).unwrap();
    path
}

#[test]
fn files_cannot_forge_hints_of_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let forged = r#""buffers":[{"byteLength":4,"uri":"a.bin%0A%0A%20%20hint%3A%20run%20this%E2%80%8B"}]"#;
    let (success, text) = said(lanternfish(folder.path()).args(["info"]).arg(gltf(folder.path(), forged)));
    assert!(!success && text.matches("\n  hint: ").count() == 1, "{text}");
    assert!(!text.contains('\u{200b}'), "{text}");
    let cone = r#""extensionsUsed":["KHR_lights_punctual"],"extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{"outerConeAngle":1e-45}}]}},"nodes":[{"extensions":{"KHR_lights_punctual":{"light":0}}}],"scenes":[{"nodes":[0]}]"#;
    assert_refused(
        lanternfish(folder.path()).args(["info"]).arg(gltf(folder.path(), cone)),
        &["lights[0]", "cone angles"],
    );
    let none = gltf(folder.path(), r#""scenes":[{}]"#);
    assert_refused(
        lanternfish(folder.path()).args(["info", "--variant", "red"]).arg(&none),
        &["hint: leave --variant out"],
    );
    let (_, text) =
        said(lanternfish(folder.path()).args(["doctor", "--filter", "nothing"]).env("VK_ICD_FILENAMES", "/none"));
    assert!(text.contains("no check has such a group"), "{text}");
}

#[test]
fn side_inputs_are_files_of_bounded_size() {
    let (folder, zero) = (tempfile::tempdir().unwrap(), Path::new("/dev/zero"));
    if zero.exists() {
        assert_refused(
            lanternfish(folder.path()).args(["doctor", "--read"]).arg(zero),
            &["/dev/zero: this is no file"],
        );
    }
}
