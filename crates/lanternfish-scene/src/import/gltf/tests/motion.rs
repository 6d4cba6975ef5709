//! Tests of skins, morph targets and animations against vertices computed by hand.

use glam::Vec3;
use serde_json::{Value, json};

use super::warnings::warnings;
use super::{F32, File, I16, TRIANGLE, U8, assert_contains, bytes_of};
use crate::{Scene, motion::Interpolation};

fn near(a: Vec3, b: [f32; 3]) -> bool {
    a.abs_diff_eq(b.into(), 1e-4)
}

fn corners(scene: &Scene, instance: usize) -> Vec<Vec3> {
    let instance = &scene.instances[instance];
    let positions = &scene.meshes[instance.mesh].primitives[0].positions;
    positions.iter().map(|p| instance.world_from_object.transform_point3(*p)).collect()
}

/// A triangle with two joints. Its second and third corners follow the second joint, which an animation moves and rotates.
fn skinned() -> File {
    let mut file = File::with_primitive(|file| {
        let bytes: Vec<u8> = vec![0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0];
        // The second corner's weights do not sum to 1: the import normalises them.
        let weights = [1.0, 0.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        json!({ "attributes": {
            "POSITION": file.floats("VEC3", &TRIANGLE),
            "JOINTS_0": file.accessor("VEC4", U8, 3, &bytes),
            "WEIGHTS_0": file.floats("VEC4", &weights),
        } })
    });
    // Column-major: at rest the second joint is 1 m along x from the mesh's origin.
    let mut matrices = [0.0f32; 32];
    for joint in 0..2 {
        (0..4).for_each(|i| matrices[16 * joint + 5 * i] = 1.0);
    }
    matrices[16 + 12] = -1.0;
    let bind = file.accessor("MAT4", F32, 2, &bytes_of(&matrices));
    file.json["nodes"] = json!([
        // The transform of a skinned node is ignored.
        { "mesh": 0, "skin": 0, "translation": [50, 50, 50] },
        { "children": [2], "translation": [0, 0, 2] },
        { "translation": [1, 0, 0] },
    ]);
    file.json["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": bind }]);
    let times = file.floats("SCALAR", &[1.0, 3.0]);
    let up = file.floats("VEC3", &[1.0, 0.0, 0.0, 1.0, 4.0, 0.0]);
    // A rotation by 90° about z, as normalised integers.
    let half = (0.5f32.sqrt() * 32767.0).round() as i16;
    let rotation: Vec<u8> = [0, 0, 0, 32767, 0, 0, half, half].iter().flat_map(|v: &i16| v.to_le_bytes()).collect();
    let rotation = file.accessor("VEC4", I16, 2, &rotation);
    file.json["accessors"][rotation]["normalized"] = json!(true);
    let channel = |sampler: usize, path: &str| json!({ "sampler": sampler, "target": { "node": 2, "path": path } });
    file.json["animations"] = json!([{
        "name": "wave",
        "samplers": [{ "input": times, "output": up }, { "input": times, "output": rotation, "interpolation": "STEP" }],
        "channels": [channel(0, "translation"), channel(1, "rotation")],
    }]);
    file
}

#[test]
fn joints_bend_their_vertices() {
    let mut scene = skinned().load().unwrap();
    let animation = &scene.motion.animations[0];
    assert_eq!((animation.name.as_str(), animation.duration()), ("wave", 3.0));
    assert_eq!(animation.channels[1].sampler.interpolation, Interpolation::Step);
    // At rest: vertices of the first joint are 2 m along z, and the second joint is in its bind pose.
    let actual = corners(&scene, 0);
    assert!(
        near(actual[0], [0.0, 0.0, 2.0]) && near(actual[1], [1.0, 0.0, 2.0]) && near(actual[2], [0.0, 1.0, 2.0]),
        "{actual:?}"
    );
    // Halfway: the second joint is 2 m up. The second corner follows it with weight 3/4.
    scene.pose(0, 2.0);
    let actual = corners(&scene, 0);
    assert!(
        near(actual[0], [0.0, 0.0, 2.0]) && near(actual[1], [1.0, 1.5, 2.0]) && near(actual[2], [0.0, 3.0, 2.0]),
        "{actual:?}"
    );
    // At the end: 4 m up and rotated. The third corner's offset (-1, 1) from the joint rotates to (-1, -1).
    scene.pose(0, 3.0);
    assert!(near(corners(&scene, 0)[2], [0.0, 3.0, 2.0]), "{:?}", corners(&scene, 0));
}

