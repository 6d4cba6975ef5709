//! Tests of topologies, normals and tangents.

use glam::{Vec2, Vec3, Vec4};
use serde_json::{Value, json};

use super::{File, TRIANGLE, assert_contains};
use crate::Primitive;

/// Five points of a planar zigzag: (0, 0), (0, 1), (1, 0), (1, 1), (2, 0).
const ZIGZAG: [f32; 15] = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 2.0, 0.0, 0.0];

/// Up to five normals of the plane z = 0.
const UP: [f32; 15] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];

fn zigzag(mode: u32, indices: Option<&[u16]>) -> File {
    File::with_primitive(|file| {
        let attributes = json!({ "POSITION": file.floats("VEC3", &ZIGZAG), "NORMAL": file.floats("VEC3", &UP) });
        let mut primitive = json!({ "attributes": attributes, "mode": mode });
        if let Some(indices) = indices {
            primitive["indices"] = json!(file.u16_indices(indices));
        }
        primitive
    })
}

/// For each triangle of a primitive in the plane z = 0, true if it faces +z.
fn facings(primitive: &Primitive) -> Vec<bool> {
    let (triangles, _) = primitive.indices.as_chunks::<3>();
    let corner = |index: u32| primitive.positions[index as usize];
    triangles.iter().map(|[a, b, c]| (corner(*b) - corner(*a)).cross(corner(*c) - corner(*a)).z > 0.0).collect()
}

#[test]
fn strips_and_fans_become_lists_of_one_winding() {
    let primitive = zigzag(5, None).primitive();
    assert_eq!((&primitive.indices[..], facings(&primitive)), (&[0, 1, 2, 1, 3, 2, 2, 3, 4][..], vec![false; 3]));
    let degenerate = zigzag(5, Some(&[0, 1, 2, 2, 3, 3, 4, 2])).primitive();
    assert_eq!(degenerate.indices, [0, 1, 2, 3, 2, 4]);
    let fan = zigzag(6, Some(&[0, 2, 3, 1])).primitive();
    assert_eq!((fan.indices.len(), facings(&fan)), (6, vec![true; 2]));
    assert_eq!(fan.positions.len(), 4, "the fifth is not used");
    // Incomplete triangles are dropped.
    assert_eq!(zigzag(4, Some(&[0, 2, 1, 3, 4])).primitive().indices, [0, 2, 1]);
    for file in [zigzag(5, Some(&[0, 1])), zigzag(6, Some(&[]))] {
        assert!(file.scene().meshes[0].primitives.is_empty());
    }
    assert_contains(&zigzag(7, None).fault(), "mode 7");
}

#[test]
fn unused_vertices_are_dropped() {
    let primitive = zigzag(4, Some(&[4, 3, 2])).primitive();
    assert_eq!(primitive.indices, [2, 1, 0]);
    assert_eq!(primitive.positions, [Vec3::X, Vec3::new(1.0, 1.0, 0.0), 2.0 * Vec3::X]);
    assert_eq!(primitive.normals.len(), 3);
}

#[test]
fn attributes_of_unequal_length_are_refused() {
    let mut file = File::with_triangle();
    let normals = file.floats("VEC3", &UP);
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    assert_contains(&file.fault(), "NORMAL: 5 elements, but there are 3 vertices");
}

#[test]
fn missing_normals_are_flat() {
    // Two triangles that share an edge, at a right angle.
    let file = File::with_primitive(|file| {
        let positions = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        let colors = file.floats("VEC3", &[0.0; 12]);
        let indices = file.u16_indices(&[0, 1, 2, 0, 3, 1]);
        json!({ "attributes": { "POSITION": positions, "COLOR_0": colors }, "indices": indices })
    });
    let primitive = file.primitive();
    assert_eq!(primitive.indices, [0, 1, 2, 3, 4, 5]);
    assert_eq!(primitive.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Y, Vec3::Y, Vec3::Y]);
    assert_eq!(primitive.positions, [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ZERO, Vec3::Z, Vec3::X]);
    assert_eq!(primitive.colors.len(), 6);
}

#[test]
fn broken_normals_and_colors_are_repaired() {
    let mut file = File::with_triangle();
    let normals = file.floats("VEC3", &[0.0, 0.0, 5.0, 0.0, 1e-21, 0.0, f32::NAN, 0.0, 1.0]);
    let colors = file.floats("VEC4", &[&[-1.0, 2.0, f32::NAN, 1.0][..], &[0.5; 8]].concat());
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    (attributes["NORMAL"], attributes["COLOR_0"]) = (json!(normals), json!(colors));
    let primitive = file.primitive();
    assert_eq!(primitive.normals, [Vec3::Z; 3]);
    assert_eq!(primitive.colors, [Vec4::new(0.0, 1.0, 0.0, 1.0), Vec4::splat(0.5), Vec4::splat(0.5)]);
}

