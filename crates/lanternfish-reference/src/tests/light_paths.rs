//! Paths that start at lights bring the light that paths from the eye alone bring, with less noise.

use glam::{Vec3, Vec4};
use lanternfish_scene::{AlphaMode, Light, LightKind, Material, Scene};

use super::{front, material, mean_and_error, quad, render, scene_of, sphere};
use crate::{Settings, settings::LightPaths};

/// A floor and a wall at its left, with a lamp before the wall; seen from the front.
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

/// Mean over the image, and its standard error, of light that comes by at least one surface more: longer paths than of two segments.
fn found(scene: &Scene, light_paths: LightPaths, max_depth: u32) -> (f64, f64) {
    let of = |max_depth, samples| {
        let settings = Settings { light_paths, max_depth, ..Settings::default() };
        mean_and_error(&render(scene, &front(4.0, 0.9), 16, samples, settings))
    };
    let ((all, error), (direct, error_of_direct)) = (of(max_depth, 4096), of(2, 4096));
    (all - direct, error.hypot(error_of_direct))
}

/// Asserts that both ways bring the same, of which neither is off by more than `noise` of it; gives the share of the variance that is left.
fn compare(what: &str, scene: &Scene, max_depth: u32, noise: f64) -> f64 {
    let [(with, error), (without, error_without)] =
        [LightPaths::On, LightPaths::Off].map(|light_paths| found(scene, light_paths, max_depth));
    let apart = (with - without).abs() / error.hypot(error_without);
    println!("{what}, {max_depth}: {with:.5} ± {error:.5}, {without:.5} ± {error_without:.5}");
    assert!(apart < 4.0, "{what}: {with} ± {error} with, {without} ± {error_without} without");
    assert!(error.max(error_without) < noise * with, "{what}: too noisy to say anything");
    (error / error_without).powi(2)
}

#[test]
fn light_close_to_a_wall_has_little_noise() {
    // Nearer to the wall the other way's own noise is too large to be compared with.
    let scene = corner([matt(), matt()], Light { position: Vec3::new(-0.9, 0.1, 0.8), ..lamp() });
    for max_depth in [3, 6] {
        let left = compare("a lamp 10 cm before a wall", &scene, max_depth, 0.015);
        assert!(left < 0.3, "{left}");
    }
    // However close the lamp is, half of its light meets the wall, and goes on from there.
    let near = |distance: f32| {
        let lamp = Light { position: Vec3::new(-1.0 + distance, 0.0, 0.8), ..lamp() };
        found(&corner([matt(), matt()], lamp), LightPaths::On, 3).0
    };
    let [close, closer] = [0.01, 0.001].map(near);
    println!("1 cm before it {close:.5}, 1 mm {closer:.5}");
    assert!((closer / close - 1.0).abs() < 0.03, "{close} {closer}");
    // The wall sends nothing of a lamp in its own plane.
    assert!(near(0.0) < 1e-6, "{}", near(0.0));
}

/// Paths start at the lamp that lights what the surface sees, not at all lamps by their power.
#[test]
fn many_lamps_elsewhere_add_little_noise() {
    let mut scene = corner([matt(), matt()], Light { position: Vec3::new(-0.9, 0.1, 0.8), ..lamp() });
    let elsewhere = |i: u8| Light::point(Vec3::new(40.0, f32::from(i), 0.5), Vec3::splat(0.5));
    scene.lights.extend((0..63).map(elsewhere));
    for max_depth in [3, 6] {
        let left = compare("63 lamps 40 m away", &scene, max_depth, 0.02);
        println!("{left:.3} of the variance");
        // By power alone: 0.43.
        assert!(left < 0.15, "{left}");
    }
}

