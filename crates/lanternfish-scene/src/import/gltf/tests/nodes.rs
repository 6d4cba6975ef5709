//! Tests of the node tree and the objects at its nodes.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, FRAC_PI_8};

use glam::{Affine3A, Quat, Vec3};
use serde_json::{Value, json};

use super::warnings::warnings;
use super::{File, assert_contains};
use crate::{LightKind, Projection};

/// A rotation by 90° about +y: -z becomes -x.
const QUARTER_TURN_Y: [f32; 4] = [0.0, std::f32::consts::FRAC_1_SQRT_2, 0.0, std::f32::consts::FRAC_1_SQRT_2];

fn nodes(nodes: Value) -> File {
    let mut file = File::with_triangle();
    file.json["nodes"] = nodes;
    file
}

#[test]
fn transforms_are_chained_and_meshes_shared() {
    let scene = nodes(json!([
        { "translation": [1, 0, 0], "rotation": QUARTER_TURN_Y, "scale": [2, 2, 2], "children": [1, 2] },
        { "name": "a", "mesh": 0, "translation": [0, 0, -1] },
        { "name": "b", "mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 3, 0, 1] },
    ]))
    .scene();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
    assert_eq!(scene.triangle_counts(), (1, 2));
    let names: Vec<_> = scene.instances.iter().map(|instance| instance.name.as_str()).collect();
    assert_eq!(names, ["a", "b"]);
    let [a, b] = [0, 1].map(|i| scene.instances[i].world_from_object);
    let mirrored = nodes(json!([{ "mesh": 0, "scale": [-1, 1, 1] }])).scene();
    assert_eq!(mirrored.instances[0].world_from_object, Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)));
    // Two units along the rotated -z, from x = 1.
    assert!(a.transform_point3(Vec3::ZERO).abs_diff_eq(Vec3::new(-1.0, 0.0, 0.0), 1e-6), "{a:?}");
    assert!(b.transform_point3(Vec3::X).abs_diff_eq(Vec3::new(1.0, 6.0, -2.0), 1e-6), "{b:?}");
}

#[test]
fn the_default_scene_is_shown_else_the_first_else_all() {
    let mut file = nodes(json!([{ "name": "a", "mesh": 0 }, { "name": "b", "mesh": 0, "scale": [2, 1, 1] }]));
    let names = |file: &File| file.scene().instances.into_iter().map(|i| i.name).collect::<String>();
    assert_eq!(names(&file), "ab");
    file.json["scenes"] = json!([{ "nodes": [1] }, { "nodes": [0] }]);
    assert_eq!(names(&file), "b");
    file.json["scene"] = json!(1);
    assert_eq!(names(&file), "a");
    file.json["scene"] = json!(2);
    assert_contains(&file.fault(), "scenes[2]");
}

#[test]
fn a_deep_tree_needs_no_deep_stack() {
    let depth = 100_000;
    let mut chain: Vec<_> = (1..depth).map(|child| json!({ "children": [child] })).collect();
    chain.push(json!({ "mesh": 0 }));
    assert_eq!(nodes(Value::Array(chain)).scene().instances.len(), 1);
}

/// One translated, rotated and scaled node with this light.
fn light(light: Value) -> File {
    let mut file = nodes(json!([{
        "translation": [1, 2, 3], "rotation": QUARTER_TURN_Y, "scale": [2, 3, 4],
        "extensions": { "KHR_lights_punctual": { "light": 0 } },
    }]));
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
    file
}

#[test]
fn lights_are_placed() {
    let scene =
        light(json!({ "type": "point", "name": "lamp", "color": [1, 0.5, 0], "intensity": 8, "range": 5 })).scene();
    let [lamp] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    assert_eq!((lamp.kind, lamp.name.as_str()), (LightKind::Point, "lamp"));
    assert_eq!(lamp.intensity, Vec3::new(8.0, 4.0, 0.0));
    assert_eq!((lamp.position, lamp.range), (Vec3::new(1.0, 2.0, 3.0), Some(5.0)));

    let scene = light(json!({ "type": "directional" })).scene();
    assert_eq!((scene.lights[0].kind, scene.lights[0].intensity), (LightKind::Directional, Vec3::ONE));
    assert!(scene.lights[0].direction.abs_diff_eq(Vec3::NEG_X, 1e-6), "{}", scene.lights[0].direction);
    assert_eq!(scene.lights[0].range, None);
}

#[test]
fn spot_lights_have_a_cone_with_a_soft_edge() {
    let kind = |spot: Value| light(json!({ "type": "spot", "spot": spot })).scene().lights[0].kind;
    assert_eq!(kind(json!({})), LightKind::Spot { inner_angle: 0.0, outer_angle: FRAC_PI_4 });
    let given = json!({ "innerConeAngle": FRAC_PI_8, "outerConeAngle": FRAC_PI_2 + 1e-5 });
    assert_eq!(kind(given), LightKind::Spot { inner_angle: FRAC_PI_8, outer_angle: FRAC_PI_2 });
    let hard = kind(json!({ "innerConeAngle": 0.5, "outerConeAngle": 0.5 }));
    let LightKind::Spot { inner_angle, outer_angle } = hard else { panic!("{hard:?}") };
    assert!(inner_angle < outer_angle && outer_angle == 0.5);
}

