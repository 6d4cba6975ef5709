use std::{
    f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2},
    sync::Arc,
};

use glam::{Affine3A, Quat, Vec3, Vec4};

use super::{
    Animation, Bound, BoundLight, Channel, Deformation, DeformedMesh, Influences, Interpolation, MorphTarget, Motion,
    Node, Property, Sampler, Skin, Transform,
};
use crate::{Camera, Instance, Light, Material, Mesh, Primitive, Projection, Scene};

fn sampler(interpolation: Interpolation, times: &[f32], values: &[f32]) -> Sampler {
    Sampler { interpolation, times: times.to_vec(), values: values.to_vec() }
}

#[test]
fn interpolation_follows_the_format() {
    let (times, values) = ([1.0, 2.0, 4.0], [0.0, 10.0, -2.0]);
    let step = sampler(Interpolation::Step, &times, &values);
    let line = sampler(Interpolation::Linear, &times, &values);
    for (time, stepped, straight) in [
        (0.0, 0.0, 0.0),
        (1.0, 0.0, 0.0),
        (1.5, 0.0, 5.0),
        (2.0, 10.0, 10.0),
        (3.0, 10.0, 4.0),
        (4.0, -2.0, -2.0),
        (9.0, -2.0, -2.0),
    ] {
        assert_eq!((step.at(time, false)[0], line.at(time, false)[0]), (stepped, straight), "at {time}");
    }
    // Hermite: with these tangents the curve is t², which linear interpolation does not give.
    let square = |t: f32| [2.0 * t, t * t, 2.0 * t];
    let spline: Vec<f32> = times.iter().flat_map(|t| square(*t)).collect();
    let spline = sampler(Interpolation::CubicSpline, &times, &spline);
    for time in [1.0, 1.25, 1.9, 2.0, 3.1, 4.0] {
        assert!((spline.at(time, false)[0] - time * time).abs() < 1e-5, "at {time}");
    }
    // The shorter arc at constant speed, for any sign of the quaternions.
    let quarter = Quat::from_rotation_z(FRAC_PI_2);
    let values: Vec<f32> = Quat::IDENTITY.to_array().into_iter().chain((-quarter).to_array()).collect();
    let rotation = sampler(Interpolation::Linear, &[0.0, 1.0], &values);
    let actual = Quat::from_slice(&rotation.at(1.0 / 3.0, true));
    assert!(actual.angle_between(Quat::from_rotation_z(FRAC_PI_2 / 3.0)) < 1e-3, "{actual}");
    // A zero quaternion gives the identity.
    for interpolation in [Interpolation::Step, Interpolation::Linear] {
        let still = sampler(interpolation, &[0.0, 1.0], &[0.0; 8]);
        assert_eq!(still.at(0.5, true), [0.0, 0.0, 0.0, 1.0], "{interpolation:?}");
    }
}

fn triangle() -> Primitive {
    Primitive {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        normals: vec![Vec3::Z; 3],
        indices: vec![0, 1, 2],
        ..Primitive::default()
    }
}

