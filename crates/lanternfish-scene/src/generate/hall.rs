//! A rotated hall with an outer shell.

use std::f32::consts::{FRAC_PI_6, PI};

use glam::{Affine3A, EulerRot, Mat3A, Vec2, Vec3};

use super::{
    build::Shape,
    surface::{Finish, Workshop},
};
use crate::{Camera, Light, Projection, Scene};

/// Half the hall's width and length, and the height of its walls, m.
const HALF: Vec2 = Vec2::new(8.0, 15.0);
const HEIGHT: f32 = 9.0;
/// Distance between the inner and the outer shell, m.
const THICKNESS: f32 = 0.6;
/// Approximate edge length of a wall's triangles, m: less than a texel of a deep image of 64 × 64 texels.
const STEP: f32 = 0.4;

/// A vaulted hall with two rows of columns, lit from inside, in an unlit outer shell: a ray that leaks through the walls hits black. It
/// is rotated by 30° about each axis, so that no surface is aligned with a raster.
pub(super) fn hall() -> Scene {
    let mut workshop = Workshop { scene: Scene { name: "hall".to_owned(), ..Scene::default() } };
    let plaster = workshop.surface(Finish::new("plaster", [0.7, 0.68, 0.62], 0.9));
    let stone = workshop.surface(Finish::new("stone", [0.5, 0.45, 0.4], 0.8));
    let outside = workshop.surface(Finish::new("outside", [0.3, 0.3, 0.32], 1.0));

    let mut inside = Shape::new();
    shell(&mut inside, HALF, 0.0, HEIGHT, true);
    workshop.add("walls and vault", plaster, inside);
    let mut outer = Shape::new();
    shell(&mut outer, HALF + THICKNESS, -THICKNESS, HEIGHT, false);
    workshop.add("outer shell", outside, outer);

    let mut column = Shape::new();
    column.lathe(
        &[(0.0, 0.0), (0.9, 0.0), (0.9, 0.5), (0.55, 0.8), (0.5, 6.5), (0.85, 7.0), (0.85, 7.4), (0.0, 7.4)],
        24,
    );
    let column = workshop.mesh("column", [(stone, column)]);
    for row in [-4.0, 4.0] {
        for i in 0..6 {
            workshop.place_at(column, Vec3::new(row, 0.0, -12.5 + 5.0 * i as f32), 0.0);
        }
    }

    let mut scene = workshop.scene;
    for (z, color) in [(-8.0, Vec3::new(900.0, 780.0, 600.0)), (7.0, Vec3::new(500.0, 560.0, 700.0))] {
        scene.lights.push(Light { name: "lamp".to_owned(), ..Light::point(Vec3::new(0.0, 6.0, z), color) });
    }
    let projection = Projection::Perspective { fov_y: 60f32.to_radians(), near: 0.05 };
    let camera = Camera::look_at(Vec3::new(1.5, 2.0, 13.5), Vec3::new(-0.5, 4.0, 0.0), projection);
    scene.cameras.push(Camera { name: "nave".to_owned(), ..camera });
    rotated(scene)
}

/// A floor, four walls and a vault from wall to wall, seen from inside or from outside.
fn shell(shape: &mut Shape, half: Vec2, floor: f32, height: f32, inside: bool) {
    let mut side = |size: Vec2, position: &dyn Fn(f32, f32) -> Vec3| {
        let [columns, rows] = (size / STEP).ceil().to_array().map(|count| count as u32);
        // A sheet's front is where s and t are counter-clockwise.
        shape.sheet(columns, rows, size, |s, t| position(if inside { s } else { 1.0 - s }, t));
    };
    let (width, length) = (2.0 * half.x, 2.0 * half.y);
    side(Vec2::new(width, length), &|s, t| Vec3::new(half.x * (2.0 * s - 1.0), floor, half.y * (1.0 - 2.0 * t)));
    for sign in [-1.0, 1.0] {
        let rise = height - floor;
        side(Vec2::new(length, rise), &|s, t| {
            Vec3::new(sign * half.x, floor + rise * t, sign * half.y * (2.0 * s - 1.0))
        });
        // Up to the crown, bounded by the vault.
        side(Vec2::new(width, rise), &|s, t| {
            let x = half.x * (2.0 * s - 1.0);
            let top = height + (half.x * half.x - x * x).max(0.0).sqrt();
            Vec3::new(-sign * x, floor + (top - floor) * t, sign * half.y)
        });
    }
    side(Vec2::new(PI * half.x, length), &|s, t| {
        let (sin, cos) = (PI * s).sin_cos();
        Vec3::new(half.x * cos, height + half.x * sin, half.y * (1.0 - 2.0 * t))
    });
}

/// Rotates the scene by 30° about each axis.
fn rotated(mut scene: Scene) -> Scene {
    let rotation = Affine3A::from_mat3(Mat3A::from_euler(EulerRot::XYZ, FRAC_PI_6, FRAC_PI_6, FRAC_PI_6).into());
    for instance in &mut scene.instances {
        instance.world_from_object = rotation * instance.world_from_object;
    }
    for light in &mut scene.lights {
        light.position = rotation.transform_point3(light.position);
        light.direction = rotation.transform_vector3(light.direction);
    }
    for camera in &mut scene.cameras {
        camera.world_from_camera = rotation * camera.world_from_camera;
    }
    scene
}