/// A triangle with two morph targets, the second of a single vertex (sparse), at two nodes; one node has its own weights.
fn morphing() -> File {
    let mut file = File::with_primitive(|file| {
        let lift = file.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        let (places, values) = (file.view(&[2]), file.view(&[0, 0, 0, 64, 0, 0, 0, 0, 0, 0, 0, 0]));
        let sparse = json!({
            "count": 1,
            "indices": { "bufferView": places, "componentType": U8 },
            "values": { "bufferView": values },
        });
        let stretch =
            file.push("accessors", json!({ "componentType": F32, "type": "VEC3", "count": 3, "sparse": sparse }));
        let positions = file.floats("VEC3", &TRIANGLE);
        json!({ "attributes": { "POSITION": positions }, "targets": [{ "POSITION": lift }, { "POSITION": stretch }] })
    });
    file.json["meshes"][0]["weights"] = json!([0.5, 0]);
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "weights": [0, 1], "translation": [10, 0, 0] }]);
    let times = file.floats("SCALAR", &[0.0, 1.0]);
    // Each keyframe: in-tangent, value and out-tangent, with two weights each.
    let flat = |value: [f32; 2]| [[0.0; 2], value, [0.0; 2]].concat();
    let weights = file.floats("SCALAR", &[flat([0.0, 0.0]), flat([2.0, 1.0])].concat());
    file.json["animations"] = json!([{
        "samplers": [{ "input": times, "output": weights, "interpolation": "CUBICSPLINE" }],
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "weights" } }],
    }]);
    file
}

#[test]
fn morph_targets_deform_only_the_mesh_of_their_node() {
    let mut scene = morphing().load().unwrap();
    assert_eq!(scene.meshes.len(), 2, "each node has its own");
    let (a, b) = (corners(&scene, 0), corners(&scene, 1));
    assert!(near(a[2], [0.0, 1.0, 0.5]), "the mesh's weights: {a:?}");
    assert!(near(b[0], [10.0, 0.0, 0.0]) && near(b[2], [12.0, 1.0, 0.0]), "the node's weights: {b:?}");
    scene.pose(0, 0.5);
    // Hermite interpolation with zero tangents: the midpoint.
    let (a, b) = (corners(&scene, 0), corners(&scene, 1));
    assert!(near(a[0], [0.0, 0.0, 1.0]) && near(a[2], [1.0, 1.0, 1.0]), "{a:?}");
    assert!(near(b[2], [12.0, 1.0, 0.0]), "{b:?}");
    // Without normals in the file, the normals are those of the deformed triangle.
    let primitive = &scene.meshes[scene.instances[0].mesh].primitives[0];
    let [p, q, r]: [Vec3; 3] = primitive.positions.clone().try_into().unwrap();
    let flat = (q - p).cross(r - p).normalize();
    assert!(primitive.normals.iter().all(|normal| normal.abs_diff_eq(flat, 1e-5)), "{:?}", primitive.normals);
}

/// `KHR_animation_pointer`: a pointer to a node's property is the same channel as the format's own.
#[test]
fn pointers_to_properties_of_nodes_animate_them() {
    for file in [skinned(), morphing()] {
        let mut pointing = skinned();
        (pointing.json, pointing.bin) = (file.json.clone(), file.bin.clone());
        for channel in pointing.json["animations"][0]["channels"].as_array_mut().unwrap() {
            let [node, path] = ["node", "path"].map(|key| channel["target"][key].to_string().replace('"', ""));
            let pointer = json!({ "pointer": format!("/nodes/{node}/{path}") });
            channel["target"] = json!({ "path": "pointer", "extensions": { "KHR_animation_pointer": pointer } });
        }
        let [mut scene, mut expected] = [pointing.scene(), file.scene()];
        let at_rest = corners(&scene, 0);
        for time in [1.6, 2.9] {
            scene.pose(0, time);
            expected.pose(0, time);
            assert_eq!(corners(&scene, 0), corners(&expected, 0));
            assert_ne!(corners(&scene, 0), at_rest);
        }
        pointing.json["animations"][0]["channels"][0]["target"]["extensions"]["KHR_animation_pointer"]["pointer"] =
            json!("/nodes/7/scale");
        assert_contains(&pointing.fault(), "nodes[7]");
    }
}

