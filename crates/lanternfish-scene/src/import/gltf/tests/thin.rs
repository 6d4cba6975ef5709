//! Tests of points and lines as triangles.

use std::collections::HashSet;

use glam::{Vec3, Vec4};
use serde_json::json;

use super::materials::encode;
use super::samples::asset;
use super::warnings::warnings;
use super::{File, assert_contains, load_within, too_much};
use crate::{Camera, Primitive, Viewpoint, import::load};

/// Five points of a planar zigzag, with a diagonal of √5.
const ZIGZAG: [f32; 15] = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 2.0, 0.0, 0.0];

/// Their radius in a file that has nothing else.
fn radius() -> f32 {
    5.0f32.sqrt() / 1000.0
}

fn zigzag(mode: u32, indices: &[u16]) -> File {
    File::with_primitive(|file| {
        let attributes = json!({ "POSITION": file.floats("VEC3", &ZIGZAG) });
        json!({ "attributes": attributes, "mode": mode, "indices": file.u16_indices(indices) })
    })
}

/// Adds an attribute with an element for each of the five points.
fn with_attribute(mut file: File, name: &str, shape: &str, values: &[f32]) -> File {
    let accessor = file.floats(shape, values);
    file.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
    file
}

/// For each point or segment: its ends, as the means of its first and last three vertices. The shapes must be closed,
/// with their outside in front.
fn shapes(primitive: &Primitive) -> Vec<[Vec3; 2]> {
    let (shapes, rest) = primitive.positions.as_chunks::<6>();
    let (corners, none) = primitive.indices.as_chunks::<24>();
    assert_eq!((rest.len(), none.len(), corners.len()), (0, 0, shapes.len()));
    for (shape, corners) in shapes.iter().zip(corners) {
        let (triangles, _) = corners.as_chunks::<3>();
        let edges: Vec<_> = triangles.iter().flat_map(|[a, b, c]| [(*a, *b), (*b, *c), (*c, *a)]).collect();
        let distinct: HashSet<_> = edges.iter().copied().collect();
        assert!(
            distinct.len() == edges.len() && edges.iter().all(|(a, b)| distinct.contains(&(*b, *a))),
            "{corners:?}"
        );
        let center = shape.iter().sum::<Vec3>() / 6.0;
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| primitive.positions[corner as usize]);
            assert!((b - a).cross(c - a).dot(a - center) > 0.0, "{triangle:?} shows its back");
        }
    }
    let mean = |list: &[Vec3]| list.iter().sum::<Vec3>() / list.len() as f32;
    shapes.iter().map(|shape| [mean(&shape[..3]), mean(&shape[3..])]).collect()
}

/// The segments of a primitive, as pairs of indices into the zigzag.
fn segments(primitive: &Primitive) -> Vec<[usize; 2]> {
    let nearest = |p: &Vec3| ZIGZAG.chunks(3).position(|q| p.abs_diff_eq(Vec3::from_slice(q), 1e-5)).expect("an end");
    shapes(primitive).iter().map(|ends| [nearest(&ends[0]), nearest(&ends[1])]).collect()
}

#[test]
fn points_become_octahedra() {
    let primitive = zigzag(0, &[4, 1]).primitive();
    assert_eq!(shapes(&primitive).len(), 2);
    for (i, p) in primitive.positions.iter().enumerate() {
        let center = [2.0 * Vec3::X, Vec3::Y][i / 6];
        // The diagonal is that of all positions. The tolerance is the rounding of positions up to 2.
        assert!((p.distance(center) - radius()).abs() < 1e-6, "{p}");
        assert!(primitive.normals[i].abs_diff_eq((p - center).normalize(), 1e-3), "{}", primitive.normals[i]);
    }
}

#[test]
fn every_kind_of_lines_becomes_its_segments() {
    let of = |mode, indices: &[u16]| segments(&zigzag(mode, indices).primitive());
    assert_eq!(of(1, &[0, 1, 4, 2, 3]), [[0, 1], [4, 2]], "an end without a segment is dropped");
    assert_eq!(of(2, &[0, 1, 3]), [[0, 1], [1, 3], [3, 0]]);
    assert_eq!(of(2, &[0, 1]), [[0, 1]], "the way back is the same segment");
    assert_eq!(of(3, &[0, 1, 3]), [[0, 1], [1, 3]]);
    assert_eq!(of(3, &[0, 1, 1, 3]), [[0, 1], [1, 3]], "a segment without length is dropped");
    for mode in 0..4 {
        assert!(warnings(&zigzag(mode, &[0, 1])).is_empty(), "nothing is left out");
        assert_eq!(zigzag(mode, &[3]).scene().meshes[0].primitives.is_empty(), mode > 0);
    }
}

