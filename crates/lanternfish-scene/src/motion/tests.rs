use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

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
fn values_between_keyframes_are_the_formats() {
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
    // Hermite: with these tangents the curve is t², which lines do not meet.
    let square = |t: f32| [2.0 * t, t * t, 2.0 * t];
    let spline: Vec<f32> = times.iter().flat_map(|t| square(*t)).collect();
    let spline = sampler(Interpolation::CubicSpline, &times, &spline);
    for time in [1.0, 1.25, 1.9, 2.0, 3.1, 4.0] {
        assert!((spline.at(time, false)[0] - time * time).abs() < 1e-5, "at {time}");
    }
    // The shorter arc, at a constant speed, whatever sign the quaternions have.
    let quarter = Quat::from_rotation_z(FRAC_PI_2);
    let values: Vec<f32> = Quat::IDENTITY.to_array().into_iter().chain((-quarter).to_array()).collect();
    let turn = sampler(Interpolation::Linear, &[0.0, 1.0], &values);
    let found = Quat::from_slice(&turn.at(1.0 / 3.0, true));
    assert!(found.angle_between(Quat::from_rotation_z(FRAC_PI_2 / 3.0)) < 1e-3, "{found}");
    // A quaternion without direction is none.
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

/// A triangle on a turning node, with a camera and a light on its child; and a triangle of two joints, of which one is that child.
fn moving() -> Scene {
    let at = |translation| Transform::Parts { translation, rotation: Quat::IDENTITY, scale: Vec3::ONE };
    let node = |parent, rest| Node { parent, rest, ..Node::default() };
    let nodes = vec![
        node(None, at(Vec3::X)),
        node(Some(0), at(Vec3::X)),
        Node { weights: vec![0.0], ..node(None, Transform::Matrix(Affine3A::from_translation(Vec3::Y))) },
    ];
    let quarter = Quat::from_rotation_z(FRAC_PI_2);
    let turn: Vec<f32> = [Quat::IDENTITY, quarter].into_iter().flat_map(|q| q.to_array()).collect();
    let channel = |node, property, values: &[f32]| Channel {
        node,
        property,
        sampler: sampler(Interpolation::Linear, &[0.0, 2.0], values),
    };
    let channels = vec![
        channel(0, Property::Rotation, &turn),
        channel(2, Property::Weights, &[0.0, 1.0]),
        channel(1, Property::Scale, &[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]),
    ];
    let rest = triangle();
    // The second vertex goes with both joints, the third with the child alone.
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
fn all_that_hangs_on_a_node_goes_with_it() {
    let mut scene = moving();
    assert!(near(scene.instances[0].world_from_object.translation.into(), Vec3::new(1.0, 0.0, 1.0)));
    assert!(near(scene.cameras[0].eye(), 2.0 * Vec3::X));
    assert_eq!(scene.motion.animations[0].duration(), 2.0);
    // Halfway: an eighth of a turn, a scale of 2, a weight of a half.
    scene.pose(0, 1.0);
    assert_eq!(scene.validate(), Ok(()));
    let child = Vec3::new(1.0 + FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
    let turned = scene.instances[0].world_from_object.transform_vector3(Vec3::X);
    assert!(near(turned, Vec3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0)), "{turned}");
    assert!(near(scene.cameras[0].eye(), child), "{}", scene.cameras[0].eye());
    assert!(near(scene.lights[0].position, child));
    // Areas grow with their node.
    assert!(
        (scene.lights[0].area().unwrap() / Light::disk(Vec3::ZERO, Vec3::Z, 0.5, Vec3::ONE).area().unwrap() - 1.0)
            .abs()
            < 1e-5
    );
    assert_eq!(scene.lights[1], Light::point(Vec3::ONE, Vec3::ONE), "what goes with no node stays");
    // Vertices: the morph target first, half a metre along z; then the joints.
    let child_from = |p: Vec3| child + Quat::from_rotation_z(FRAC_PI_2 / 2.0) * (2.0 * p);
    let up = 0.5 * Vec3::Z;
    let [a, b, c]: [Vec3; 3] = scene.meshes[1].primitives[0].positions.clone().try_into().unwrap();
    assert!(near(a, Vec3::Y + up), "{a}");
    assert!(near(b, 0.5 * (Vec3::Y + Vec3::X + up + child_from(Vec3::X + up))), "{b}");
    assert!(near(c, child_from(Vec3::Y + up)), "{c}");
    assert!(scene.meshes[1].primitives[0].normals.iter().all(|normal| near(*normal, Vec3::Z)));
    // After its end it starts again; and back to where the file puts it.
    let before = scene.meshes[1].primitives[0].positions.clone();
    scene.pose(0, 3.0);
    assert_eq!(scene.meshes[1].primitives[0].positions, before);
    scene.pose_at_rest();
    let rest = moving();
    assert_eq!(scene.meshes[1].primitives[0].positions, rest.meshes[1].primitives[0].positions);
    assert_eq!(scene.lights, rest.lights);
}

#[test]
fn normals_follow_what_bends_them() {
    // A plane that is turned and stretched: its normal is that of its triangle, and a flat one is found again.
    let turn = Affine3A::from_rotation_x(0.7) * Affine3A::from_scale(Vec3::new(1.0, 5.0, 0.5));
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
        deformation.apply(&mut bent, &[], &[turn]);
        let [a, b, c] = [0, 1, 2].map(|i| bent.positions[i]);
        let expected = (b - a).cross(c - a).normalize();
        assert!(bent.normals.iter().all(|normal| near(*normal, expected)), "{:?}", bent.normals);
        let along = (c - a).normalize();
        assert!(bent.tangents.iter().all(|t| near(t.truncate(), along) && t.w == -1.0), "{:?}", bent.tangents);
    }
}

#[test]
fn what_is_missing_is_named() {
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
        ("animation 0", |m| m.animations[0].channels[0].sampler.values.truncate(5)),
    ];
    for (name, damage) in damages {
        let mut scene = moving();
        damage(&mut scene.motion);
        let fault = scene.validate().expect_err(name);
        assert!(fault.contains(name), "{name}: {fault}");
    }
    let mut scene = moving();
    let deformation = scene.meshes[1].primitives[0].deformation.as_mut().unwrap();
    deformation.influences[0].joints[1] = [0, 2, 0, 0];
    assert!(scene.validate().unwrap_err().contains("mesh 1"), "a joint that the skin lacks");
}