/// One translated, rotated and scaled node with this area light.
fn area_light(scale: [f32; 3], light: Value) -> File {
    let mut file = nodes(json!([{
        "name": "panel", "translation": [1, 2, 3], "rotation": QUARTER_TURN_Y, "scale": scale,
        "extensions": { "EXT_lights_area": { "light": 0 } },
    }]));
    file.json["extensionsRequired"] = json!(["EXT_lights_area"]);
    file.json["extensions"] = json!({ "EXT_lights_area": { "lights": [light] } });
    file
}

#[test]
fn area_lights_are_placed_and_scaled_by_the_largest_axis() {
    let one = |light| area_light([2.0, -3.0, 1.0], light).scene().lights.remove(0);
    let disk = one(json!({ "type": "disk", "color": [1, 0.5, 0], "intensity": 8, "size": 0.5 }));
    assert_eq!((disk.kind, disk.name.as_str()), (LightKind::Disk { radius: 0.75 }, "panel"));
    assert_eq!((disk.position, disk.intensity), (Vec3::new(1.0, 2.0, 3.0), Vec3::new(8.0, 4.0, 0.0)));
    assert!(disk.direction.abs_diff_eq(Vec3::NEG_X, 1e-6) && disk.range.is_none(), "{disk:?}");

    let panel = one(json!({ "type": "rect", "size": 2, "rect": { "aspect": 0.25 } }));
    let LightKind::Rectangle { half_width, half_height, right } = panel.kind else { panic!("{panel:?}") };
    assert_eq!((half_width, half_height, panel.intensity), (0.75, 3.0, Vec3::splat(1000.0)));
    // The node's x axis: rotated about +y, +x becomes -z.
    assert!(right.abs_diff_eq(Vec3::NEG_Z, 1e-6) && panel.direction.abs_diff_eq(Vec3::NEG_X, 1e-6), "{panel:?}");

    // Defaults: 1 m, square.
    let square = one(json!({ "type": "rect" }));
    let LightKind::Rectangle { half_width, half_height, .. } = square.kind else { panic!("{square:?}") };
    assert_eq!((half_width, half_height), (1.5, 1.5));
}

#[test]
fn semantic_classes_are_inherited_and_other_extras_ignored() {
    let scene = nodes(json!([
        { "children": [1, 2, 3], "extras": { "semantic": 7, "other": [{}] } },
        { "name": "a", "mesh": 0, "translation": [1, 0, 0] },
        { "name": "b", "mesh": 0, "translation": [2, 0, 0], "extras": { "semantic": 0 } },
        { "name": "c", "mesh": 0, "translation": [3, 0, 0], "extras": [1, "text"] },
        { "name": "d", "mesh": 0, "extras": { "semantic": "chair" } },
        { "name": "copy of d", "mesh": 0, "extras": { "semantic": 4 } },
        { "name": "e", "mesh": 0, "translation": [4, 0, 0], "extras": { "semantic": 4294967295_u32 } },
    ]))
    .scene();
    assert_eq!((scene.semantics, scene.instances.len()), (vec![7, 0, 7, 0, u32::MAX], 5));
}

#[test]
fn hidden_nodes_and_their_descendants_are_not_drawn() {
    let hidden = json!({ "KHR_node_visibility": { "visible": false } });
    let lamp = |visibility: Value| {
        json!({
            "KHR_node_visibility": visibility, "KHR_lights_punctual": { "light": 0 }, "EXT_lights_area": { "light": 0 },
        })
    };
    let mut file = nodes(json!([
        { "name": "a", "mesh": 0, "extensions": lamp(json!({ "visible": true })) },
        { "name": "b", "mesh": 1, "extensions": hidden, "children": [2] },
        { "name": "c", "mesh": 0, "scale": [2, 1, 1], "extensions": lamp(json!({})), "children": [3], "camera": 0 },
        { "name": "d", "mesh": 1, "extensions": { "KHR_node_visibility": { "visible": true } } },
    ]));
    // Only hidden nodes use this mesh, which cannot be read.
    file.push("meshes", json!({ "primitives": [{ "attributes": { "POSITION": 99 } }] }));
    file.push("cameras", json!({ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1 } }));
    file.json["extensionsRequired"] = json!(["KHR_node_visibility"]);
    file.json["extensions"] = json!({
        "KHR_lights_punctual": { "lights": [{ "type": "point" }] },
        "EXT_lights_area": { "lights": [{ "type": "disk" }] },
    });
    let scene = file.scene();
    assert_eq!((scene.meshes.len(), scene.instances.len(), scene.lights.len()), (1, 1, 2));
    assert_eq!((scene.instances[0].name.as_str(), scene.lights[0].name.as_str()), ("a", "a"));
    assert_eq!((scene.cameras.len(), warnings(&file)), (1, Vec::new()));
    file.json["nodes"][3]["mesh"] = json!(7);
    assert_contains(&file.fault(), "nodes[3]: meshes[7]");
}

