//! Light paths do not change the mean, and reduce noise.

use glam::Vec3;
use lanternfish_scene::{Light, Material, Scene};

use super::{front, material, mean_and_error, quad, render, scene_of};
use crate::{Settings, settings::LightPaths};

/// Samples of a pixel.
const SAMPLES: u64 = 1024;

/// A floor, a wall at its left and a light in front of the wall.
fn corner(materials: [Material; 2], lamp: Light) -> Scene {
    let floor = quad(0, Vec3::ZERO, Vec3::X, Vec3::Y);
    let wall = quad(1, Vec3::new(-1.0, 0.0, 1.0), Vec3::Y, Vec3::Z);
    Scene { lights: vec![lamp], ..scene_of(vec![floor, wall], materials.into()) }
}

fn lamp() -> Light {
    Light::point(Vec3::new(-0.97, 0.1, 0.8), Vec3::ONE)
}

fn matt() -> Material {
    material(Vec3::splat(0.8), 0.0, 1.0)
}

/// Mean over the image, and its standard error, of indirect light: paths of more than two segments.
fn indirect(scene: &Scene, light_paths: LightPaths, max_depth: u32) -> (f64, f64) {
    let of = |max_depth, samples| {
        let settings = Settings { light_paths, max_depth, ..Settings::default() };
        mean_and_error(&render(scene, &front(4.0, 0.9), 16, samples, settings))
    };
    let ((all, error), (direct, error_of_direct)) = (of(max_depth, SAMPLES), of(2, SAMPLES));
    (all - direct, error.hypot(error_of_direct))
}

/// Asserts that indirect light with and without light paths agrees, with a relative error below `noise` for both. Returns the ratio of the
/// variances, with to without.
fn compare(what: &str, scene: &Scene, max_depth: u32, noise: f64) -> f64 {
    let [(with, error), (without, error_without)] =
        [LightPaths::On, LightPaths::Off].map(|light_paths| indirect(scene, light_paths, max_depth));
    let deviations = (with - without).abs() / error.hypot(error_without);
    println!("{what}, {max_depth}: {with:.5} ± {error:.5}, {without:.5} ± {error_without:.5}");
    assert!(deviations < 4.0, "{what}: {with} ± {error} with, {without} ± {error_without} without");
    assert!(error.max(error_without) < noise * with, "{what}: too noisy to compare");
    (error / error_without).powi(2)
}

#[test]
fn light_paths_reduce_noise_of_lights_close_to_a_wall() {
    // Closer to the wall, the noise without light paths is too high to compare.
    let scene = corner([matt(), matt()], Light { position: Vec3::new(-0.9, 0.1, 0.8), ..lamp() });
    let ratio = compare("a light 10 cm from a wall", &scene, 3, 0.03);
    assert!(ratio < 0.3, "{ratio}");
    // At any small distance, half of the light hits the wall and is reflected.
    let near = |distance: f32| {
        let lamp = Light { position: Vec3::new(-1.0 + distance, 0.0, 0.8), ..lamp() };
        indirect(&corner([matt(), matt()], lamp), LightPaths::On, 3).0
    };
    let [close, closer] = [0.01, 0.001].map(near);
    println!("at 1 cm {close:.5}, at 1 mm {closer:.5}");
    assert!((closer / close - 1.0).abs() < 0.03, "{close} {closer}");
    // The wall reflects no light of a light in its plane.
    assert!(near(0.0) < 1e-6, "{}", near(0.0));
}

/// Light paths start mostly at lights that matter for the surface, not only in proportion to power.
#[test]
fn distant_lights_add_little_noise() {
    let mut scene = corner([matt(), matt()], Light { position: Vec3::new(-0.9, 0.1, 0.8), ..lamp() });
    let elsewhere = |i: u8| Light::point(Vec3::new(40.0, f32::from(i), 0.5), Vec3::splat(0.5));
    scene.lights.extend((0..63).map(elsewhere));
    let ratio = compare("63 lights at 40 m", &scene, 6, 0.02);
    println!("variance ratio {ratio:.3}");
    // Selection by power alone gives 0.43.
    assert!(ratio < 0.15, "{ratio}");
}

/// Far from the origin, ray offsets are larger. No light must be lost between facing walls.
#[test]
fn facing_walls_far_from_the_origin_light_each_other() {
    let place = Vec3::new(-40.0, 30.0, 50.0);
    let mut scene = corner([matt(), matt()], Light { position: Vec3::new(-0.8, 0.1, 0.8), ..lamp() });
    let wall = quad(1, Vec3::new(-0.4, 0.0, 1.0), Vec3::NEG_Y, Vec3::Z);
    scene.meshes[0].primitives.push(wall);
    compare("near the origin", &scene, 4, 0.01);
    let near = indirect(&scene, LightPaths::On, 4);
    scene.instances[0].world_from_object = glam::Affine3A::from_translation(place);
    scene.lights[0].position += place;
    let projection = lanternfish_scene::Projection::Orthographic { half_height: 0.9, near: 0.0, far: 100.0 };
    let camera = lanternfish_scene::Camera::look_at(place + Vec3::new(0.0, 0.0, 4.0), place, projection);
    let of = |max_depth| {
        let settings = Settings { max_depth, ..Settings::default() };
        mean_and_error(&render(&scene, &camera, 16, SAMPLES, settings))
    };
    let ((all, error), (direct, _)) = (of(4), of(2));
    println!("{:.5} ± {error:.5} far, {:.5} near", all - direct, near.0);
    assert!((all - direct - near.0).abs() < 4.0 * error.hypot(near.1) && error < 0.01 * near.0);
}