/// Far from the origin rays start farther from surfaces, and nothing is lost between walls that face each other.
#[test]
fn facing_walls_far_from_the_origin_light_each_other() {
    let place = Vec3::new(-40.0, 30.0, 50.0);
    let mut scene = corner([matt(), matt()], Light { position: Vec3::new(-0.8, 0.1, 0.8), ..lamp() });
    let wall = quad(1, Vec3::new(-0.4, 0.0, 1.0), Vec3::NEG_Y, Vec3::Z);
    scene.meshes[0].primitives.push(wall);
    compare("near the origin", &scene, 4, 0.01);
    let near = found(&scene, LightPaths::On, 4);
    scene.instances[0].world_from_object = glam::Affine3A::from_translation(place);
    scene.lights[0].position += place;
    let projection = lanternfish_scene::Projection::Orthographic { half_height: 0.9, near: 0.0, far: 100.0 };
    let camera = lanternfish_scene::Camera::look_at(place + Vec3::new(0.0, 0.0, 4.0), place, projection);
    let of = |max_depth| {
        let settings = Settings { max_depth, ..Settings::default() };
        mean_and_error(&render(&scene, &camera, 16, 4096, settings))
    };
    let ((all, error), (direct, _)) = (of(4), of(2));
    println!("{:.5} ± {error:.5} there, {:.5} here", all - direct, near.0);
    assert!((all - direct - near.0).abs() < 4.0 * error.hypot(near.1) && error < 0.01 * near.0);
}

#[test]
fn both_ways_bring_the_same_light() {
    let spot = Light {
        kind: LightKind::Spot { inner_angle: 0.3, outer_angle: 0.9 },
        direction: Vec3::new(-1.0, 0.2, -0.3).normalize(),
        position: Vec3::new(-0.5, 0.1, 0.8),
        ..lamp()
    };
    compare("a spot light", &corner([matt(), matt()], spot), 4, 0.01);
    let shining = Material { clearcoat: 1.0, clearcoat_roughness: 0.4, ..material(Vec3::splat(0.8), 0.5, 0.4) };
    let lamp = || Light { position: Vec3::new(-0.6, 0.1, 0.8), ..lamp() };
    compare("coated metal", &corner([shining.clone(), shining], lamp()), 4, 0.02);

    // In the way of the lamp's light, and of what the wall sends.
    let between = |material: Material| {
        let mut scene = corner([matt(), matt()], lamp());
        scene.materials.push(material);
        for place in [Vec3::new(-0.8, 0.0, 0.8), Vec3::new(-0.4, 0.0, 0.6)] {
            scene.meshes[0].primitives.push(quad(2, place, 0.3 * Vec3::Y, 0.3 * Vec3::Z));
        }
        scene
    };
    let alpha = Material { alpha_mode: AlphaMode::Blend, double_sided: true, ..matt() };
    compare("transparent", &between(Material { base_color: Vec4::new(0.8, 0.4, 0.2, 0.5), ..alpha.clone() }), 5, 0.01);
    // What it mirrors of a lamp is a glint.
    let thin_dielectric = Material {
        transmission: 1.0,
        specular: 0.0,
        double_sided: true,
        ..material(Vec3::new(0.9, 0.7, 0.5), 0.0, 0.0)
    };
    compare("a pane", &between(thin_dielectric), 5, 0.02);

    // Rough glass, within which light goes from its back to its front.
    let glass = Material {
        transmission: 1.0,
        ior: 1.5,
        thickness: 1.0,
        attenuation_distance: 0.5,
        attenuation_color: Vec3::new(0.5, 0.7, 0.9),
        ..material(Vec3::ONE, 0.0, 0.7)
    };
    let lamps = vec![Light::point(Vec3::new(0.0, 0.3, -0.75), Vec3::ONE), Light::point(Vec3::ZERO, Vec3::splat(0.3))];
    let ball = Scene { lights: lamps, ..scene_of(vec![sphere(0, 0.7, 12)], vec![glass]) };
    compare("a ball of glass", &ball, 4, 0.03);

    // Lights of every kind together, those that paths start at among them, however one is chosen.
    let mut many = corner([matt(), Material { emissive: Vec3::splat(0.2), ..matt() }], lamp());
    many.sky = Vec3::splat(0.1);
    many.lights.splice(0..0, [Light::directional(Vec3::new(0.3, 0.2, -1.0), Vec3::splat(0.2))]);
    many.lights.push(Light::rectangle(Vec3::new(0.5, 0.5, 1.0), Vec3::NEG_Z, Vec3::X, [0.3, 0.2], Vec3::ONE));
    many.lights.push(Light::point(Vec3::new(0.6, -0.5, 0.7), Vec3::splat(0.5)));
    compare("lights of every kind", &many, 4, 0.01);
}