/// Two nodes with one lamp, which also has an area light at the first, and a sun. `KHR_animation_pointer` animates
/// them.
#[test]
fn pointers_to_properties_of_lights_animate_them() {
    let mut file = File::with_triangle();
    let times = file.floats("SCALAR", &[1.0, 3.0]);
    let color = file.floats("VEC3", &[1.0, 0.0, 0.5, 0.0, 1.0, 0.5]);
    let [fade, grow, sink] = [[0.0, 8.0], [2.0, 6.0], [4.0, -4.0]].map(|values| file.floats("SCALAR", &values));
    let lamp = json!({ "KHR_lights_punctual": { "light": 0 }, "EXT_lights_area": { "light": 0 } });
    file.json["nodes"] = json!([
        { "extensions": lamp },
        { "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "extensions": { "KHR_lights_punctual": { "light": 1 } } },
    ]);
    file.json["extensions"] = json!({
        "EXT_lights_area": { "lights": [{ "type": "disk", "intensity": 5 }] },
        "KHR_lights_punctual": { "lights": [
            { "type": "point", "color": [1, 0.5, 0], "intensity": 0 },
            { "type": "directional", "color": [1, 0.5, 0], "intensity": 2 },
            { "type": "point" },
        ] },
    });
    let channel = |sampler: usize, light: usize, property: &str| {
        let pointer = format!("/extensions/KHR_lights_punctual/lights/{light}/{property}");
        json!({ "sampler": sampler, "target": {
            "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": pointer } },
        } })
    };
    let samplers: Vec<_> = [color, fade, grow, sink].map(|values| json!({ "input": times, "output": values })).into();
    let animation = |channels: Vec<Value>| json!({ "samplers": samplers, "channels": channels });
    file.json["animations"] = json!([
        animation(vec![
            channel(1, 0, "intensity"),
            channel(2, 0, "range"),
            channel(2, 1, "range"),
            channel(0, 2, "color")
        ]),
        animation(vec![channel(1, 0, "intensity"), channel(0, 0, "color"), channel(0, 1, "color")]),
        animation(vec![channel(3, 0, "intensity"), channel(3, 0, "range")]),
    ]);
    let mut scene = file.scene();
    assert_eq!(warnings(&file), Vec::<String>::new());
    let lights = |scene: &Scene| -> Vec<(Vec3, Option<f32>)> {
        scene.validate().unwrap();
        scene.lights.iter().map(|light| (light.intensity, light.range)).collect()
    };
    let (area, sun) = ((Vec3::splat(5.0), None), (Vec3::new(2.0, 1.0, 0.0), None));
    let at_rest = [(Vec3::ZERO, None), area, (Vec3::ZERO, None), sun];
    assert_eq!(lights(&scene), at_rest);
    // Halfway between the keyframes: the lamp's own colour with half of the brightness.
    scene.pose(0, 2.0);
    let lamp = (Vec3::new(4.0, 2.0, 0.0), Some(4.0));
    assert_eq!(lights(&scene), [lamp, area, lamp, sun]);
    scene.pose(1, 2.0);
    let lamp = (Vec3::splat(2.0), None);
    assert_eq!(lights(&scene), [lamp, area, lamp, (Vec3::ONE, None)]);
    // Values that no light can have.
    scene.pose(2, 3.0);
    assert_eq!(lights(&scene)[0], (Vec3::ZERO, Some(f32::MIN_POSITIVE)));
    scene.pose_at_rest();
    assert_eq!(lights(&scene), at_rest);
    file.json["animations"] = json!([animation(vec![channel(0, 9, "color")])]);
    assert_contains(&file.fault(), "animations[0].channels[0]: lights[9]");
}

/// Four triangles with the same transform, two of them static: one static duplicate is left out, and the moving ones still move.
#[test]
fn moving_duplicates_are_kept() {
    let mut file = File::with_triangle();
    let times = file.floats("SCALAR", &[0.0, 1.0]);
    let up = file.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 3.0, 0.0]);
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0 }, { "children": [3] }, { "mesh": 0 }, { "mesh": 0 }]);
    let channel = |node: usize| json!({ "sampler": 0, "target": { "node": node, "path": "translation" } });
    let samplers = json!([{ "input": times, "output": up }]);
    file.json["animations"] = json!([{ "samplers": samplers, "channels": [channel(2), channel(4)] }]);
    let mut scene = file.scene();
    assert_eq!(scene.instances.len(), 3);
    scene.pose(0, 1.0);
    let heights: Vec<f32> = (0..3).map(|instance| corners(&scene, instance)[0].y).collect();
    assert_eq!(heights, [0.0, 3.0, 3.0]);
}

#[test]
fn inconsistent_motion_is_refused_by_name() {
    type Damage = fn(&mut Value);
    let skins: [(&str, Damage); 6] = [
        ("joint 1 of skins[0], which has 1", |json| json["skins"][0]["joints"] = json!([1])),
        ("1 inverse bind matrices, but there are 2 joints", |json| {
            let bind = json["skins"][0]["inverseBindMatrices"].as_u64().unwrap() as usize;
            json["accessors"][bind]["count"] = json!(1);
        }),
        ("6 numbers where 8 are needed", |json| {
            json["animations"][0]["channels"][0]["target"]["path"] = json!("rotation");
        }),
        ("interpolation \"SMOOTH\"", |json| json["animations"][0]["samplers"][0]["interpolation"] = json!("SMOOTH")),
        ("nodes[7]", |json| json["animations"][0]["channels"][0]["target"]["node"] = json!(7)),
        ("skins[3]", |json| json["nodes"][0]["skin"] = json!(3)),
    ];
    for (what, damage) in skins {
        let mut file = skinned();
        damage(&mut file.json);
        let error = file.load().unwrap_err().to_string();
        assert!(error.contains(what), "{what}: {error}");
    }
    // A skin with joints of another scene deforms nothing.
    let mut file = skinned();
    file.json["scene"] = json!(0);
    file.json["scenes"] = json!([{ "nodes": [0] }]);
    let scene = file.load().unwrap();
    assert!(near(corners(&scene, 0)[1], [51.0, 50.0, 50.0]), "{:?}", corners(&scene, 0));
}
