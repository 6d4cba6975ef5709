//! Disk and rectangle lights.

use std::f64::consts::PI;

use glam::Vec3;
use lanternfish_scene::{
    Light, Material, Scene,
    shading::{Attenuation, Materials},
};

use super::{assert_mean, front, material, mean_and_error, quad, render, scene_of};
use crate::{Settings, settings::LightChoice};

fn lambert() -> Settings {
    let (materials, attenuation) = (Materials::Lambert, Attenuation::Physical);
    Settings { materials, attenuation, max_depth: 2, ..Settings::default() }
}

/// A white floor at z = 0 with these lights.
fn floor(lights: Vec<Light>) -> Scene {
    let floor = vec![quad(0, Vec3::ZERO, Vec3::X, Vec3::Y)];
    Scene { lights, ..scene_of(floor, vec![material(Vec3::ONE, 0.0, 1.0)]) }
}

/// Form factor of a rectangle of a × b at height 1, from the point below a corner:
/// (a / √(1 + a²) atan(b / √(1 + a²)) + b / √(1 + b²) atan(a / √(1 + b²))) / 2π.
pub(super) fn below_corner(a: f64, b: f64) -> f64 {
    let part = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
    (part(a, b) + part(b, a)) / (2.0 * PI)
}

#[test]
fn a_floor_has_the_radiance_of_the_form_factors() {
    // The central millimetre of the floor.
    let camera = front(3.0, 0.0005);
    let down = Vec3::NEG_Z;
    let radiance = Vec3::splat(5.0);
    let above = |[width, height]: [f32; 2]| Light::rectangle(Vec3::Z, down, Vec3::X, [width, height], radiance);
    let moved = |mut light: Light| {
        light.position += Vec3::new(0.5, 0.75, 0.0);
        light
    };
    for (name, light, factor) in [
        ("a square", above([2.0, 2.0]), 4.0 * below_corner(1.0, 1.0)),
        ("a strip", above([3.0, 0.5]), 4.0 * below_corner(1.5, 0.25)),
        // The point lies below a corner, so width and height are distinguished.
        ("a corner", moved(above([1.0, 1.5])), below_corner(1.0, 1.5)),
        ("a disk", Light::disk(Vec3::Z, down, 0.75, radiance), 0.75 * 0.75 / (0.75 * 0.75 + 1.0)),
        ("a small disk", Light::disk(2.0 * Vec3::Z, down, 0.01, radiance), 1e-4 / (1e-4 + 4.0)),
    ] {
        let film = render(&floor(vec![light]), &camera, 8, 1024, lambert());
        assert_mean(&film, 5.0 * factor, 1e-4 * factor, name);
    }
    // The check can fail: width and height are swapped.
    let other = moved(above([1.5, 1.0]));
    let actual = mean_and_error(&render(&floor(vec![other]), &camera, 8, 1024, lambert()));
    assert!((actual.0 - 5.0 * below_corner(1.0, 1.5)).abs() > 20.0 * actual.1, "{actual:?}");
}

#[test]
fn a_white_floor_between_emissive_walls_has_their_radiance() {
    let walls = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z]
        .map(|out| Light::rectangle(3.0 * out, -out, out.any_orthonormal_vector(), [6.0, 6.0], Vec3::ONE));
    let scene = floor(walls.to_vec());
    for light_choice in LightChoice::ALL.iter().copied() {
        let film = render(&scene, &front(1.0, 0.5), 16, 512, Settings { light_choice, ..lambert() });
        assert_mean(&film, 1.0, 1e-4, &light_choice.to_string());
    }
}

#[test]
fn one_side_emits_up_to_the_range_from_the_centre() {
    let camera = front(0.5, 0.0005);
    let mean = |light| mean_and_error(&render(&floor(vec![light]), &camera, 4, 16, lambert())).0;
    let disk = |direction, range| Light { range, ..Light::disk(Vec3::Z, direction, 0.5, Vec3::ONE) };
    assert_eq!(mean(disk(Vec3::Z, None)), 0.0);
    assert_eq!(mean(disk(Vec3::NEG_Z, Some(0.99))), 0.0);
    assert!(mean(disk(Vec3::NEG_Z, Some(1.01))) > 0.1);
}

/// An area light and an emissive mesh of the same shape give the same light and shadows on different materials. The mesh itself is outside
/// the image.
#[test]
fn an_area_light_equals_an_emissive_mesh() {
    let matter = [("glossy", material(Vec3::splat(0.5), 0.0, 0.3)), ("metal", material(Vec3::ONE, 1.0, 0.4))];
    let radiance = Vec3::splat(4.0);
    let (middle, half_right, half_up) =
        (Vec3::new(0.3, -0.6, 1.0), Vec3::new(0.4, 0.0, 0.0), Vec3::new(0.0, 0.2, -0.1));
    let direction = half_up.cross(half_right).normalize();
    let size = 2.0 * Vec3::new(half_right.length(), half_up.length(), 0.0);
    let light = Light::rectangle(middle, direction, half_right, [size.x, size.y], radiance);
    for (name, floor) in matter {
        let lamp = Material { emissive: radiance, ..material(Vec3::ZERO, 0.0, 1.0) };
        let blocker = Material { double_sided: true, ..material(Vec3::ZERO, 0.0, 1.0) };
        let quads = vec![
            quad(0, Vec3::ZERO, Vec3::X, Vec3::Y),
            quad(1, Vec3::new(0.1, -0.3, 0.5), 0.1 * Vec3::X, 0.3 * Vec3::Y),
            quad(2, middle, half_up, half_right),
        ];
        let with_mesh = scene_of(quads.clone(), vec![floor.clone(), blocker.clone(), lamp]);
        let quads = quads[..2].to_vec();
        let with_light = Scene { lights: vec![light.clone()], ..scene_of(quads, vec![floor, blocker]) };
        // The camera is below the blocker.
        let settings = || Settings { max_depth: 2, attenuation: Attenuation::Physical, ..Settings::default() };
        let [mesh, light] = [with_mesh, with_light]
            .map(|scene| mean_and_error(&render(&scene, &front(0.45, 0.6), 16, 1024, settings())));
        let error = mesh.1.hypot(light.1);
        println!("{name}: {mesh:?} by the mesh, {light:?} by the light");
        assert!((mesh.0 - light.0).abs() < 4.0 * error && error < 0.01 * mesh.0, "{name}: {mesh:?}, {light:?}");
    }
}
