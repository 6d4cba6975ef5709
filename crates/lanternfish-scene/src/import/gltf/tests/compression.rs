//! `EXT_meshopt_compression` and `EXT_mesh_gpu_instancing`.

mod codec;

use glam::{Quat, Vec3};
use meshoptimizer::{EncodeExpMode, encode_filter_exp, encode_filter_oct, encode_filter_quat};
use serde_json::{Value, json};

use self::codec::{indices_encoded, sequence_encoded, vertices_encoded};
use super::{F32, File, I8, I16, TRIANGLE, U16, U32, assert_contains, load_within};

/// A compressed view of `count` elements, over a fallback buffer without content.
fn compressed(file: &mut File, mode: &str, filter: Option<&str>, stride: usize, count: usize, bytes: &[u8]) -> usize {
    let stored = file.view(bytes);
    let mut extension = file.json["bufferViews"][stored].clone();
    extension["mode"] = json!(mode);
    extension["byteStride"] = json!(stride);
    extension["count"] = json!(count);
    if let Some(filter) = filter {
        extension["filter"] = json!(filter);
    }
    let view = json!({
        "buffer": 1, "byteOffset": 0, "byteLength": stride * count,
        "extensions": { "EXT_meshopt_compression": extension },
    });
    let view = file.push("bufferViews", view);
    if mode == "ATTRIBUTES" {
        file.json["bufferViews"][view]["byteStride"] = json!(stride);
    }
    view
}

fn accessor(file: &mut File, view: usize, shape: &str, component: u32, count: usize) -> usize {
    file.push("accessors", json!({ "bufferView": view, "componentType": component, "type": shape, "count": count }))
}

/// Adds the names of the extension, and the fallback buffer.
fn finish(file: &mut File) {
    let bin = file.bin.len();
    file.json["buffers"] = json!([{ "byteLength": bin }, { "byteLength": 9, "extensions": { "EXT_meshopt_compression": { "fallback": true } } }]);
    file.json["extensionsRequired"] = json!(["EXT_meshopt_compression", "KHR_mesh_quantization"]);
}

/// A file of `count` positions in these compressed bytes.
fn of_positions(bytes: &[u8], count: usize) -> File {
    let mut file = File::with_primitive(|file| {
        let view = compressed(file, "ATTRIBUTES", None, 12, count, bytes);
        json!({ "attributes": { "POSITION": accessor(file, view, "VEC3", F32, count) } })
    });
    finish(&mut file);
    file
}

fn corners() -> Vec<[f32; 3]> {
    TRIANGLE.as_chunks::<3>().0.to_vec()
}

#[test]
fn compressed_triangles_round_trip() {
    let positions = corners();
    for (mode, component) in [("TRIANGLES", U16), ("TRIANGLES", U32), ("INDICES", U16), ("INDICES", U32)] {
        let mut file = File::with_primitive(|file| {
            let bytes = vertices_encoded(&positions);
            let view = compressed(file, "ATTRIBUTES", None, 12, 3, &bytes);
            let indices = [0, 1, 2];
            let bytes = if mode == "TRIANGLES" { indices_encoded(&indices, 3) } else { sequence_encoded(&indices, 3) };
            let stride = if component == U16 { 2 } else { 4 };
            let index_view = compressed(file, mode, None, stride, 3, &bytes);
            let index_accessor = accessor(file, index_view, "SCALAR", component, 3);
            json!({ "attributes": { "POSITION": accessor(file, view, "VEC3", F32, 3) }, "indices": index_accessor })
        });
        finish(&mut file);
        let primitive = file.primitive();
        assert_eq!(primitive.positions, positions.iter().copied().map(Vec3::from).collect::<Vec<_>>());
        // The codec may rotate the order of a triangle's corners.
        let first = primitive.indices.iter().position(|i| *i == 0).expect("index 0");
        assert_eq!([0, 1, 2].map(|i| primitive.indices[(first + i) % 3]), [0, 1, 2], "{mode}");
    }
}

/// 100 views of 1.2 MB each in equal compressed bytes, within 10 MB for all.
#[test]
fn views_of_equal_compressed_bytes_are_decoded_once() {
    let positions: Vec<[f32; 3]> = corners().iter().copied().cycle().take(99_999).collect();
    let mut file = of_positions(&vertices_encoded(&positions), 99_999);
    let view = file.json["bufferViews"][1].clone();
    let primitive = |file: &mut File| {
        let view = file.push("bufferViews", view.clone());
        json!({ "attributes": { "POSITION": accessor(file, view, "VEC3", F32, 3) } })
    };
    let primitives: Vec<_> = (0..100).map(|_| primitive(&mut file)).collect();
    file.json["meshes"][0]["primitives"] = primitives.into();
    let scene = load_within(&file.glb(), 10_000_000).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.meshes[0].primitives.len(), 100);
}