/// A square of two triangles facing +z, with a normal map if `has_normal_map`. `uv`: of the four corners.
fn square(uv: &[f32; 8], has_normal_map: bool, edit: impl FnOnce(&mut File, &mut Value)) -> File {
    let mut file = File::with_primitive(|file| {
        let positions = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
        let attributes = json!({
            "POSITION": positions, "NORMAL": file.floats("VEC3", &UP[..12]), "TEXCOORD_0": file.floats("VEC2", uv),
        });
        let indices = file.u16_indices(&[0, 1, 2, 0, 2, 3]);
        let mut primitive = json!({ "attributes": attributes, "indices": indices, "material": 0 });
        edit(file, &mut primitive);
        primitive
    });
    file.push("materials", json!({}));
    if has_normal_map {
        let mut png = std::io::Cursor::new(Vec::new());
        image::RgbImage::new(1, 1).write_to(&mut png, image::ImageFormat::Png).expect("a PNG is written");
        let view = file.view(png.get_ref());
        file.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
        file.push("textures", json!({ "source": 0 }));
        file.json["materials"][0]["normalTexture"] = json!({ "index": 0 });
    }
    file
}

/// u along +x, v along -y: an upright image.
const UPRIGHT: [f32; 8] = [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];

/// For an upright image the bitangent cross(+z, +x) * w is +y: w = 1. A mirrored one has the other sign.
#[test]
fn tangents_are_generated_and_vertices_stay_shared() {
    for (uv, sign) in [(UPRIGHT, 1.0), ([1.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0], -1.0)] {
        let primitive = square(&uv, true, |_, _| ()).primitive();
        assert_eq!((primitive.positions.len(), primitive.indices.len(), primitive.tangents.len()), (4, 6, 4));
        for tangent in &primitive.tangents {
            // A few rounding errors of f32.
            assert!(tangent.abs_diff_eq(Vec4::new(sign, 0.0, 0.0, sign), 1e-6), "{tangent}");
        }
    }
    let without_uv = square(&UPRIGHT, true, |_, primitive| {
        primitive["attributes"].as_object_mut().expect("attributes").remove("TEXCOORD_0");
    });
    for tangent in without_uv.primitive().tangents {
        assert!(tangent.truncate().is_normalized() && tangent.z.abs() < 1e-6, "{tangent}");
    }
}

#[test]
fn vertices_with_two_tangents_are_split() {
    // Mirrored about the diagonal from corner 0 to 2: the second triangle's u is along +y.
    let primitive = square(&[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0], true, |_, _| ()).primitive();
    assert_eq!(primitive.positions.len(), 6, "the two on the diagonal, twice");
    assert_eq!(primitive.uv0.len(), 6);
    let tangent = |corner: usize| primitive.tangents[primitive.indices[corner] as usize];
    assert!(tangent(0).abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-6), "{}", tangent(0));
    assert!(tangent(5).abs_diff_eq(Vec4::new(0.0, 1.0, 0.0, -1.0), 1e-6), "{}", tangent(5));
}

#[test]
fn tangents_of_a_file_are_kept_where_they_are_used() {
    let add_tangents = |file: &mut File, primitive: &mut Value| {
        let tangents = [[0.0, 2.0, 0.0, -1.0], [0.0; 4], [0.0, 1.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]].concat();
        primitive["attributes"]["TANGENT"] = json!(file.floats("VEC4", &tangents));
    };
    let tangents = square(&UPRIGHT, true, add_tangents).primitive().tangents;
    assert_eq!(tangents[0], Vec4::new(0.0, 1.0, 0.0, -1.0));
    assert!(tangents[1].truncate().is_normalized(), "mended: {}", tangents[1]);
    assert_eq!(tangents[2], Vec4::new(0.0, 1.0, 0.0, 1.0));
    assert!(square(&UPRIGHT, false, add_tangents).primitive().tangents.is_empty(), "nothing reads them");
}

#[test]
fn both_sets_of_texture_coordinates_are_read() {
    let mut file = File::with_triangle();
    for (name, values) in [("TEXCOORD_0", [0.5; 6]), ("TEXCOORD_1", [f32::INFINITY; 6])] {
        let uv = file.floats("VEC2", &values);
        file.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(uv);
    }
    let primitive = file.primitive();
    assert_eq!((primitive.uv0[2], primitive.uv1[2]), (Vec2::splat(0.5), Vec2::ZERO));
    assert_eq!(primitive.positions.len() * 3, TRIANGLE.len());
}