/// A triangle on a rotating node, with a camera and a light on its child; and a triangle skinned to two joints, one of them the child.
fn moving() -> Scene {
    let at = |translation| Transform::Parts { translation, rotation: Quat::IDENTITY, scale: Vec3::ONE };
    let node = |parent, rest| Node { parent, rest, ..Node::default() };
    let nodes = vec![
        node(None, at(Vec3::X)),
        node(Some(0), at(Vec3::X)),
        Node { weights: vec![0.0], ..node(None, Transform::Matrix(Affine3A::from_translation(Vec3::Y))) },
    ];
    let quarter = Quat::from_rotation_z(FRAC_PI_2);
    let rotation: Vec<f32> = [Quat::IDENTITY, quarter].into_iter().flat_map(|q| q.to_array()).collect();
    let channel = |node, property, values: &[f32]| Channel {
        node,
        property,
        sampler: Arc::new(sampler(Interpolation::Linear, &[0.0, 2.0], values)),
    };
    let channels = vec![
        channel(0, Property::Rotation, &rotation),
        channel(2, Property::Weights, &[0.0, 1.0]),
        channel(1, Property::Scale, &[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]),
    ];
    let rest = triangle();
    // The second vertex is influenced by both joints, the third by the child alone.
    let deformation = Deformation {
        positions: rest.positions.clone(),
        normals: rest.normals.clone(),
        tangents: Vec::new(),
        influences: vec![Influences {
            joints: vec![[0, 1, 0, 0]; 3],
            weights: vec![Vec4::X, Vec4::new(0.5, 0.5, 0.0, 0.0), Vec4::Y],
        }],
        targets: vec![MorphTarget { positions: vec![Vec3::Z; 3], ..MorphTarget::default() }],
        has_flat_normals: false,
    };
    let bent = Primitive { deformation: Some(Box::new(deformation)), ..rest };
    let instance = |mesh| Instance { name: String::new(), mesh, world_from_object: Affine3A::IDENTITY };
    let lamp = Light::disk(Vec3::ZERO, Vec3::NEG_Z, 0.25, Vec3::ONE);
    let mut scene = Scene {
        meshes: [triangle(), bent].map(|primitive| Mesh { name: String::new(), primitives: vec![primitive] }).into(),
        instances: vec![instance(0), instance(1)],
        materials: vec![Material::default()],
        cameras: vec![Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Projection::Perspective { fov_y: 1.0, near: 0.1 })],
        lights: vec![lamp.clone(), Light::point(Vec3::ONE, Vec3::ONE)],
        motion: Motion {
            nodes,
            skins: vec![Skin { joints: vec![2, 1], joint_from_object: vec![Affine3A::IDENTITY; 2] }],
            animations: vec![Animation { name: "turn".to_owned(), channels }],
            instances: vec![Bound { index: 0, node: 0, node_from_object: Affine3A::from_translation(Vec3::Z) }],
            cameras: vec![Bound { index: 0, node: 1, node_from_object: Affine3A::IDENTITY }],
            lights: vec![BoundLight { index: 0, node: 1, light: lamp }],
            meshes: vec![DeformedMesh { mesh: 1, node: 2, skin: Some(0) }],
            ..Motion::default()
        },
        ..Scene::default()
    };
    scene.pose_at_rest();
    assert_eq!(scene.validate(), Ok(()));
    scene
}

fn near(a: Vec3, b: Vec3) -> bool {
    a.abs_diff_eq(b, 1e-5)
}

#[test]
fn objects_attached_to_a_node_move_with_it() {
    let mut scene = moving();
    assert!(near(scene.instances[0].world_from_object.translation.into(), Vec3::new(1.0, 0.0, 1.0)));
    assert!(near(scene.cameras[0].eye(), 2.0 * Vec3::X));
    assert_eq!(scene.motion.animations[0].duration(), 2.0);
    // Halfway: a rotation of 45°, a scale of 2, a weight of 0.5.
    scene.pose(0, 1.0);
    assert_eq!(scene.validate(), Ok(()));
    let child = Vec3::new(1.0 + FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
    let rotated = scene.instances[0].world_from_object.transform_vector3(Vec3::X);
    assert!(near(rotated, Vec3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0)), "{rotated}");
    assert!(near(scene.cameras[0].eye(), child), "{}", scene.cameras[0].eye());
    assert!(near(scene.lights[0].position, child));
    let mut upright = scene.clone();
    upright.motion.world_from_roots = Affine3A::from_rotation_x(-FRAC_PI_2);
    upright.pose(0, 1.0);
    assert!(near(upright.cameras[0].eye(), Vec3::new(child.x, child.z, -child.y)));
    // Areas scale with their node.
    let area = Light::disk(Vec3::ZERO, Vec3::Z, 0.5, Vec3::ONE).area().unwrap();
    assert!((scene.lights[0].area().unwrap() / area - 1.0).abs() < 1e-5);
    assert_eq!(scene.lights[1], Light::point(Vec3::ONE, Vec3::ONE), "a light without a node is unchanged");
    // Vertices: first the morph target, 0.5 m along z; then the joints.
    let child_from = |p: Vec3| child + Quat::from_rotation_z(FRAC_PI_2 / 2.0) * (2.0 * p);
    let up = 0.5 * Vec3::Z;
    let [a, b, c]: [Vec3; 3] = scene.meshes[1].primitives[0].positions.clone().try_into().unwrap();
    assert!(near(a, Vec3::Y + up), "{a}");
    assert!(near(b, 0.5 * (Vec3::Y + Vec3::X + up + child_from(Vec3::X + up))), "{b}");
    assert!(near(c, child_from(Vec3::Y + up)), "{c}");
    assert!(scene.meshes[1].primitives[0].normals.iter().all(|normal| near(*normal, Vec3::Z)));
    // The animation loops; and the pose at rest.
    let before = scene.meshes[1].primitives[0].positions.clone();
    scene.pose(0, 3.0);
    assert_eq!(scene.meshes[1].primitives[0].positions, before);
    scene.pose_at_rest();
    let rest = moving();
    assert_eq!(scene.meshes[1].primitives[0].positions, rest.meshes[1].primitives[0].positions);
    assert_eq!(scene.lights, rest.lights);
}

