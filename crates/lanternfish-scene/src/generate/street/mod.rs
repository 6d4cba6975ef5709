//! `demo:street`: a street at night, for scale: about a million placed triangles, several hundred lamps.
//!
//! The street runs along x, 240 m; its asphalt is 9 m wide at y = 0, a pavement of 3.6 m and twenty houses stand on
//! either side. Everything except the ground is an instance of one of a few dozen meshes.

mod facade;
mod furniture;
mod materials;

use std::f32::consts::PI;

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::{
    build::Shape,
    hash::{hash, signed, unit},
    surface::Workshop,
};
use crate::{Camera, Light, Projection, Scene};
use facade::{HOUSE, Modules};
use materials::Materials;

/// Houses on each side.
const HOUSES: u32 = 20;
/// Half the street's length, m.
const HALF: f32 = 0.5 * HOUSE * HOUSES as f32;
/// Half the width of the asphalt, m.
const ROAD: f32 = 4.5;
/// Half the distance between the façades, m.
const FRONT: f32 = 8.1;
/// Height of the pavement over the asphalt, m.
const PAVEMENT: f32 = 0.14;
/// Distance between lamp posts, m.
const LAMPS: f32 = 10.0;
/// Distance between trees, m.
const TREES: f32 = 10.0;
/// Distance between strings of bulbs, m.
const STRINGS: f32 = 15.0;

/// The scene with its lamps: spots of the lamp posts, points before shop windows, beside doors and on strings across
/// the street.
pub(super) fn street() -> Scene {
    let mut workshop = Workshop { scene: Scene { name: "street".to_owned(), ..Scene::default() } };
    let materials = Materials::new(&mut workshop);
    ground(&mut workshop, &materials);
    let modules = Modules::new(&mut workshop, &materials);
    for (side, angle) in [(-1.0, 0.0), (1.0, PI)] {
        for house in 0..HOUSES {
            let x = HOUSE * (house as f32 + 0.5) - HALF;
            let position = Vec3::new(x, PAVEMENT, side * FRONT);
            let world_from_house = Affine3A::from_rotation_translation(Quat::from_rotation_y(angle), position);
            modules.place_house(&mut workshop, 2 * house + u32::from(side > 0.0), world_from_house);
        }
    }
    furnish(&mut workshop, &materials);

    let mut scene = workshop.scene;
    // A cloudy sky over a town.
    scene.sky = Vec3::new(0.006, 0.007, 0.012);
    scene.cameras = vec![
        camera("road", Vec3::new(-66.0, 1.75, 0.6), Vec3::new(0.0, 4.2, -1.6)),
        camera("balcony", Vec3::new(-81.0, 8.6, -6.4), Vec3::new(-30.0, 3.0, 3.0)),
        camera("roofs", Vec3::new(-112.0, 19.5, 7.0), Vec3::new(0.0, 2.0, -1.0)),
    ];
    scene
}

/// A camera for 16:9.
fn camera(name: &str, eye: Vec3, target: Vec3) -> Camera {
    let projection = Projection::Perspective { fov_y: 50f32.to_radians(), near: 0.1 };
    Camera { name: name.to_owned(), ..Camera::look_at(eye, target, projection) }
}

