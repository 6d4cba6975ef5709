//! Shadows of lights with a radius.

use std::f64::consts::PI;

use glam::{Vec3, Vec4};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{Camera, Light, Material, Projection, Scene, generate};

use crate::{
    RenderError, Renderer, Settings,
    settings::{Samples, Shadows},
    techniques::{Denoise, SampledLights},
    testing::{quad, scene_of},
};

const SIZE: (u32, u32) = (61, 3);
/// Half of the floor's width that the camera sees, m.
const HALF_WIDTH: f32 = 0.3;
const RADIUS: f32 = 0.2;

fn luminance(gpu: &Gpu, scene: &Scene, camera: &Camera, settings: Settings, size: (u32, u32)) -> Vec<f64> {
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    let rendering = renderer.render(&uploaded, camera, size.into()).unwrap();
    rendering.radiance.iter().map(|pixel| f64::from(Vec4::from(*pixel).truncate().element_sum())).collect()
}

fn soft(shadow_rays: u32) -> Settings {
    Settings::direct_light().with_light_radius(RADIUS).with_shadow_rays(shadow_rays).with_shadows(Shadows::BVH)
}

/// A floor in the plane z = 0, a light 2 m above it, and halfway between them a sheet that covers x < 0.
fn edge() -> (Scene, Camera) {
    let material = Material { double_sided: true, metallic: 0.0, specular: 0.0, ..Material::default() };
    let floor = quad(0, Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y);
    let sheet = quad(0, Vec3::new(-2.0, 0.0, 1.0), 2.0 * Vec3::X, 2.0 * Vec3::Y);
    let mut scene = scene_of(vec![floor, sheet], vec![material]);
    scene.lights = vec![Light::point(Vec3::new(0.0, 0.0, 2.0), Vec3::splat(8.0))];
    let half_height = HALF_WIDTH * SIZE.1 as f32 / SIZE.0 as f32;
    let projection = Projection::Orthographic { half_height, near: 0.01, far: 1.0 };
    (scene, Camera::look_at(Vec3::new(0.0, 0.0, 0.5), Vec3::ZERO, projection))
}

/// Fraction of a disk of radius 1 with coordinates above `x`.
fn segment(x: f64) -> f64 {
    if x.abs() >= 1.0 { f64::from(x < 0.0) } else { (x.acos() - x * (1.0 - x * x).sqrt()) / PI }
}

/// Mean and largest difference between the rendered visibility and that of a disk of this radius.
fn off(actual: &[f64], unshadowed: &[f64], radius: f32) -> (f64, f64) {
    let errors = actual.iter().zip(unshadowed).enumerate().map(|(i, (actual, unshadowed))| {
        let column = (i as u32 % SIZE.0) as f64 + 0.5;
        let x = f64::from(HALF_WIDTH) * (2.0 * column / f64::from(SIZE.0) - 1.0);
        // As seen from the light's centre, the sheet's edge is at -x.
        (actual / unshadowed - segment(-x / f64::from(radius))).abs()
    });
    let errors: Vec<f64> = errors.collect();
    (errors.iter().sum::<f64>() / errors.len() as f64, errors.iter().copied().fold(0.0, f64::max))
}

