//! Small files that claim or need more memory than any machine has.

use std::sync::Arc;

use serde_json::{Value, json};

use super::warnings::warnings;
use super::{F32, File, TRIANGLE, assert_contains, load_bytes, load_within, too_much};

fn png(side: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::GrayImage::new(side, side).write_to(&mut bytes, image::ImageFormat::Png).expect("a PNG");
    bytes.into_inner()
}

/// A triangle for each image, with the image as its base colour.
fn with_images(count: usize, png: &[u8]) -> File {
    let mut file = File::with_triangle();
    let position = file.json["meshes"][0]["primitives"][0]["attributes"].clone();
    let primitive = |i: usize| json!({ "attributes": position, "material": i });
    file.json["meshes"][0]["primitives"] = (0..count).map(primitive).collect();
    for i in 0..count {
        let view = file.view(png);
        file.push("images", json!({ "bufferView": view, "name": format!("wall {i}") }));
        file.push("textures", json!({ "source": i }));
        file.push("materials", json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": i } } }));
    }
    file
}

#[test]
fn a_panic_of_a_decoder_is_a_warning_that_names_the_image() {
    // A palette of 5 bytes, which is no multiple of 3 bytes per colour.
    let mut broken = png(1);
    let palette = b"\0\0\0\x05PLTE\0\0\0\0\x02\x66\xd4\x01\0";
    assert_eq!(&broken[12..16], b"IHDR");
    broken[25] = 3;
    let crc = crc32(&broken[12..29]).to_be_bytes();
    broken[29..33].copy_from_slice(&crc);
    let palette_crc = crc32(&palette[4..13]).to_be_bytes();
    broken.splice(33..33, [&palette[..13], &palette_crc, b"\0\0\0\x02tRNS\0\x01\x01\x94\xfd\xae"].concat());
    let [warning] = warnings(&with_images(1, &broken)).try_into().expect("one warning");
    assert_contains(&warning, "images[0] (wall 0): ");
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    })
}

/// 2 MB of text that become 0.5 GB of materials.
#[test]
fn objects_are_counted_before_they_are_parsed() {
    let text = |list: &str, count: usize| {
        let objects = vec!["{}"; count].join(",");
        format!(r#"{{"asset": {{"version": "2.0"}}, "{list}": [{objects}]}}"#)
    };
    for list in ["materials", "nodes"] {
        assert_contains(&too_much(text(list, 600_000).as_bytes(), 100_000_000), "JSON of 600002 objects needs");
        assert!(load_within(text(list, 10_000).as_bytes(), 100_000_000).is_ok());
    }
}

/// 100 images of a few kB: 1.7 GB.
#[test]
fn images_are_counted_before_they_are_decoded() {
    let file = with_images(100, &png(2048));
    let error = too_much(&file.glb(), 1_000_000_000);
    assert_contains(
        &error,
        "folder/test.glb: 100 images (the largest is images[99] (wall 99), of 2048 × 2048 pixels) need 1.7 GB",
    );
    assert_contains(&error, "the limit is 1.0 GB");
    // The need follows from the header alone.
    let mut lie = png(4);
    lie[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
    let crc = crc32(&lie[12..29]).to_be_bytes();
    lie[29..33].copy_from_slice(&crc);
    assert_contains(
        &too_much(&with_images(1, &lie).glb(), 1_000_000_000),
        "images[0] (wall 0), of 16384 × 16384 pixels, needs 1.6 GB",
    );
    assert_eq!(with_images(3, &png(64)).scene().images.len(), 3);
}

/// Names of the same bytes share what is decoded: images of equal views, compressed views, and keyframes of animations.
#[test]
fn equal_ranges_of_bytes_are_decoded_once() {
    let mut file = with_images(100, &png(256));
    let view = file.json["bufferViews"][1].clone();
    for (i, image) in (0..100).zip(file.json["images"].as_array_mut().expect("images")) {
        image["bufferView"] = json!(1 + i % 2);
    }
    file.json["bufferViews"][2] = view;
    let scene = load_within(&file.glb(), 4_000_000).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((scene.images.len(), scene.textures.len()), (1, 1));

    let mut file = File::with_triangle();
    let times: Vec<f32> = (0..10_000).map(|i| i as f32).collect();
    let [input, output] = [file.floats("SCALAR", &times), file.floats("VEC3", &times.repeat(3))];
    let again = file.json["accessors"][output].clone();
    let output_again = file.push("accessors", again);
    let sampler = |i: usize| json!({ "input": input, "output": ([output, output_again][i % 2]) });
    let channel = |i: usize| json!({ "sampler": i, "target": { "node": 0, "path": "translation" } });
    let (samplers, channels): (Vec<_>, Vec<_>) = (0..1000).map(|i| (sampler(i), channel(i))).unzip();
    file.json["animations"] = json!([{ "samplers": samplers, "channels": channels }]);
    let scene = load_within(&file.glb(), 20_000_000).unwrap_or_else(|error| panic!("{error}"));
    let channels = &scene.motion.animations[0].channels;
    assert!(channels.len() == 1000 && channels.iter().all(|c| Arc::ptr_eq(&c.sampler, &channels[0].sampler)));
    // Another interpolation of the same numbers is another sampler.
    file.json["animations"][0]["samplers"][1]["interpolation"] = json!("STEP");
    let channels = &file.scene().motion.animations[0].channels;
    assert!(!Arc::ptr_eq(&channels[0].sampler, &channels[1].sampler));
}

/// 1,000 primitives that share 750,000 indices: each gets its own normal for every corner.
#[test]
fn corners_are_counted_before_they_are_read() {
    let mut file = File::with_triangle();
    let indices = file.u16_indices(&[0, 1, 2].repeat(250_000));
    let mut primitive = file.json["meshes"][0]["primitives"][0].clone();
    primitive["indices"] = json!(indices);
    file.json["meshes"][0]["primitives"] = vec![primitive; 1000].into();
    let error = too_much(&file.glb(), 4_000_000_000);
    assert_contains(&error, "1000 primitives of 750000000 corners need 21.");
}

#[test]
fn estimated_memory_is_sufficient() {
    let mut file = File::with_primitive(|file| {
        let corners: Vec<f32> = (0..3000).flat_map(|i| [(i % 7) as f32, (i % 11) as f32, (i % 13) as f32]).collect();
        let uv: Vec<f32> = corners.chunks(3).flat_map(|p| [p[0], p[1]]).collect();
        json!({
            "attributes": { "POSITION": file.floats("VEC3", &corners), "TEXCOORD_0": file.floats("VEC2", &uv) },
            "material": 0,
        })
    });
    let view = file.view(&png(1));
    file.push("images", json!({ "bufferView": view }));
    file.push("textures", json!({ "source": 0 }));
    file.push("materials", json!({ "normalTexture": { "index": 0 } }));
    let primitive = file.primitive();
    let bytes = primitive.positions.len() * (12 + 12 + 16 + 8) + 4 * primitive.indices.len();
    assert_eq!((primitive.tangents.len(), primitive.uv0.len()), (primitive.positions.len(), primitive.positions.len()));
    assert!(bytes > 100_000 && load_within(&file.glb(), bytes as u64).is_err());
    assert!(load_within(&file.glb(), 8 * bytes as u64).is_ok());
}

#[test]
fn instances_are_counted_before_they_are_made() {
    let instances = |count: usize, translation: Value| {
        let mut file = File::with_triangle();
        let accessor = file.push("accessors", json!({ "componentType": F32, "type": "VEC3", "count": count }));
        file.json["nodes"][0] = json!({
            "mesh": 0, "name": "a name of some length", "translation": translation,
            "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": accessor } } },
        });
        file
    };
    assert_contains(&too_much(&instances(1_000_000, json!([0, 0, 0])).glb(), 100_000_000), "1000000 instances need 3");
    // Duplicates at the same transform become one instance, with a warning.
    let crowd = instances(100_000, json!([1, 2, 3]));
    assert_eq!(crowd.scene().instances.len(), 1);
    assert_eq!(warnings(&crowd), ["folder/test.glb: left out: duplicate instances (99999)"]);
}

