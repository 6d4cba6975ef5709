use glam::{DVec3, Quat, Vec3};
use lanternfish_reference::{brdf::grazing_fraction, reflector};
use lanternfish_scene::Material;

use crate::{
    environment_light::{
        brdf_fractions::{LEAST_ROUGHNESS, fractions},
        samples::{by_normal, harmonics, samples_of, sun_of},
    },
    shaders::constant,
    testing::{Random, half_white, image},
};

#[test]
fn cells_cover_the_sphere() {
    let colour = |d: Vec3| Vec3::new(1.0 + d.x, 2.0 - d.y, 1.0 + d.z * d.z);
    // An image of the same resolution, a larger one that does not divide evenly, and smaller ones.
    for (width, height) in [(256, 128), (700, 301), (64, 32), (1, 1)] {
        let environment = image(width, height, 0.4, colour);
        let samples = samples_of(&environment);
        let sum: f32 = samples.iter().map(|sample| sample.solid_angle).sum();
        assert!((sum / (2.0 * std::f32::consts::TAU) - 1.0).abs() < 1e-4, "{width}: {sum}");
        let off = samples.iter().map(|s| (s.radiance - environment.radiance(s.direction)).abs().max_element());
        let worst = off.fold(0.0, f32::max);
        // A cell is 1.4° wide, and the colour changes by up to 2 per radian.
        assert!(worst < 0.02, "{width}: {worst}");
    }
}

#[test]
fn a_sun_is_a_small_bright_area() {
    let towards = Vec3::new(0.3, 0.5, -0.8).normalize();
    let sky = |sun: f32| image(1024, 512, 0.3, |d| Vec3::splat(0.5 + if d.dot(towards) > 0.9996 { sun } else { 0.0 }));
    // The image is rotated, and so is the sun.
    let actual = sun_of(&samples_of(&sky(1e4))).unwrap();
    let expected = Quat::from_rotation_y(0.3) * towards;
    assert!(actual.dot(expected) > 0.99995, "{actual} {expected}");
    assert_eq!(sun_of(&samples_of(&sky(10.0))), None);
    assert_eq!(sun_of(&samples_of(&half_white())), None);
    assert_eq!(sun_of(&samples_of(&image(4, 2, 0.0, |_| Vec3::ZERO))), None);
}

#[test]
fn nine_coefficients_give_the_irradiance() {
    let mut random = Random::new(9);
    let normals: Vec<Vec3> = (0..200).map(|_| random.direction()).collect();
    // The upper hemisphere is white: the image or the cosine lobe has no orders above the first.
    let half = harmonics(&samples_of(&half_white()));
    // A small patch emits: its irradiance is the first three orders of the cosine [Ramamoorthi2001, eq. 8].
    let towards = Vec3::new(0.6, 0.3, -0.7).normalize();
    let patch = samples_of(&image(1024, 512, 0.0, |d| Vec3::splat(f32::from(d.dot(towards) > 0.999))));
    let flux: f32 = patch.iter().map(|sample| sample.solid_angle * sample.radiance.x).sum();
    let patch = harmonics(&patch);
    for n in normals {
        let actual = by_normal(&half, n).x;
        assert!((actual - (0.5 + 0.5 * n.y)).abs() < 2e-3, "{n}: {actual}");
        let x = n.dot(towards);
        let expected = 0.25 + 0.5 * x + (5.0 / 32.0) * (3.0 * x * x - 1.0);
        let actual = by_normal(&patch, n).x * std::f32::consts::PI / flux;
        assert!((actual - expected).abs() < 5e-3, "{n}: {actual} {expected}");
    }
    // A constant radiance, exact within rounding.
    let even = harmonics(&samples_of(&image(8, 4, 0.0, |_| Vec3::splat(3.0))));
    assert!((by_normal(&even, Vec3::new(0.48, 0.6, 0.64)).x / 3.0 - 1.0).abs() < 1e-5);
}

/// The table against the BRDF, integrated over the hemisphere.
#[test]
fn fractions_equal_the_brdf_under_uniform_light() {
    assert_eq!(constant("materials/brdf", "LEAST_ROUGHNESS"), LEAST_ROUGHNESS);
    // A grazing lobe is 0.03 rad wide in azimuth, and 0.3 rad in elevation.
    const AROUND: u32 = 1024;
    const UP: u32 = 96;
    let white = |metallic, roughness| reflector(&Material::default(), DVec3::ONE, metallic, roughness, true);
    let reflected = |metallic, n_dot_v: f64, roughness| {
        let (white, wo) = (white(metallic, roughness), DVec3::new((1.0 - n_dot_v * n_dot_v).sqrt(), n_dot_v, 0.0));
        let of = |i: u32| {
            let part = |i: u32, count: u32| (f64::from(i) + 0.5) / f64::from(count);
            let (sin, cos) = (std::f64::consts::TAU * part(i % AROUND, AROUND)).sin_cos();
            let y = part(i / AROUND, UP);
            let across = (1.0 - y * y).sqrt();
            white.reflect_light(DVec3::Y, DVec3::new(across * cos, y, across * sin), wo).x
        };
        (0..AROUND * UP).map(of).sum::<f64>() * std::f64::consts::TAU / f64::from(AROUND * UP)
    };
    for roughness in [0.3, 0.6, 1.0] {
        for n_dot_v in [0.15, 0.5, 0.95] {
            let [near, grazing] = fractions(n_dot_v, roughness);
            let [metal, dielectric] = [1.0, 0.0].map(|metallic| reflected(metallic, n_dot_v, roughness));
            let white = white(0.0, roughness);
            let expected = white.lets_in(grazing_fraction(n_dot_v, white.alpha())).x + 0.04 * near + grazing;
            println!("{roughness} {n_dot_v}: {metal:.4} {:.4}, {dielectric:.4} {expected:.4}", near + grazing);
            // Both are sums over directions: 512 and 98,304.
            assert!((near + grazing - metal).abs() < 0.015, "{roughness} {n_dot_v}: {} {metal}", near + grazing);
            assert!((expected - dielectric).abs() < 0.015, "{roughness} {n_dot_v}: {expected} {dielectric}");
        }
    }
}
