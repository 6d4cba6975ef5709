//! Malformed and enormous files: limits of the process, and what is printed of texts from files.

use std::process::Command;

use lanternfish_metrics::{ColorType, RgbImage, write_exr, write_png};

use crate::support::{Folder, Ran, write_flying};

fn crc32(bytes: &[u8]) -> [u8; 4] {
    let crc = bytes.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    });
    (!crc).to_be_bytes()
}

/// A PNG file without pixels that claims this many on each side.
fn claiming(side: u32) -> Vec<u8> {
    let chunk = |kind: &[u8; 4], data: &[u8]| {
        let body = [&kind[..], data].concat();
        [&(data.len() as u32).to_be_bytes(), &body[..], &crc32(&body)].concat()
    };
    let header = [&side.to_be_bytes()[..], &side.to_be_bytes(), &[8, 6, 0, 0, 0]].concat();
    let nothing = b"x\x9c\x03\0\0\0\0\x01";
    [b"\x89PNG\r\n\x1a\n".to_vec(), chunk(b"IHDR", &header), chunk(b"IDAT", nothing), chunk(b"IEND", &[])].concat()
}

/// Images are counted before they are read, compared or made: before anything is traced or rendered.
#[test]
fn images_are_as_large_as_memory_allows() {
    let folder = Folder::new();
    folder.write("large.png", claiming(131_072));
    let path = folder.path("large.exr");
    write_exr(&path, &RgbImage::new(4, 4, vec![[1.0; 3]; 16]).unwrap()).unwrap();
    let mut bytes = folder.read("large.exr");
    for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let at = bytes.windows(window.len()).position(|part| part == window).unwrap() + window.len() + 4 + 8;
        bytes[at..at + 8].copy_from_slice(&[0xff, 0xff, 1, 0, 0xff, 0xff, 1, 0]);
    }
    folder.write("large.exr", bytes);
    // Two images that can be read but not compared: 83 MB and 300 MB.
    write_png(&folder.path("both.png"), [1750, 1750], ColorType::Rgb, &vec![0; 3 * 1750 * 1750]).unwrap();
    folder.write("wide.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4096 +X 8192\n");
    let before = folder.names("");
    for (words, parts) in [
        (
            "compare large.png large.png --memory-limit 1G",
            ["large.png: 131072 × 131072 pixels need 481.0 GB of memory, the limit is 1.0 GB", "--memory-limit"],
        ),
        ("compare large.exr large.exr --memory-limit 1G", ["large.exr: 131072 × 131072 pixels need 412.3 GB", ""]),
        ("compare both.png both.png --memory-limit 260M", ["comparing the images needs ", "--memory-limit"]),
        (
            "reference demo:cornell --environment wide.hdr --memory-limit 500M",
            ["wide.hdr: 8192 × 4096 pixels need 805.3 MB of memory", "--memory-limit"],
        ),
        // 96 bytes of sums per pixel, and 72 for mean and variance in the file.
        (
            "reference demo:furnace --size 16384x16384 --spp 1 -o r.exr --memory-limit 300M",
            ["--size 16384x16384: the image and writing it need 45.1 GB", "larger --memory-limit"],
        ),
        (
            "render demo:furnace --size 16384x16384 -o r.png --memory-limit 300M",
            ["--size 16384x16384: the image and writing it need 8.6 GB", "the limit is 300.0 MB"],
        ),
        (
            "render demo:furnace --size 16384x16384 -o r.exr --memory-limit 300M",
            ["--size 16384x16384: the image and writing it need 14.0 GB", "smaller --size"],
        ),
    ] {
        folder.run(words).was_refused(&parts);
    }
    assert_eq!(folder.names(""), before);
}

/// The limit of the address space is detected automatically.
#[cfg(target_os = "linux")]
#[test]
fn a_limited_process_is_refused_and_not_ended() {
    let folder = Folder::new();
    folder.write("wide.png", claiming(20_000));
    let mut limited = Command::new("sh");
    limited.current_dir(folder.path("")).args(["-c", "ulimit -v 6000000; exec \"$0\" \"$@\""]);
    limited.arg(env!("CARGO_BIN_EXE_lanternfish")).args(["compare", "wide.png", "wide.png"]);
    Ran::of(&mut limited).was_refused(&["20000 × 20000 pixels need 11.2 GB of memory, and ", "are free"]);
}

/// Writes a small file of 1,000 nodes that instance one mesh of 10,000 triangles.
fn place_ten_million(folder: &Folder) {
    let nodes =
        (0..1000).map(|x| format!(r#"{{"mesh": 0, "translation": [{x}, 0, 0]}}"#)).collect::<Vec<_>>().join(",");
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2].repeat(10_000).iter().flat_map(|i| i.to_le_bytes()));
    folder.write("many.bin", bytes);
    let scene = format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{nodes}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}},
                      {{"bufferView": 1, "componentType": 5123, "count": 30000, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 60000}}],
        "buffers": [{{"byteLength": 60036, "uri": "many.bin"}}]}}"#
    );
    folder.write("many.gltf", scene);
}