#[test]
fn filters_are_undone() {
    let positions: Vec<[f32; 3]> = corners().iter().map(|p| p.map(|x| 3.5 * x)).collect();
    let normals = [Vec3::new(0.6, 0.0, -0.8), Vec3::Y, Vec3::new(-1.0, 2.0, 2.0) / 3.0];
    let padded: Vec<_> = normals.iter().map(|n| n.extend(0.0).to_array()).collect();
    for bits in [8, 16] {
        let mut file = File::with_primitive(|file| {
            let mut filtered = [0; 36];
            encode_filter_exp(&mut filtered, 3, 12, 15, positions.as_flattened(), EncodeExpMode::Separate)
                .expect("encoded");
            let bytes = vertices_encoded(filtered.as_chunks::<12>().0);
            let view = compressed(file, "ATTRIBUTES", Some("EXPONENTIAL"), 12, 3, &bytes);
            let position = accessor(file, view, "VEC3", F32, 3);
            let normal = if bits == 8 {
                let mut filtered = [0; 12];
                encode_filter_oct(&mut filtered, 3, 4, 8, padded.as_flattened()).expect("encoded");
                let bytes = vertices_encoded(filtered.as_chunks::<4>().0);
                let view = compressed(file, "ATTRIBUTES", Some("OCTAHEDRAL"), 4, 3, &bytes);
                accessor(file, view, "VEC3", I8, 3)
            } else {
                let mut filtered = [0; 24];
                encode_filter_oct(&mut filtered, 3, 8, 12, padded.as_flattened()).expect("encoded");
                let bytes = vertices_encoded(filtered.as_chunks::<8>().0);
                let view = compressed(file, "ATTRIBUTES", Some("OCTAHEDRAL"), 8, 3, &bytes);
                accessor(file, view, "VEC3", I16, 3)
            };
            file.json["accessors"][normal]["normalized"] = json!(true);
            json!({ "attributes": { "POSITION": position, "NORMAL": normal } })
        });
        finish(&mut file);
        let primitive = file.primitive();
        // 15 bits of mantissa below 4.
        let near = |a: Vec3, b: [f32; 3]| a.abs_diff_eq(b.into(), 4.0 / f32::from(1u16 << 14));
        assert!(primitive.positions.iter().zip(&positions).all(|(a, b)| near(*a, *b)), "{:?}", primitive.positions);
        // Quantisation to 8 bits, twice: of the octahedral square and of the decoded vector.
        let tolerance = 2.0 / 127.0;
        let is_near = primitive.normals.iter().zip(&normals).all(|(a, b)| a.abs_diff_eq(*b, tolerance));
        assert!(is_near, "{bits} bits: {:?}", primitive.normals);
    }
}

/// A triangle with instances of these attributes.
fn instanced(attributes: impl FnOnce(&mut File) -> Value) -> File {
    let mut file = File::with_triangle();
    let attributes = attributes(&mut file);
    file.json["nodes"][0] = json!({
        "mesh": 0, "name": "many", "translation": [0, 0, 10],
        "extensions": { "EXT_mesh_gpu_instancing": { "attributes": attributes } },
    });
    file.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    file
}

#[test]
fn instances_are_placed_relative_to_their_node() {
    let quarter = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
    let file = instanced(|file| {
        let rotations = [Quat::IDENTITY.to_array(), quarter.to_array()].concat();
        json!({
            "TRANSLATION": file.floats("VEC3", &[1.0, 0.0, 0.0, 0.0, 2.0, 0.0]),
            "ROTATION": file.floats("VEC4", &rotations),
            "SCALE": file.floats("VEC3", &[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]),
        })
    });
    let scene = file.scene();
    assert_eq!((scene.meshes.len(), scene.triangle_counts()), (1, (1, 2)));
    let at = |i: usize, p| scene.instances[i].world_from_object.transform_point3(p);
    assert!(at(0, Vec3::X).abs_diff_eq(Vec3::new(2.0, 0.0, 10.0), 1e-6));
    assert!(at(1, Vec3::X).abs_diff_eq(Vec3::new(0.0, 5.0, 10.0), 1e-5));
    assert!(scene.instances.iter().all(|instance| instance.name == "many"));
}

