//! `demo:atrium`: a court with a two-storey arcade, stairs, a fountain, cloth and lanterns.
//!
//! The court is open to the sky; its columns stand on a rectangle of 18 × 9 m, in bays of 3 m, and a walk of one bay
//! runs around it on both storeys. x is the long axis; the stairs rise towards −x.

mod arcade;
mod court;
mod decor;
mod materials;
mod stairs;

use glam::{Vec2, Vec3};

use super::surface::Workshop;
use crate::{Camera, Light, Projection, Scene};
use materials::Materials;

/// Distance between columns, m.
const BAY: f32 = 3.0;
/// Half size (x, z) of the rectangle of columns, m.
const COURT: Vec2 = Vec2::new(9.0, 4.5);
/// Half size (x, z) of the rectangle of the outer walls' inner faces, m.
const OUTER: Vec2 = Vec2::new(12.0, 7.5);
/// Height of the ground storey's walk, m; the court is at 0.
const FLOOR: f32 = 0.3;
/// Height of the springing of the ground storey's arches, m.
const SPRING: f32 = 3.2;
/// Height of the gallery's floor, m.
const UPPER_FLOOR: f32 = 5.0;
/// Height of the springing of the gallery's arches, m.
const UPPER_SPRING: f32 = 7.5;
/// Height of the top of the gallery's wall, m.
const WALL_TOP: f32 = 9.0;

/// The scene with its lights: the sun and the lanterns.
pub(super) fn atrium() -> Scene {
    let mut workshop = Workshop { scene: Scene { name: "atrium".to_owned(), ..Scene::default() } };
    let materials = Materials::new(&mut workshop);
    court::shell(&mut workshop, &materials);
    arcade::ground_storey(&mut workshop, &materials);
    arcade::upper_storey(&mut workshop, &materials);
    stairs::stairs(&mut workshop, &materials);
    court::fountain(&mut workshop, &materials, Vec3::new(3.4, 0.0, 0.0));
    decor::cloths(&mut workshop, &materials);
    decor::plants(&mut workshop, &materials);

    // Late afternoon: 5.9 lx give a cream wall (albedo 0.55) that faces the sun 1 nit.
    let sun = Light::directional(Vec3::new(-0.47, -0.80, 0.31), Vec3::new(7.0, 5.7, 4.1));
    workshop.scene.lights.push(Light { name: "sun".to_owned(), ..sun });
    decor::lanterns(&mut workshop, &materials);

    let mut scene = workshop.scene;
    scene.sky = Vec3::new(0.40, 0.58, 0.95);
    scene.cameras = vec![
        camera("court", Vec3::new(8.2, 1.75, -2.7), Vec3::new(-3.0, 3.55, 1.0), 58.0),
        camera("gallery", Vec3::new(7.1, 7.0, 4.0), Vec3::new(-3.5, 3.6, -2.0), 58.0),
        camera("arcade", Vec3::new(8.6, 1.9, 6.3), Vec3::new(0.0, 2.2, 5.2), 55.0),
    ];
    scene
}

/// A camera for 16:9; `fov_y` in degrees.
fn camera(name: &str, eye: Vec3, target: Vec3, fov_y: f32) -> Camera {
    let projection = Projection::Perspective { fov_y: fov_y.to_radians(), near: 0.05 };
    Camera { name: name.to_owned(), ..Camera::look_at(eye, target, projection) }
}