/// Asphalt with puddles and paint, pavements, kerb stones.
fn ground(workshop: &mut Workshop, m: &Materials) {
    let flat = |x: [f32; 2], z: [f32; 2], y: f32, columns: u32| {
        let size = Vec2::new(x[1] - x[0], z[1] - z[0]);
        let mut shape = Shape::new();
        shape.sheet(columns, 4, size, |s, t| Vec3::new(x[0] + size.x * s, y, z[1] - size.y * t));
        shape
    };
    workshop.add("asphalt", m.asphalt, flat([-HALF, HALF], [-ROAD, ROAD], 0.0, 120));
    for side in [-1.0f32, 1.0] {
        let (inner, outer) = (side * (ROAD + 0.3), side * (FRONT + 0.3));
        let z = [inner.min(outer), inner.max(outer)];
        workshop.add("pavement", m.paving, flat([-HALF, HALF], z, PAVEMENT, 120));
    }
    // 4 mm over the asphalt: distinguishable in a depth buffer at 200 m.
    let mut dashes = Shape::new();
    for i in 0..40 {
        let x = 6.0 * i as f32 - HALF + 1.5;
        dashes.polygon(&[[x, 0.06], [x + 3.0, 0.06], [x + 3.0, -0.06], [x, -0.06]].map(|[x, z]| Vec3::new(x, 4e-3, z)));
    }
    workshop.add("road paint", m.paint, dashes);
    let mut puddles = Shape::new();
    for i in 0..60u32 {
        let center = Vec3::new(HALF * signed(&[i, 31]), 4e-3, (ROAD - 1.2) * signed(&[i, 32]));
        if center.z.abs() < 1.4 {
            continue;
        }
        let reach = 0.4 + 0.8 * unit(&[i, 33]);
        let rim: Vec<Vec3> = (0..24u32)
            .map(|k| {
                let (sin, cos) = (std::f32::consts::TAU * k as f32 / 24.0).sin_cos();
                center + reach * (0.85 + 0.15 * signed(&[i, k, 34])) * Vec3::new(1.6 * cos, 0.0, -sin)
            })
            .collect();
        for k in 0..24 {
            puddles.polygon(&[center, rim[k], rim[(k + 1) % 24]]);
        }
    }
    workshop.add("puddles", m.puddle, puddles);
    let mut stone = Shape::new();
    stone.cuboid(Vec3::new(-0.495, -0.1, 0.0), Vec3::new(0.495, PAVEMENT + 0.005, 0.3), 0.02);
    let stone = workshop.mesh("kerb stone", [(m.kerb, stone)]);
    for i in 0..(2.0 * HALF) as u32 {
        let x = i as f32 + 0.5 - HALF;
        workshop.place_at(stone, Vec3::new(x, 0.0, ROAD), 0.0);
        workshop.place_at(stone, Vec3::new(x, 0.0, -ROAD), PI);
    }
}

/// Lamp posts, trees, cars, bollards and strings of bulbs.
fn furnish(workshop: &mut Workshop, m: &Materials) {
    let post = furniture::lamp_post(workshop, m);
    let trees: [usize; 3] = std::array::from_fn(|i| furniture::tree(workshop, m, i as u32));
    let cars: [usize; 4] = std::array::from_fn(|i| furniture::car(workshop, m, i));
    let bollard = furniture::bollard(workshop, m);
    let span = 2.0 * FRONT - 0.2;
    let string = furniture::bulb_string(workshop, m, span);

    let along = |distance: f32, offset: f32| {
        let count = (2.0 * HALF / distance) as u32;
        (0..count).map(move |i| (i, distance * i as f32 + offset - HALF))
    };
    for (side, angle) in [(-1.0f32, 0.0), (1.0, PI)] {
        let on_pavement = |x: f32, from_kerb: f32| Vec3::new(x, PAVEMENT, side * (ROAD + from_kerb));
        let seed = u32::from(side > 0.0);
        for (_, x) in along(LAMPS, if seed == 0 { 2.5 } else { 7.5 }) {
            let foot = on_pavement(x, 0.65);
            workshop.place_at(post, foot, angle);
            workshop.scene.lights.push(furniture::lamp_light(foot, angle));
        }
        for (i, x) in along(TREES, if seed == 0 { 7.5 } else { 2.5 }) {
            let tree = trees[hash(&[i, seed, 41]) as usize % trees.len()];
            workshop.place_at(tree, on_pavement(x, 1.1), 6.0 * unit(&[i, seed, 42]));
        }
        for (i, x) in along(6.0, 3.0) {
            if hash(&[i, seed, 43]).is_multiple_of(3) {
                continue;
            }
            let car = cars[hash(&[i, seed, 44]) as usize % cars.len()];
            let position = Vec3::new(x + 0.4 * signed(&[i, seed, 45]), 0.0, side * (ROAD - 1.05));
            workshop.place_at(car, position, if side > 0.0 { 0.0 } else { PI });
        }
        for (_, x) in along(5.0, 0.1) {
            workshop.place_at(bollard, on_pavement(x, 0.45), 0.0);
        }
    }
    let tints = [Vec3::new(1.0, 0.62, 0.28), Vec3::new(1.0, 0.30, 0.22), Vec3::new(0.35, 0.85, 0.45)];
    for (i, x) in along(STRINGS, 0.5 * STRINGS) {
        let middle = Vec3::new(x, 7.6, 0.0);
        workshop.place_at(string, middle, 0.0);
        for (k, position) in furniture::bulb_places(span).enumerate() {
            let tint = tints[(i as usize + k) % tints.len()];
            // Below the bulb, which would hide a light inside it.
            let light = Light::point(middle + position - Vec3::Y * 0.1, 4.0 * tint);
            workshop.scene.lights.push(Light { name: "bulb".to_owned(), range: Some(8.0), ..light });
        }
    }
}
