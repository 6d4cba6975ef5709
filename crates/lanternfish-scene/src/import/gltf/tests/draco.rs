//! Primitives that are compressed with Draco.

use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, GeometryAttributeType, MeshEncoder, PointAttribute, mesh::Mesh,
};
use glam::{Vec2, Vec3};
use serde_json::json;

use super::{F32, File, U16, assert_contains, damaged};
use crate::Primitive;

/// Vertices along an edge of the surface.
const EDGE: u16 = 21;
/// Bits of quantised values.
const BITS: i32 = 14;

/// A wavy surface with normals and texture coordinates.
struct Surface {
    positions: Vec<f32>,
    normals: Vec<f32>,
    uvs: Vec<f32>,
    indices: Vec<u16>,
}

fn surface() -> Surface {
    let mut surface = Surface { positions: vec![], normals: vec![], uvs: vec![], indices: vec![] };
    for (x, y) in (0..EDGE).flat_map(|y| (0..EDGE).map(move |x| (x, y))) {
        let at = Vec2::new(f32::from(x), f32::from(y)) / f32::from(EDGE - 1);
        let slope = Vec2::new(0.6 * (6.0 * at.x).cos(), 0.4 * (4.0 * at.y).cos());
        surface.positions.extend([at.x, at.y, 0.1 * (6.0 * at.x).sin() + 0.1 * (4.0 * at.y).sin()]);
        surface.normals.extend((-slope).extend(1.0).normalize().to_array());
        surface.uvs.extend([2.0 * at.x, 1.0 - at.y]);
        if x + 1 < EDGE && y + 1 < EDGE {
            let i = y * EDGE + x;
            surface.indices.extend([i, i + 1, i + EDGE, i + EDGE, i + 1, i + EDGE + 1]);
        }
    }
    surface
}

/// Compresses a surface. `method`: 0 is sequential, 1 is EdgeBreaker.
fn compressed(surface: &Surface, method: i32) -> Vec<u8> {
    let mut mesh = Mesh::new();
    let count = surface.positions.len() / 3;
    mesh.set_num_points(count);
    let attributes = [
        (GeometryAttributeType::Position, 3, &surface.positions),
        (GeometryAttributeType::Normal, 3, &surface.normals),
        (GeometryAttributeType::TexCoord, 2, &surface.uvs),
    ];
    let mut options = EncoderOptions::new();
    options.set_encoding_method(method);
    for (kind, size, values) in attributes {
        let mut attribute = PointAttribute::new();
        attribute.init(kind, size, DataType::Float32, false, count);
        attribute.buffer_mut().update_f32s_le(0, values);
        let id = mesh.add_attribute(attribute);
        options.set_attribute_quantization(id, BITS);
    }
    let indices: Vec<u32> = surface.indices.iter().map(|index| u32::from(*index)).collect();
    mesh.set_num_faces(indices.len() / 3);
    mesh.set_faces_from_flat_indices(&indices);
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut buffer = EncoderBuffer::new();
    encoder.encode(&options, &mut buffer).expect("a mesh that can be encoded");
    buffer.data().to_vec()
}

/// A file whose only primitive is compressed.
fn file(surface: &Surface, bytes: &[u8]) -> File {
    let count = surface.positions.len() / 3;
    let mut file = File::with_primitive(|file| {
        let view = file.view(bytes);
        let mut add = |shape: &str, component_type: u32, count: usize| {
            file.push("accessors", json!({ "componentType": component_type, "type": shape, "count": count }))
        };
        let [position, normal, uv] = [add("VEC3", F32, count), add("VEC3", F32, count), add("VEC2", F32, count)];
        let indices = add("SCALAR", U16, surface.indices.len());
        json!({
            "attributes": { "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv },
            "indices": indices,
            "extensions": { "KHR_draco_mesh_compression": {
                "bufferView": view, "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }
            } },
        })
    });
    file.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    file
}

/// The corners of all triangles: position, normal and texture coordinates, sorted by position.
fn corners(primitive: &Primitive) -> Vec<(Vec3, Vec3, Vec2)> {
    let corner = |i: &u32| {
        let i = *i as usize;
        (primitive.positions[i], primitive.normals[i], primitive.uv0[i])
    };
    let mut corners: Vec<_> = primitive.indices.iter().map(corner).collect();
    let key = |p: &Vec3| (40.0 * p.truncate()).round().as_ivec2().to_array();
    corners.sort_by_key(|(p, ..)| key(p));
    corners
}

#[test]
fn compressed_primitives_equal_plain_ones_within_quantisation() {
    let surface = surface();
    let plain = File::with_primitive(|file| {
        let indices = file.u16_indices(&surface.indices);
        json!({ "indices": indices, "attributes": {
            "POSITION": file.floats("VEC3", &surface.positions),
            "NORMAL": file.floats("VEC3", &surface.normals),
            "TEXCOORD_0": file.floats("VEC2", &surface.uvs),
        } })
    });
    let expected = corners(&plain.scene().meshes[0].primitives[0]);
    for method in [0, 1] {
        let bytes = compressed(&surface, method);
        assert!(bytes.len() < 32 * surface.positions.len() / 3, "{method}: {} bytes", bytes.len());
        let scene = file(&surface, &bytes).scene();
        assert!(scene.validate().is_ok());
        let actual = corners(&scene.meshes[0].primitives[0]);
        assert_eq!(actual.len(), expected.len(), "{method}");
        let step = 0.5f32.powi(BITS);
        for ((p, n, uv), (p_expected, n_expected, uv_expected)) in actual.iter().zip(&expected) {
            assert!((*p - *p_expected).abs().max_element() < 1.01 * step, "{method}: {p}, {p_expected}");
            assert!(n.angle_between(*n_expected) < 8.0 * step, "{method}: {n}, {n_expected}");
            assert!((*uv - *uv_expected).abs().max_element() < 2.02 * step, "{method}: {uv}, {uv_expected}");
        }
    }
}

#[test]
fn an_uncompressed_fallback_is_preferred() {
    let mut file = File::with_triangle();
    file.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    file.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": { "POSITION": 0 } } });
    assert_eq!(file.scene().triangle_counts(), (1, 1));
}

#[test]
fn what_the_accessors_state_has_to_be_there() {
    let surface = surface();
    let bytes = compressed(&surface, 1);
    for (accessor, count) in [(0, 7), (3, 3), (3, 100_000), (0, 100_000)] {
        let mut file = file(&surface, &bytes);
        file.json["accessors"][accessor]["count"] = json!(count);
        assert_contains(&file.fault(), "compressed");
    }
    let mut file = file(&surface, &bytes);
    file.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["NORMAL"] =
        json!(9);
    assert_contains(&file.fault(), "no attribute 9");
}

/// Damaged data is an error, or a mesh that is sound, and never a panic.
#[test]
fn damaged_compressed_data_does_not_panic() {
    let surface = surface();
    for method in [0, 1] {
        let bytes = compressed(&surface, method);
        let mut refused = 0;
        for i in 0..1000usize {
            let damaged = damaged(&bytes, i, 0..40);
            match file(&surface, &damaged).load() {
                Ok(scene) => assert!(scene.validate().is_ok(), "{method}, {i}"),
                Err(error) => {
                    assert!(!error.to_string().contains("panic"), "{method}, {i}: {error}");
                    refused += 1;
                }
            }
        }
        println!("method {method}: {refused} of 1000 were refused");
        assert!(refused > 300, "{method}: {refused}");
    }
}
