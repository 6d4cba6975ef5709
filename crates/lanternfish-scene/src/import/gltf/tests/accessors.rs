//! Tests of all forms of accessors.

use glam::{Vec2, Vec3, Vec4};
use serde_json::json;

use super::{F32, File, I16, U8, U16, U32, assert_contains, bytes_of};

#[test]
fn interleaved_attributes_are_separated() {
    let file = File::with_primitive(|file| {
        let vertex = |x: f32, y: f32| [x, y, 0.0, 0.0, 0.0, 1.0, x, 1.0 - y];
        let view = file.view(&bytes_of(&[vertex(0.0, 0.0), vertex(1.0, 0.0), vertex(0.0, 1.0)].concat()));
        file.json["bufferViews"][view]["byteStride"] = json!(32);
        let mut accessor = |offset: usize, shape: &str| {
            let value = json!({
                "bufferView": view, "byteOffset": offset, "componentType": F32, "type": shape, "count": 3,
            });
            file.push("accessors", value)
        };
        let attributes = [accessor(0, "VEC3"), accessor(12, "VEC3"), accessor(24, "VEC2")];
        json!({ "attributes": {
            "POSITION": attributes[0], "NORMAL": attributes[1], "TEXCOORD_0": attributes[2],
        } })
    });
    let primitive = file.primitive();
    assert_eq!(primitive.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(primitive.normals, [Vec3::Z; 3]);
    assert_eq!(primitive.uv0, [Vec2::Y, Vec2::ONE, Vec2::ZERO]);
    assert_eq!(primitive.indices, [0, 1, 2]);
}

#[test]
fn sparse_elements_replace_stored_ones_and_zeros() {
    for is_stored in [true, false] {
        let mut file = File::with_triangle();
        let indices = file.view(&[2]);
        let values = file.view(&bytes_of(&[0.0, 5.0, 0.0]));
        let accessor = &mut file.json["accessors"][0];
        accessor["sparse"] = json!({
            "count": 1,
            "indices": { "bufferView": indices, "componentType": U8 },
            "values": { "bufferView": values },
        });
        if !is_stored {
            accessor.as_object_mut().expect("an accessor").remove("bufferView");
        }
        let second = if is_stored { Vec3::X } else { Vec3::ZERO };
        assert_eq!(file.primitive().positions, [Vec3::ZERO, second, Vec3::new(0.0, 5.0, 0.0)]);
        file.json["accessors"][0]["sparse"]["count"] = json!(4);
        assert_contains(&file.fault(), "sparse: 4 of 3");
        file.json["accessors"][0]["sparse"]["count"] = json!(1);
        file.bin[36] = 3;
        assert_contains(&file.fault(), "sparse: element 3 of 3");
    }
}

#[test]
fn an_accessor_without_data_is_zero_up_to_a_limit() {
    let mut file = File::with_triangle();
    let uv = file.push("accessors", json!({ "componentType": F32, "type": "VEC2", "count": 3 }));
    file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    assert_eq!(file.primitive().uv0, [Vec2::ZERO; 3]);
    file.json["accessors"][uv]["count"] = json!(1_u64 << 40);
    assert_contains(&file.fault(), "without a bufferView");
}

#[test]
fn normalised_integers_are_scaled() {
    let mut file = File::with_triangle();
    let uv: Vec<u8> = [0_u16, 65_535, 65_535, 0, 0, 0].iter().flat_map(|value| value.to_le_bytes()).collect();
    let uv = file.accessor("VEC2", U16, 3, &uv);
    let color = file.accessor("VEC3", U8, 3, &[255, 0, 0, 0, 255, 0, 0, 0, 51]);
    let normal: Vec<u8> =
        [0_i16, 0, 32_767, 0, 0, 32_767, -32_768, 0, 0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let normal = file.accessor("VEC3", I16, 3, &normal);
    for accessor in [uv, color, normal] {
        file.json["accessors"][accessor]["normalized"] = json!(true);
    }
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_0"] = json!(uv);
    attributes["COLOR_0"] = json!(color);
    attributes["NORMAL"] = json!(normal);
    let primitive = file.primitive();
    assert_eq!(primitive.uv0, [Vec2::Y, Vec2::X, Vec2::ZERO]);
    let colors = [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 1.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 0.2, 1.0)];
    assert_eq!(primitive.colors, colors);
    assert_eq!(primitive.normals, [Vec3::Z, Vec3::Z, Vec3::NEG_X]);
}

#[test]
fn quantised_positions_are_read_as_they_are() {
    let mut file = File::with_primitive(|file| {
        // Rows of four shorts, the last of them padding.
        let rows: Vec<u8> = [0_i16, 0, 0, 99, 300, 0, 0, 99, 0, -300, 0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let positions = file.accessor("VEC3", I16, 3, &rows);
        file.json["bufferViews"][0]["byteStride"] = json!(8);
        json!({ "attributes": { "POSITION": positions } })
    });
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    assert_eq!(file.primitive().positions, [Vec3::ZERO, 300.0 * Vec3::X, -300.0 * Vec3::Y]);
}

#[test]
fn indices_of_every_width_are_read() {
    let corners = [2_u32, 0, 1];
    let u8s: Vec<u8> = corners.iter().map(|index| *index as u8).collect();
    let u16s: Vec<u8> = corners.iter().flat_map(|index| (*index as u16).to_le_bytes()).collect();
    let u32s: Vec<u8> = corners.iter().flat_map(|index| index.to_le_bytes()).collect();
    for (component_type, bytes) in [(U8, u8s), (U16, u16s), (U32, u32s)] {
        let mut file = File::with_triangle();
        let normal = file.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3));
        let indices = file.accessor("SCALAR", component_type, 3, &bytes);
        let primitive = &mut file.json["meshes"][0]["primitives"][0];
        primitive["indices"] = json!(indices);
        primitive["attributes"]["NORMAL"] = json!(normal);
        assert_eq!(file.primitive().indices, corners, "component type {component_type}");
    }
}