#[test]
fn rotations_of_instances_may_be_compressed_quaternions() {
    let rotation = Quat::from_xyzw(0.1, -0.5, 0.3, 0.8).normalize();
    let mut file = instanced(|file| {
        let mut filtered = [0; 8];
        encode_filter_quat(&mut filtered, 1, 8, 16, &rotation.to_array()).expect("encoded");
        let bytes = vertices_encoded(&[filtered]);
        let view = compressed(file, "ATTRIBUTES", Some("QUATERNION"), 8, 1, &bytes);
        let accessor = accessor(file, view, "VEC4", I16, 1);
        file.json["accessors"][accessor]["normalized"] = json!(true);
        json!({ "ROTATION": accessor })
    });
    finish(&mut file);
    file.json["extensionsRequired"] = json!(["EXT_meshopt_compression", "EXT_mesh_gpu_instancing"]);
    let decoded = Quat::from_affine3(&glam::Affine3::from(file.scene().instances[0].world_from_object));
    // A quaternion and its negative are one rotation.
    assert!(decoded.dot(rotation).abs() > 1.0 - 1e-6, "{decoded} {rotation}");
}

#[test]
fn invalid_instances_are_refused() {
    let file = instanced(
        |file| json!({ "TRANSLATION": file.floats("VEC3", &[0.0; 6]), "SCALE": file.floats("VEC3", &[1.0; 9]) }),
    );
    assert_contains(&file.fault(), "attributes of 2 and 3 elements");
    let file = instanced(|file| json!({ "TRANSLATION": file.floats("VEC3", &[0.0, f32::NAN, 0.0]) }));
    assert_contains(&file.fault(), "nodes[0]: EXT_mesh_gpu_instancing: a transform is not finite");
    let file = instanced(|file| {
        let count = 1 << 23;
        json!({ "SCALE": file.push("accessors", json!({ "componentType": F32, "type": "VEC3", "count": count })) })
    });
    assert_contains(&file.fault(), "more than 4194304 instances");
    let file = instanced(|file| json!({ "_ID": file.floats("SCALAR", &[0.0; 6]) }));
    assert_eq!(file.scene().instances.len(), 1, "attributes of the application's own are not read");
}

#[test]
fn damaged_compression_is_refused() {
    let encoded = vertices_encoded(&corners());
    let build = |bytes: &[u8], change: &dyn Fn(&mut Value)| {
        let mut file = of_positions(bytes, 3);
        change(&mut file.json["bufferViews"][1]);
        file
    };
    let set = |key: &'static str, value: Value| {
        move |view: &mut Value| view["extensions"]["EXT_meshopt_compression"][key] = value.clone()
    };
    let mut sound = build(&encoded, &|_| ());
    sound.json["buffers"][1]["uri"] = json!("not there.bin");
    assert_eq!(sound.scene().triangle_counts(), (1, 1), "bytes of a fallback are not read");
    for length in 0..encoded.len() {
        assert_contains(&build(&encoded[..length], &|_| ()).fault(), "damaged");
    }
    for (key, value, fault) in [
        ("byteStride", json!(14), "cannot be"),
        ("byteStride", json!(0), "36 bytes stated, 0 compressed"),
        ("byteStride", json!(260), "cannot be"),
        ("mode", json!("TRIANGLES"), "mode TRIANGLES"),
        ("mode", json!("OTHER"), "mode OTHER"),
        ("filter", json!("QUATERNION"), "filter QUATERNION"),
        ("count", json!(1_000_000_000), "cannot be in"),
        ("count", json!(u64::MAX), "cannot be in"),
        ("count", json!(2), "36 bytes stated, 24 compressed"),
        ("byteLength", json!(1000), "exceed buffers[0]"),
        ("buffer", json!(1), "buffers[1] has no content"),
        ("buffer", json!(7), "buffers[7]"),
    ] {
        assert_contains(&build(&encoded, &set(key, value)).fault(), fault);
    }
    // Random bytes of every length.
    for length in 1..200usize {
        let noise = (0..length).map(|i| (i * i * 31 + 7 * length) as u8).collect::<Vec<_>>();
        for header in [0xa0, 0xa1] {
            let mut noise = noise.clone();
            noise[0] = header;
            let _ = build(&noise, &|_| ()).load();
        }
    }
}
