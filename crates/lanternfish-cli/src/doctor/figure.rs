//! A skinned figure: a column of three joints that bends over a floor.

use std::f32::consts::{FRAC_PI_4, TAU};

use glam::{Affine3A, Quat, Vec3, Vec4};
use lanternfish_scene::{
    Camera, Light, Material, Primitive, Projection, Scene,
    motion::{
        Animation, Channel, Deformation, DeformedMesh, Influences, Interpolation, Motion, Node, Property, Sampler,
        Skin, Transform,
    },
};

use super::scenes::{place, rectangle};

const JOINTS: usize = 3;
/// Rings of vertices along the column, and vertices per ring.
const RINGS: u32 = 13;
const SIDES: u32 = 16;
/// Height and radius of the column, m.
const HEIGHT: f32 = 1.2;
const RADIUS: f32 = 0.18;

pub fn scene() -> Scene {
    let matte = |color: [f32; 3]| Material {
        base_color: Vec3::from(color).extend(1.0),
        metallic: 0.0,
        double_sided: true,
        ..Material::default()
    };
    let mut scene = Scene {
        name: "figure".to_owned(),
        materials: vec![matte([0.7, 0.7, 0.7]), matte([0.8, 0.4, 0.2])],
        ..Scene::default()
    };
    place(&mut scene, rectangle(0, Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::NEG_Z));
    place(&mut scene, column());
    let length = HEIGHT / JOINTS as f32;
    let node = |i: usize| Node {
        parent: i.checked_sub(1),
        rest: Transform::Parts {
            translation: if i == 0 { Vec3::ZERO } else { length * Vec3::Y },
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
        },
        ..Node::default()
    };
    let bend = |node: usize| {
        let values = [Quat::IDENTITY, Quat::from_rotation_z(-0.5)].map(|rotation| rotation.to_array()).concat();
        let sampler = Sampler { interpolation: Interpolation::Linear, times: vec![0.0, 1.0], values };
        Channel { node, property: Property::Rotation, sampler: sampler.into() }
    };
    scene.motion = Motion {
        nodes: (0..JOINTS).map(node).collect(),
        skins: vec![Skin {
            joints: (0..JOINTS).collect(),
            joint_from_object: (0..JOINTS).map(|i| Affine3A::from_translation(-length * i as f32 * Vec3::Y)).collect(),
        }],
        animations: vec![Animation { name: "bend".to_owned(), channels: (1..JOINTS).map(bend).collect() }],
        meshes: vec![DeformedMesh { mesh: 1, node: 0, skin: Some(0) }],
        ..Motion::default()
    };
    scene.lights = vec![
        Light::point(Vec3::new(-0.8, 2.2, 1.0), Vec3::new(8.0, 7.0, 6.0)),
        Light::directional(Vec3::new(-0.4, -1.0, -0.5), Vec3::splat(0.8)),
    ];
    let projection = Projection::Perspective { fov_y: FRAC_PI_4, near: 0.05 };
    scene.cameras.push(Camera::look_at(Vec3::new(0.4, 1.2, 2.9), Vec3::new(0.2, 0.5, 0.0), projection));
    scene.pose_at_rest();
    scene
}

/// A closed column; the two nearest joints weight each vertex.
fn column() -> Primitive {
    let (mut positions, mut normals, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    let (mut joints, mut weights) = (Vec::new(), Vec::new());
    for ring in 0..RINGS {
        let fraction = ring as f32 / (RINGS - 1) as f32;
        let along = fraction * JOINTS as f32 - 0.5;
        let first = (along.floor().max(0.0) as usize).min(JOINTS - 2);
        let second = (along - first as f32).clamp(0.0, 1.0);
        for side in 0..SIDES {
            let (sin, cos) = (TAU * side as f32 / SIDES as f32).sin_cos();
            positions.push(Vec3::new(RADIUS * cos, fraction * HEIGHT, RADIUS * sin));
            normals.push(Vec3::new(cos, 0.0, sin));
            joints.push([first as u16, first as u16 + 1, 0, 0]);
            weights.push(Vec4::new(1.0 - second, second, 0.0, 0.0));
        }
    }
    for ring in 0..RINGS - 1 {
        for side in 0..SIDES {
            let at = |ring: u32, side: u32| ring * SIDES + side % SIDES;
            let [a, b, c, d] = [at(ring, side), at(ring + 1, side), at(ring + 1, side + 1), at(ring, side + 1)];
            indices.extend([a, b, c, a, c, d]);
        }
    }
    let primitive = Primitive { material: 1, positions, normals, indices, ..Primitive::default() };
    let deformation = Deformation {
        positions: primitive.positions.clone(),
        normals: primitive.normals.clone(),
        influences: vec![Influences { joints, weights }],
        ..Deformation::default()
    };
    Primitive { deformation: Some(Box::new(deformation)), ..primitive }
}