#[test]
fn ranges_beyond_their_container_are_refused() {
    type Break = fn(&mut File);
    let cases: [(&str, Break); 12] = [
        ("exceed the bufferView", |file| file.json["accessors"][0]["count"] = json!(4)),
        ("exceed the bufferView", |file| file.json["accessors"][0]["count"] = json!(u64::MAX)),
        ("exceed the bufferView", |file| file.json["accessors"][0]["byteOffset"] = json!(u64::MAX)),
        ("exceed buffers[0]", |file| file.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX)),
        ("exceed buffers[0]", |file| file.json["bufferViews"][0]["byteLength"] = json!(37)),
        ("bytes stated", |file| file.json["buffers"] = json!([{ "byteLength": 40 }])),
        ("byteStride 8", |file| file.json["bufferViews"][0]["byteStride"] = json!(8)),
        ("VEC3 is expected", |file| file.json["accessors"][0]["type"] = json!("VEC2")),
        ("bufferViews[7]", |file| file.json["accessors"][0]["bufferView"] = json!(7)),
        ("POSITION: accessors[0]: element 1 is not finite", |file| {
            file.bin[16..20].copy_from_slice(&f32::NAN.to_le_bytes());
        }),
        ("meshes[0].primitives[0]: indices: accessors[1]: element 2 is 3, but there are 3 vertices", |file| {
            file.json["meshes"][0]["primitives"][0]["indices"] = json!(file.u16_indices(&[0, 1, 3]));
        }),
        ("restart", |file| {
            file.json["meshes"][0]["primitives"][0]["indices"] = json!(file.u16_indices(&[0, 1, 65_535]));
        }),
    ];
    for (message, break_file) in cases {
        let mut file = File::with_triangle();
        assert_eq!(file.primitive().positions.len(), 3, "the file is good before it is broken");
        break_file(&mut file);
        assert_contains(&file.fault(), message);
    }
}

#[test]
fn elements_without_data_are_counted_over_all_primitives() {
    let build = |count: usize| {
        let mut file = File::with_primitive(|file| {
            let zeros = json!({ "componentType": F32, "type": "VEC3", "count": 1 << 20 });
            json!({ "attributes": { "POSITION": file.push("accessors", zeros) }, "indices": file.u16_indices(&[0, 1, 2]) })
        });
        let primitive = file.json["meshes"][0]["primitives"][0].clone();
        file.json["meshes"][0]["primitives"] = vec![primitive; count].into();
        file
    };
    assert_eq!(build(16).scene().triangle_counts().0, 16);
    assert_contains(&build(17).fault(), "more than 16777216 in all");
}