/// Of a point's disk, and of a sun's: at distance 1, as is the sheet, both are as large.
#[gpu_test]
fn gpu_penumbras_are_the_visible_fraction_of_the_disk(gpu: &Gpu) {
    let (of_point, camera) = edge();
    let mut of_sun = of_point.clone();
    of_sun.lights = vec![Light::directional(Vec3::NEG_Z, Vec3::splat(8.0))];
    let diameter = 2.0 * RADIUS.atan().to_degrees();
    let point = |rays, size: f32| soft(rays).with_light_radius(size * RADIUS);
    let sun = |rays, size: f32| point(rays, 0.0).with_sun_diameter(size * diameter);
    for (name, scene) in [("a point", of_point), ("a sun", of_sun)] {
        let sized = |rays, size| if name == "a sun" { sun(rays, size) } else { point(rays, size) };
        let of = |settings| luminance(gpu, &scene, &camera, settings, SIZE);
        let unshadowed = of(Settings::direct_light().with_shadows(Shadows::None));
        let off = |settings| off(&of(settings), &unshadowed, RADIUS);
        let [few, some, many] = [4, 16, 255].map(|rays| off(sized(rays, 1.0)));
        let converged = off(sized(16, 1.0).with_accumulate(32));
        println!(
            "{name}: mean and largest error: 4 rays {few:?}, 16 {some:?}, 255 {many:?}, 32 frames of 16 {converged:?}"
        );
        // The point's disk is tilted by up to 0.15 m, which is a visibility of 0.01; lines across 255 even points differ by up to two of them.
        assert!(many.1 < 0.03 && converged.1 < 0.02, "{name}: {many:?} {converged:?}");
        assert!(some.0 < 0.03 && some.0 < few.0 && many.0 < some.0, "{name}: {few:?} {some:?} {many:?}");
        // The test can fail: with another size, and with hard shadows.
        assert!(off(sized(255, 1.2)).1 > 0.04 && off(sized(255, 0.0)).1 > 0.4, "{name}");
        // With several samples per pixel the rays start in shading; the sums are the same.
        let samples = off(sized(255, 1.0).with_samples(Samples::Four));
        assert!(samples.1 < 0.03, "{name}: {samples:?}");
        // The same for sampled direct light, of one ray to the light in each frame.
        let sampled = |size| {
            let direct = SampledLights { denoise: Denoise::Off, ..SampledLights::default() };
            off(sized(1, size).with_direct(direct).with_accumulate(256))
        };
        let [same, other] = [1.0, 1.2].map(sampled);
        assert!(same.1 < 0.03 && other.1 > 0.04, "{name}: sampled {same:?}, with another size {other:?}");
    }
}

#[gpu_test]
fn gpu_lights_without_a_size_cast_the_same_shadows(gpu: &Gpu) {
    let mut scene = generate::demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    let of = |scene: &Scene, settings| luminance(gpu, scene, &camera, settings, (24, 20));
    let hard = soft(16).with_light_radius(0.0);
    assert!(of(&scene, hard.clone()) != of(&scene, soft(16)), "the radius changes nothing");
    // Unused settings change nothing: rays without a radius, the diameter of suns for points, and the radius of points for suns.
    assert!(of(&scene, hard.clone()) == of(&scene, hard.clone().with_shadow_rays(3)));
    let wide = |settings: &Settings| settings.clone().with_sun_diameter(5.0);
    assert!(of(&scene, hard.clone()) == of(&scene, wide(&hard)));
    assert!(of(&scene, soft(16)) == of(&scene, wide(&soft(16))));
    scene.lights = vec![Light::directional(Vec3::new(0.3, -1.0, -0.4), Vec3::splat(2.0))];
    scene.lights.push(Light::directional(Vec3::new(-0.5, -1.0, -0.8), Vec3::splat(1.0)));
    assert!(of(&scene, hard.clone()) == of(&scene, soft(16)));
    assert!(of(&scene, hard.clone()) != of(&scene, wide(&hard)), "the diameter changes nothing");
}

#[gpu_test]
fn gpu_numbers_that_make_no_sense_are_refused(gpu: &Gpu) {
    let refused = |settings| match Renderer::with_engine(&testing::engine(gpu), settings) {
        Err(RenderError::Together { setting, .. }) => setting,
        other => panic!("{other:?}"),
    };
    for light_radius in [-0.1, f32::NAN, f32::INFINITY] {
        assert_eq!(refused(Settings::direct_light().with_light_radius(light_radius)), "`light-radius`");
    }
    for diameter in [-0.1, 91.0, f32::NAN] {
        assert_eq!(refused(Settings::direct_light().with_sun_diameter(diameter)), "`sun-diameter`");
    }
    assert_eq!(refused(soft(0)), "`shadow-rays`");
    assert_eq!(refused(soft(256)), "`shadow-rays`");
}
