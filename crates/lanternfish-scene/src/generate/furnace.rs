//! The white furnace.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::{
    build::Shape,
    surface::{Finish, Workshop},
};
use crate::{Camera, Light, Projection, Scene};

/// Roughnesses of the spheres in a row: 0 to 1.
const STEPS: u32 = 6;
/// Distance between the spheres' centres, m; their radius is 0.5.
const SPACING: f32 = 1.25;

/// Two rows of white spheres under a sky of radiance 1 from everywhere: metals above, dielectrics below, roughness
/// from 0 (left) to 1 (right) in steps of 0.2. A surface that conserves energy is indistinguishable from the sky: a
/// visible difference is the error of shading.
///
/// The directional light is no part of the furnace. It makes the spheres visible in renderers without sky lighting; remove
/// it for the test.
pub(super) fn furnace() -> Scene {
    let mut workshop = Workshop { scene: Scene { name: "furnace".to_owned(), ..Scene::default() } };
    let ball = sphere(0.5, 64, 32);
    for (name, metallic, y) in [("metal", 1.0, 0.5 * SPACING), ("dielectric", 0.0, -0.5 * SPACING)] {
        for step in 0..STEPS {
            let roughness = step as f32 / (STEPS - 1) as f32;
            let surface = workshop.surface(Finish { metallic, ..Finish::new(name, [1.0; 3], roughness) });
            let mesh = workshop.mesh(name, [(surface, ball.clone())]);
            let x = SPACING * (step as f32 - 0.5 * (STEPS - 1) as f32);
            workshop.place_at(mesh, Vec3::new(x, y, 0.0), 0.0);
        }
    }
    let mut scene = workshop.scene;
    scene.sky = Vec3::ONE;
    // π lx give a white diffuse surface that faces the light 1 nit, the radiance of the sky.
    let light = Light::directional(Vec3::new(-0.4, -0.6, -1.0), Vec3::splat(PI));
    scene.lights.push(Light { name: "not of the furnace".to_owned(), ..light });
    let projection = Projection::Perspective { fov_y: 30f32.to_radians(), near: 0.1 };
    let camera = Camera::look_at(Vec3::new(0.0, 0.0, 9.0), Vec3::ZERO, projection);
    scene.cameras.push(Camera { name: "front".to_owned(), ..camera });
    scene
}

/// A sphere about the origin whose normals are exact.
pub(super) fn sphere(radius: f32, columns: u32, rows: u32) -> Shape {
    let mut shape = Shape::new();
    shape.sheet(columns, rows, Vec2::new(TAU * radius, PI * radius), |s, t| {
        let (sin, cos) = (TAU * s).sin_cos();
        let (height, ring) = (PI * (t - 0.5)).sin_cos();
        radius * Vec3::new(ring * cos, height, -ring * sin)
    });
    shape.normals = shape.positions.iter().map(|p| p.normalize()).collect();
    shape
}