/// Placed triangles are counted before a camera is chosen, which takes seconds for so many, and before they are gathered.
#[test]
fn placed_triangles_are_counted_before_they_are_visited() {
    let folder = Folder::new();
    place_ten_million(&folder);
    let info = folder.done("info many.gltf --memory-limit 50M");
    assert!(info.stdout.contains("10,000 stored, 10,000,000 placed"), "{info:?}");
    let parts = ["10000000 placed triangles need", "the limit is 200.0 MB", "larger --memory-limit"];
    folder.run("reference many.gltf --sky 1,1,1 --memory-limit 200M").was_refused(&parts);
    folder.run("reference many.gltf --camera none --memory-limit 200M").was_refused(&parts);
}

#[test]
#[ignore = "full"]
fn gpu_an_upload_is_counted_before_it_is_made() {
    let folder = Folder::new();
    place_ten_million(&folder);
    let words = "render many.gltf --adapter cpu --sky 1,1,1 --memory-limit 300M --shadows bvh";
    // What would help is said.
    let two_levels = "10000000 placed triangles (with `shadows two-level` 12000 triangles), 1000 draws";
    folder.run(words).was_refused(&[two_levels, "the limit is 300.0 MB"]);
}

/// An animation within the limits of a file at first, and 9e12 m away after 0.9 s.
#[test]
fn an_animation_that_goes_too_far_is_refused_by_its_name() {
    let folder = Folder::new();
    write_flying(&folder.path(""), "far", 1e13);
    let ran = folder.run("reference far.gltf --time 0.9 --size 8x8 --spp 1");
    ran.was_refused(&["far: its animation 0 (fly)", "instance 0", "in the file", "--animation"]);
    assert!(!ran.stderr.contains("bug") && !ran.stderr.contains("Scene::validate"), "{ran:?}");
}

/// The command line and the shot may name files anywhere; the scene may not.
#[test]
fn a_confined_run_reads_its_folder() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("scene")).unwrap();
    folder.write("secret.bin", [0; 36]);
    let scene = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": "../secret.bin"}]}"#;
    folder.write("scene/out.gltf", scene);
    folder.write("scene/shot.toml", "scene = \"../scene/out.gltf\"\n");
    folder.done("info scene/out.gltf");
    for words in ["--confine info scene/out.gltf", "render scene/shot.toml --confine"] {
        folder.run(words).was_refused(&["secret.bin: not within the scene's folder", "leave --confine out"]);
    }
}

#[cfg(unix)]
#[test]
fn names_need_not_be_utf8() {
    use std::{ffi::OsStr, os::unix::ffi::OsStrExt};
    let folder = Folder::new();
    let (scene, image) = (OsStr::from_bytes(b"caf\xe9.obj"), OsStr::from_bytes(b"t\xe9.exr"));
    std::fs::write(folder.path("").join(scene), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let mut reference = folder.program();
    reference.arg("reference").arg(scene).args(["--sky", "1,1,1", "--size", "8x8", "--spp", "1", "-o"]).arg(image);
    assert!(reference.status().unwrap().success() && folder.path("").join(image).is_file());
    // A shot is text.
    Ran::of(folder.program().arg("shot").arg(scene)).was_refused(&["not UTF-8", "another name"]);
}

/// Names of a file in a table and in a warning, which a decoder's panic causes, cannot move the cursor of a terminal or fake lines.
#[test]
fn names_are_escaped_and_panics_of_decoders_are_warnings() {
    let folder = Folder::new();
    let escape = "\\u001b]0;title\\u0007\\nerror: none";
    folder.write("palette.png", include_bytes!("palette.png"));
    let scene = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0, 1]}}],
        "nodes": [{{"camera": 0, "name": "{escape}"}}, {{"mesh": 0}}],
        "cameras": [{{"type": "perspective", "perspective": {{"yfov": 1, "znear": 0.1}}, "name": "{escape}"}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "material": 0}}]}}],
        "materials": [{{"emissiveTexture": {{"index": 0}}, "pbrMetallicRoughness": {{"baseColorTexture": {{"index": 1}}}}}}],
        "textures": [{{"source": 0}}, {{"source": 1}}],
        "images": [{{"uri": "none.png", "name": "{escape}"}}, {{"uri": "palette.png"}}],
        "accessors": [{{"componentType": 5126, "count": 3, "type": "VEC3"}}]}}"#
    );
    folder.write("scene.gltf", scene);
    let ran = folder.done("info scene.gltf");
    let text = ran.stdout + &ran.stderr;
    assert!(text.contains("scene.gltf: surfaces lack a texture: images[") && text.contains("\\u{1b}"), "{text}");
    assert!(text.chars().all(|character| character == '\n' || !character.is_control()), "{text:?}");
    for bug in ["\nerror: none", "panicked", "internal error"] {
        assert!(!text.contains(bug), "{text}");
    }
}