/// 3,000 primitives at 100,000 transforms: each list fits the budget, but their product does not.
#[test]
fn placed_primitives_are_limited() {
    let mut file = File::with_triangle();
    let primitive = file.json["meshes"][0]["primitives"][0].clone();
    file.json["meshes"][0]["primitives"] = vec![primitive; 3000].into();
    let translations: Vec<f32> = (0..300_000).map(|i| i as f32).collect();
    let translations = file.floats("VEC3", &translations);
    file.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": translations } } });
    assert_contains(&too_much(&file.glb(), 50_000_000_000), "300000000 placed primitives need 76.8 GB");
}

/// Transparent instances are visible once per duplicate. Instances with another transform or mesh are no duplicates.
#[test]
fn visible_duplicates_are_kept() {
    let count = |alpha_mode: &str, move_by: f32| {
        let mut file = File::with_primitive(
            |file| json!({ "attributes": { "POSITION": file.floats("VEC3", &TRIANGLE) }, "material": 0 }),
        );
        file.push("materials", json!({ "alphaMode": alpha_mode }));
        file.push("nodes", json!({ "mesh": 0, "translation": [move_by, 0, 0] }));
        file.push("nodes", json!({ "mesh": 0 }));
        file.scene().instances.len()
    };
    assert_eq!((count("BLEND", 0.0), count("OPAQUE", 0.0), count("MASK", 0.0), count("OPAQUE", 1e-9)), (3, 1, 1, 2));
}

#[test]
fn lists_are_no_objects() {
    for json in [
        r#"{"asset":["2.0",null],"nodes":[[]]}"#,
        r#"{"asset":{"version":"2.0"},"nodes":[[]]}"#,
        r#"[{"version":"2.0"}]"#,
        r#"{"asset":{"version":"2.0"},"materials":[{"pbrMetallicRoughness":[]}]}"#,
        r#"{"asset":{"version":"2.0"},"materials":[{"normalTexture":{"index":0,"extensions":[]}}]}"#,
        r#"{"asset":{"version":"2.0"},"materials":[{"normalTexture":{"index":0,"extensions":{"KHR_texture_transform":[]}}}]}"#,
        r#"{"asset":{"version":"2.0"},"extensions":[]}"#,
        r#"{"asset":{"version":"2.0"},"accessors":[[0,0,5126,false,1,"VEC3"]]}"#,
    ] {
        let error = load_bytes(json.as_bytes()).map(|_| ()).expect_err(json).to_string();
        assert!(json.starts_with('[') || error.contains("invalid type: sequence, expected struct "), "{json}: {error}");
    }
}
