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

/// Mean, its standard error, and mean variance of a sample.
fn found(scene: &Scene, light_paths: LightPaths, max_depth: u32) -> (f64, f64) {
    let settings = Settings { light_paths, max_depth, ..Settings::default() };
    mean_and_error(&render(scene, &front(4.0, 0.9), 16, 1024, settings))
}

/// Asserts that both ways bring the same; gives the share of the variance that is left.
fn compare(what: &str, scene: &Scene, max_depth: u32) -> f64 {
    let [(with, error), (without, error_without)] =
        [LightPaths::On, LightPaths::Off].map(|light_paths| found(scene, light_paths, max_depth));
    let apart = (with - without).abs() / error.hypot(error_without);
    println!("{what}, {max_depth}: {with:.5} ± {error:.5}, {without:.5} ± {error_without:.5}");
    assert!(apart < 4.0, "{what}: {with} ± {error} with, {without} ± {error_without} without");
    assert!(error < 0.02 * with, "{what}: too noisy to say anything");
    (error / error_without).powi(2)
}

#[test]
fn light_close_to_a_wall_has_little_noise() {
    let scene = corner([matt(), matt()], lamp());
    for max_depth in [3, 6] {
        let left = compare("a lamp 3 cm before a wall", &scene, max_depth);
        assert!(left < 0.2, "{left}");
    }
    // Straight light is looked for as without.
    assert_eq!(found(&scene, LightPaths::On, 2), found(&scene, LightPaths::Off, 2));
    // It can fail: what comes by one surface more is a good part of the light.
    assert!(found(&scene, LightPaths::On, 3).0 > 1.2 * found(&scene, LightPaths::On, 2).0);
}

#[test]
fn both_ways_bring_the_same_light() {
    let spot = Light {
        kind: LightKind::Spot { inner_angle: 0.3, outer_angle: 0.9 },
        direction: Vec3::new(-1.0, 0.2, -0.3).normalize(),
        position: Vec3::new(-0.5, 0.1, 0.8),
        ..lamp()
    };
    compare("a spot light", &corner([matt(), matt()], spot), 4);
    let shining = Material { clearcoat: 1.0, clearcoat_roughness: 0.4, ..material(Vec3::splat(0.8), 0.5, 0.4) };
    compare("coated metal", &corner([shining.clone(), shining], lamp()), 4);

    // In the way of the lamp's light, and of what the wall sends.
    let between = |material: Material| {
        let mut scene = corner([matt(), matt()], Light { position: Vec3::new(-0.6, 0.1, 0.8), ..lamp() });
        scene.materials.push(material);
        for place in [Vec3::new(-0.8, 0.0, 0.8), Vec3::new(-0.4, 0.0, 0.6)] {
            scene.meshes[0].primitives.push(quad(2, place, 0.3 * Vec3::Y, 0.3 * Vec3::Z));
        }
        scene
    };
    let alpha = Material { alpha_mode: AlphaMode::Blend, double_sided: true, ..matt() };
    compare("blended", &between(Material { base_color: Vec4::new(0.8, 0.4, 0.2, 0.5), ..alpha.clone() }), 5);
    let pane = Material { transmission: 1.0, double_sided: true, ..material(Vec3::new(0.9, 0.7, 0.5), 0.0, 0.0) };
    compare("a pane", &between(pane), 5);

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
    compare("a ball of glass", &ball, 4);
}