#[test]
fn lines_become_prisms_with_normals_away_from_them() {
    let primitive = zigzag(3, &[0, 1, 2, 3, 4]).primitive();
    for (i, [a, b]) in [[0, 1], [1, 2], [2, 3], [3, 4]].into_iter().enumerate() {
        let [a, b] = [a, b].map(|end: usize| Vec3::from_slice(&ZIGZAG[3 * end..]));
        for (k, p) in primitive.positions[6 * i..][..6].iter().enumerate() {
            let offset = p - if k < 3 { a } else { b };
            assert!((offset.length() - radius()).abs() < 1e-6 && offset.dot(b - a).abs() < 1e-6, "{offset}");
            assert!(primitive.normals[6 * i + k].abs_diff_eq(offset.normalize(), 1e-3));
        }
    }
}

#[test]
fn attributes_of_points_and_lines_are_kept() {
    let uv: Vec<f32> = (0..10).map(|i| i as f32).collect();
    let file = with_attribute(zigzag(1, &[3, 1]), "TEXCOORD_0", "VEC2", &uv);
    let file = with_attribute(file, "COLOR_0", "VEC4", &uv.repeat(2).iter().map(|c| c / 10.0).collect::<Vec<_>>());
    let file = with_attribute(file, "NORMAL", "VEC3", &[0.0, 0.0, 2.0].repeat(5));
    let primitive = file.primitive();
    assert_eq!(primitive.normals, [Vec3::Z; 6]);
    for (i, end) in [3, 3, 3, 1, 1, 1].into_iter().enumerate() {
        assert_eq!(primitive.uv0[i].to_array(), uv[2 * end..][..2]);
        assert_eq!(primitive.colors[i], Vec4::from_slice(&uv.repeat(2)[4 * end..]) / 10.0);
    }
}

#[test]
fn points_and_lines_of_all_meshes_have_one_width_in_the_world() {
    let mut file = zigzag(3, &[0, 1]);
    let mut points = file.json["meshes"][0]["primitives"][0].clone();
    points["mode"] = json!(0);
    file.push("meshes", json!({ "primitives": [points] }));
    let box_of_ground = file.floats("VEC3", &[-1e3, 0.0, 0.0, 1e3, 0.0, 0.0, 0.0, 0.0, 1e3]);
    file.push("meshes", json!({ "primitives": [{ "attributes": { "POSITION": box_of_ground } }] }));
    // From 0 to 400 along x, and to 200 along y.
    file.json["nodes"] =
        json!([{ "mesh": 0, "scale": [200, 200, 0] }, { "mesh": 1, "scale": [0.5, 1, 1] }, { "mesh": 2 }]);
    let scene = file.scene();
    let world = 400.0f32.hypot(200.0) / 1000.0;
    for (mesh, scale) in [(0, 200.0), (1, 1.0)] {
        let p = scene.meshes[mesh].primitives[0].positions[0];
        assert!((p.length() * scale / world - 1.0).abs() < 1e-3, "mesh {mesh}: {}", p.length());
    }
}

#[test]
fn points_are_about_two_pixels_wide() {
    let (fov_y, size) = (0.8f32, [1280.0, 720.0]);
    for (extent, scale) in [([1.0, 1.0], 1e-2), ([16.0, 9.0], 1.0), ([1.0, 0.0], 300.0), ([0.0, 1.0], 1.0)] {
        let mut file = zigzag(0, &[0, 1]);
        let position = file.floats("VEC3", &[0.0, 0.0, 0.0, extent[0], extent[1], 0.0]);
        file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(position);
        file.json["nodes"][0]["scale"] = json!(vec![scale; 3]);
        let scene = file.scene();
        let camera = Camera::framing_scene(&scene, Some(Viewpoint::Front), fov_y, size[0] / size[1]);
        let radius = scale * scene.meshes[0].primitives[0].positions[0].length();
        let width = radius / camera.eye().z / (0.5 * fov_y).tan() * size[1];
        assert!((1.0..2.5).contains(&width), "{extent:?}: {width} pixels");
    }
}