fn camera(camera: Value) -> File {
    let mut file = nodes(json!([{
        "name": "eye", "camera": 0, "translation": [1, 2, 3], "rotation": QUARTER_TURN_Y, "scale": [-2, 3, 4],
    }]));
    file.push("cameras", camera);
    file
}

#[test]
fn cameras_are_placed_without_scale() {
    for zfar in [json!(null), json!(100)] {
        let view = json!({ "yfov": 0.8, "znear": 0.1, "zfar": zfar });
        let scene = camera(json!({ "type": "perspective", "perspective": view })).scene();
        assert_eq!(scene.cameras[0].projection, Projection::Perspective { fov_y: 0.8, near: 0.1 });
        assert_eq!(scene.cameras[0].name, "eye");
        let rotation = Quat::from_array(QUARTER_TURN_Y);
        let expected = Affine3A::from_rotation_translation(rotation, Vec3::new(1.0, 2.0, 3.0));
        let world_from_camera = scene.cameras[0].world_from_camera;
        assert!(world_from_camera.abs_diff_eq(expected, 1e-6), "{world_from_camera:?}");
    }
    let view = json!({ "xmag": 4, "ymag": 3, "znear": 0, "zfar": 10 });
    let scene = camera(json!({ "type": "orthographic", "orthographic": view })).scene();
    let expected = Projection::Orthographic { half_height: 3.0, near: 0.0, far: 10.0 };
    assert_eq!(scene.cameras[0].projection, expected);
}

#[test]
fn faults_of_nodes_and_their_objects_are_named() {
    let roots = |roots: Value| {
        let mut file = nodes(json!([{ "children": [1] }, {}]));
        file.json["scenes"] = json!([{ "nodes": roots }]);
        file
    };
    let primitive = |primitive: Value| {
        let mut file = File::with_triangle();
        file.json["meshes"][0]["primitives"][0] = primitive;
        file
    };
    let area = |light: Value| area_light([1.0; 3], light);
    let mut other_area = area(json!({ "type": "disk" }));
    other_area.json["nodes"][0]["extensions"]["EXT_lights_area"]["light"] = json!(1);
    for (file, fault) in [
        // Graphs that are not trees.
        (nodes(json!([{ "children": [0] }])), "cycle"),
        (nodes(json!([{}, { "children": [2] }, { "children": [1] }])), "nodes[1]: within a cycle"),
        (nodes(json!([{ "children": [2] }, { "children": [2] }, {}])), "another parent"),
        (nodes(json!([{ "children": [1, 1] }, {}])), "another parent"),
        (nodes(json!([{ "children": [1] }])), "nodes[1]"),
        (roots(json!([1])), "and a child"),
        (roots(json!([0, 0])), "twice"),
        (roots(json!([5])), "nodes[5]"),
        (nodes(json!([{ "translation": [1e39, 0, 0] }])), "nodes[0]: its transform"),
        // References out of range.
        (nodes(json!([{ "mesh": 1 }])), "nodes[0]: meshes[1]"),
        (nodes(json!([{ "camera": 1 }])), "nodes[0]: cameras[1]"),
        (nodes(json!([{ "extensions": { "KHR_lights_punctual": { "light": 0 } } }])), "nodes[0]: lights[0]"),
        (other_area, "nodes[0]: EXT_lights_area: lights[1]"),
        (primitive(json!({ "attributes": { "POSITION": 0 }, "material": 4 })), "meshes[0].primitives[0]: materials[4]"),
        (primitive(json!({ "attributes": { "POSITION": 9 } })), "POSITION: accessors[9]"),
        (light(json!({ "type": "spot" })), "without `spot`"),
        (light(json!({ "type": "spot", "spot": { "outerConeAngle": 2 } })), "cone angles"),
        (light(json!({ "type": "point", "intensity": -1 })), "intensity"),
        (light(json!({ "type": "point", "range": 0 })), "range"),
        (area(json!({ "type": "rect", "size": 0 })), "lights[0]: size 0"),
        (area(json!({ "type": "rect", "rect": { "aspect": -1 } })), "aspect -1"),
        (area(json!({ "type": "disk", "intensity": -1 })), "intensity"),
        // Cameras with empty frusta.
        (camera(json!({ "perspective": { "yfov": 0, "znear": 1 } })), "cameras[0]: yfov 0"),
        (camera(json!({ "perspective": { "yfov": 1, "znear": 0 } })), "znear 0"),
        (camera(json!({ "orthographic": { "xmag": 1, "ymag": 1, "znear": 2, "zfar": 2 } })), "enclose nothing"),
        (camera(json!({})), "not one of"),
    ] {
        assert_contains(&file.fault(), fault);
    }
    // Unknown kinds, and areas without an area, are left out.
    for file in [
        light(json!({ "type": "area" })),
        area(json!({ "type": "sphere" })),
        area_light([0.0; 3], json!({ "type": "disk" })),
    ] {
        assert!(file.scene().lights.is_empty());
    }
}