#[test]
fn normals_follow_the_deformation() {
    // A rotated and stretched plane: both transformed and recomputed normals equal the triangle's normal.
    let transform = Affine3A::from_rotation_x(0.7) * Affine3A::from_scale(Vec3::new(1.0, 5.0, 0.5));
    let rest = triangle();
    for has_flat_normals in [false, true] {
        let deformation = Deformation {
            positions: rest.positions.clone(),
            normals: rest.normals.clone(),
            tangents: vec![Vec4::new(0.0, 1.0, 0.0, -1.0); 3],
            influences: vec![Influences { joints: vec![[0; 4]; 3], weights: vec![Vec4::X; 3] }],
            targets: Vec::new(),
            has_flat_normals,
        };
        let mut bent = rest.clone();
        deformation.apply(&mut bent, &[], &[transform]);
        let [a, b, c] = [0, 1, 2].map(|i| bent.positions[i]);
        let expected = (b - a).cross(c - a).normalize();
        assert!(bent.normals.iter().all(|normal| near(*normal, expected)), "{:?}", bent.normals);
        let along = (c - a).normalize();
        assert!(bent.tangents.iter().all(|t| near(t.truncate(), along) && t.w == -1.0), "{:?}", bent.tangents);
    }
}

#[test]
fn missing_references_are_named() {
    type Damage = fn(&mut Motion);
    let damages: [(&str, Damage); 9] = [
        ("parent", |m| m.nodes[0].parent = Some(1)),
        ("skin 0", |m| m.skins[0].joints[0] = 9),
        ("skin 0", |m| m.skins[0].joint_from_object.truncate(1)),
        ("instance 0", |m| m.instances[0].node = 9),
        ("camera 7", |m| m.cameras[0].index = 7),
        ("light 0", |m| m.lights[0].node = 3),
        ("deformed mesh 4", |m| m.meshes[0].mesh = 4),
        ("animation 0", |m| m.animations[0].channels[0].node = 3),
        ("animation 0", |m| Arc::make_mut(&mut m.animations[0].channels[0].sampler).values.truncate(5)),
    ];
    for (name, damage) in damages {
        let mut scene = moving();
        damage(&mut scene.motion);
        let fault = scene.validate().expect_err(name).to_string();
        assert!(fault.contains(name), "{name}: {fault}");
    }
    let mut scene = moving();
    let deformation = scene.meshes[1].primitives[0].deformation.as_mut().unwrap();
    deformation.influences[0].joints[1] = [0, 2, 0, 0];
    assert!(scene.validate().unwrap_err().to_string().contains("mesh 1"), "a joint that the skin lacks");
}