#[test]
fn points_without_extent_are_drawn() {
    for indices in [&[1][..], &[1, 1]] {
        let mut file = zigzag(0, indices);
        let position = file.floats("VEC3", &[0.0; 6]);
        file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(position);
        assert_eq!(shapes(&file.primitive()).len(), indices.len());
        file.json["nodes"][0]["scale"] = json!([0, 0, 0]);
        assert_eq!(shapes(&file.primitive()).len(), indices.len());
    }
}

#[test]
fn points_and_lines_follow_morph_targets() {
    let mut file = zigzag(1, &[0, 1]);
    let lift = file.floats("VEC3", &[0.0, 0.0, 3.0].repeat(5));
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": lift }]);
    let at_rest = file.primitive();
    file.json["meshes"][0]["weights"] = json!([1]);
    let lifted = file.primitive();
    assert_eq!(lifted.positions.len(), 6);
    for (p, q) in at_rest.positions.iter().zip(&lifted.positions) {
        assert!((q - p).abs_diff_eq(3.0 * Vec3::Z, 1e-6), "{p} {q}");
    }
}

#[test]
fn faulty_points_and_lines_are_refused() {
    for mode in 0..4 {
        assert_contains(&zigzag(mode, &[0, 5]).fault(), "element 1 is 5, but there are 5 vertices");
        assert_contains(&zigzag(mode, &[0, u16::MAX]).fault(), "would restart");
        let mut positions = ZIGZAG;
        positions[4] = f32::NAN;
        let file = with_attribute(zigzag(mode, &[0, 1]), "POSITION", "VEC3", &positions);
        assert_contains(&file.fault(), "element 1 is not finite");
        // The box about these has no size that a number can hold.
        positions[4] = f32::MAX;
        positions[7] = f32::MIN;
        assert!(with_attribute(zigzag(mode, &[0, 1]), "POSITION", "VEC3", &positions).load().is_ok());
    }
}

/// 100,000 indices of two bytes become 60 MB.
#[test]
fn points_and_lines_are_counted_before_they_are_read() {
    for (mode, count) in [(0, 100_000), (1, 200_000), (2, 100_000), (3, 100_001)] {
        let file = zigzag(mode, &[0, 1, 2, 3, 4].repeat(count / 5 + 1)[..count]);
        let bytes = |primitive: &Primitive| 24 * primitive.positions.len() + 4 * primitive.indices.len();
        let bytes = bytes(&file.primitive()) as u64;
        assert_eq!(bytes, 100_000 * (6 * 24 + 24 * 4));
        too_much(&file.glb(), bytes);
        assert!(load_within(&file.glb(), 4 * bytes).is_ok());
    }
}

#[test]
fn points_and_lines_with_a_normal_map_have_tangents() {
    let mut file = with_attribute(zigzag(0, &[0, 1]), "TEXCOORD_0", "VEC2", &[0.5; 10]);
    let view = file.view(&encode(image::ImageFormat::Png, image::RgbImage::new(1, 1).into()));
    file.push("images", json!({ "bufferView": view }));
    file.push("textures", json!({ "source": 0 }));
    file.push("materials", json!({ "normalTexture": { "index": 0 } }));
    file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let primitive = file.primitive();
    assert_eq!(primitive.tangents.len(), primitive.positions.len());
    assert!(primitive.tangents.iter().all(|tangent| tangent.truncate().is_normalized()));
}

#[test]
fn every_mode_of_the_conformance_suite_is_drawn() {
    let Some(folder) = asset("conformance", "every_mode_of_the_conformance_suite_is_drawn") else { return };
    let load = |name: &str| load(folder.join(name));
    let scene = load("MeshPrimitiveModes/MeshPrimitiveModes.gltf").expect("a scene");
    let triangles: Vec<usize> = scene.meshes.iter().map(|mesh| mesh.primitives[0].indices.len() / 3).collect();
    assert_eq!(triangles, [7 * 8, 6 * 8, 7 * 8, 6 * 8, 6, 4, 6]);
    // Files 4 and 6 are triangles.
    for (number, shape_count) in [(0, 1024), (2, 4), (8, 4), (10, 4)] {
        let scene = load(&format!("asset-generator/Positive/Mesh_PrimitiveMode/Mesh_PrimitiveMode_{number:02}.gltf"));
        let scene = scene.expect("a scene");
        assert_eq!(shapes(&scene.meshes[0].primitives[0]).len(), shape_count, "file {number}");
    }
}
