//! Primitives that are compressed with Draco. `draco/` has the surface of these tests, compressed with the reference encoder
//! (draco3dgltf 1.5.7) by each of its methods; the content is this project's own.

use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, GeometryAttributeType, MeshEncoder, PointAttribute, mesh::Mesh,
};
use glam::{Vec2, Vec3, Vec4};
use serde_json::json;

use super::{F32, File, U8, U16, assert_contains, damaged, load_within, too_much};
use crate::Primitive;

/// Vertices along an edge of the surface.
const EDGE: u16 = 24;
/// Bits of quantised values.
const BITS: i32 = 14;
/// Streams of the reference encoder.
const REFERENCE: [(&str, &[u8]); 3] = [
    ("reference, sequential", include_bytes!("draco/sequential.drc")),
    ("reference, EdgeBreaker", include_bytes!("draco/edgebreaker.drc")),
    ("reference, EdgeBreaker by valence", include_bytes!("draco/edgebreaker_valence.drc")),
];

/// A wavy surface with normals, texture coordinates and colours.
struct Surface {
    positions: Vec<f32>,
    normals: Vec<f32>,
    uvs: Vec<f32>,
    colors: Vec<u8>,
    indices: Vec<u16>,
}

fn surface() -> Surface {
    let mut surface = Surface { positions: vec![], normals: vec![], uvs: vec![], colors: vec![], indices: vec![] };
    for (x, y) in (0..EDGE).flat_map(|y| (0..EDGE).map(move |x| (x, y))) {
        let at = Vec2::new(f32::from(x), f32::from(y)) / f32::from(EDGE - 1);
        let slope = Vec2::new(0.6 * (6.0 * at.x).cos(), 0.4 * (4.0 * at.y).cos());
        surface.positions.extend([at.x, at.y, 0.1 * (6.0 * at.x).sin() + 0.1 * (4.0 * at.y).sin()]);
        surface.normals.extend((-slope).extend(1.0).normalize().to_array());
        surface.uvs.extend([2.0 * at.x, 1.0 - at.y]);
        let (red, green) = (11 * x as u8, 11 * y as u8);
        surface.colors.extend([red, green, 255 - red, 255]);
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
    let mut colors = PointAttribute::new();
    colors.init(GeometryAttributeType::Color, 4, DataType::Uint8, true, count);
    colors.buffer_mut().update(&surface.colors, None);
    mesh.add_attribute(colors);
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
        let color = add("VEC4", U8, count);
        let indices = add("SCALAR", U16, surface.indices.len());
        file.json["accessors"][color]["normalized"] = json!(true);
        json!({
            "attributes": { "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv, "COLOR_0": color },
            "indices": indices,
            "extensions": { "KHR_draco_mesh_compression": {
                "bufferView": view, "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "COLOR_0": 3 }
            } },
        })
    });
    file.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    file
}

/// The corners of all triangles: position, normal, texture coordinates and colour, sorted by position.
fn corners(primitive: &Primitive) -> Vec<(Vec3, Vec3, Vec2, Vec4)> {
    let corner = |i: &u32| {
        let i = *i as usize;
        (primitive.positions[i], primitive.normals[i], primitive.uv0[i], primitive.colors[i])
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
        let colors = file.accessor("VEC4", U8, surface.colors.len() / 4, &surface.colors);
        file.json["accessors"][colors]["normalized"] = json!(true);
        json!({ "indices": indices, "attributes": {
            "POSITION": file.floats("VEC3", &surface.positions),
            "NORMAL": file.floats("VEC3", &surface.normals),
            "TEXCOORD_0": file.floats("VEC2", &surface.uvs),
            "COLOR_0": colors,
        } })
    });
    let expected = corners(&plain.scene().meshes[0].primitives[0]);
    let own = [0, 1].map(|method| compressed(&surface, method));
    let own = [("own, sequential", &own[0][..]), ("own, EdgeBreaker", &own[1][..])];
    for (method, bytes) in own.into_iter().chain(REFERENCE) {
        assert!(bytes.len() < 36 * surface.positions.len() / 3, "{method}: {} bytes", bytes.len());
        let scene = file(&surface, bytes).scene();
        assert!(scene.validate().is_ok());
        let actual = corners(&scene.meshes[0].primitives[0]);
        assert_eq!(actual.len(), expected.len(), "{method}");
        let step = 0.5f32.powi(BITS);
        for ((p, n, uv, color), (p_expected, n_expected, uv_expected, color_expected)) in actual.iter().zip(&expected) {
            assert_eq!(color, color_expected, "{method}: {p}");
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
    // The last one states as many bytes as there are, but for a multiple of 2^64.
    let overflowing = surface.positions.len() as u64 / 3 + (1 << 62);
    for (accessor, count) in [(0, 7), (3, 3), (3, 100_000), (0, 100_000), (1, overflowing)] {
        let mut file = file(&surface, &bytes);
        file.json["accessors"][accessor]["count"] = json!(count);
        assert_contains(&file.fault(), "compressed");
    }
    let mut file = file(&surface, &bytes);
    file.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["NORMAL"] =
        json!(9);
    assert_contains(&file.fault(), "no attribute 9");
}

/// A stream of 4 kB may state any number of vertices.
#[test]
fn what_the_accessors_state_is_counted_before_it_is_decoded() {
    let surface = surface();
    let mut file = file(&surface, REFERENCE[1].1);
    let count = surface.positions.len() / 3;
    assert!(load_within(&file.glb(), 1000 * count as u64).is_ok());
    for accessor in 0..4 {
        file.json["accessors"][accessor]["count"] = json!(100_000_000);
    }
    assert_contains(&too_much(&file.glb(), 10_000_000_000), "1 primitives of 3174 corners need");
}

/// Damaged data is an error, or a mesh that is sound, and never a panic.
#[test]
fn damaged_compressed_data_does_not_panic() {
    let surface = surface();
    for (method, bytes) in REFERENCE {
        let mut refused = 0;
        for i in 0..1000usize {
            let damaged = damaged(bytes, i, 0..40);
            match file(&surface, &damaged).load() {
                // `load_with` refuses these.
                Ok(scene) if scene.check_reach().is_err() => refused += 1,
                Ok(scene) => assert_eq!(scene.validate(), Ok(()), "{method}, {i}"),
                Err(error) => {
                    assert!(!error.to_string().contains("panic"), "{method}, {i}: {error}");
                    refused += 1;
                }
            }
        }
        println!("{method}: {refused} of 1000 were refused");
        assert!(refused > 300, "{method}: {refused}");
    }
}
