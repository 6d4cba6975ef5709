//! Refraction against the path tracer and in uniform light.

use glam::{UVec2, Vec3, Vec4};
use lanternfish_gpu::testing;
use lanternfish_scene::{AlphaMode, Bounds, Camera, Light, Material, Scene, generate::demo};

use super::{MOST_IMAGES, split_for_images};
use crate::{
    gpu_scene::{Draw, DrawAlpha, Facing, ImageBehind, Lobes},
    settings::{Samples, Tracer},
    testing::{
        image,
        light::{image_of, looking, mean, off, sampled, settings, traced_of},
        quad, scene_of,
    },
};

const SIZE: UVec2 = UVec2::new(102, 48);

/// Clear glass, rougher from sphere to sphere: in the first row volumes up to 0.71, in the second thin glass up to 0.36.
fn glass(index: usize) -> Material {
    Material {
        metallic: 0.0,
        perceptual_roughness: (index % 6) as f32 / if index < 6 { 7.0 } else { 14.0 },
        transmission: 1.0,
        thickness: if index < 6 { 1.0 } else { 0.0 },
        alpha_mode: AlphaMode::Blend,
        ..Material::default()
    }
}

/// Two rows of spheres.
fn spheres(material: impl Fn(usize) -> Material) -> (Scene, Camera) {
    let mut scene = demo("furnace").unwrap();
    scene.lights = Vec::new();
    scene.materials.iter_mut().enumerate().for_each(|(i, slot)| *slot = material(i));
    (scene, looking([0.0, 0.0, 4.2], [0.0, 0.0, 0.0]))
}

/// The two halves of an image.
fn rows(pixels: &[Vec3]) -> [&[Vec3]; 2] {
    let (top, bottom) = pixels.split_at(pixels.len() / 2);
    [top, bottom]
}

/// Smooth glass changes nothing where light comes equally from everywhere, and rough glass adds nothing.
#[gpu_test]
fn gpu_clear_glass_is_invisible_in_uniform_light(gpu: &Gpu) {
    let (mut scene, camera) = spheres(glass);
    scene.sky = Vec3::ONE;
    let drawn = |samples| image_of(gpu, SIZE, settings(sampled(Tracer::BVH)).with_samples(samples), &scene, &camera);
    let one = drawn(Samples::One);
    // The darkest pixel of the left third, where glass is smoothest, and the brightest of all.
    let least = one.iter().enumerate().filter(|(i, _)| i % 102 < 34).map(|(_, p)| p.x).reduce(f32::min).unwrap();
    let most = one.iter().map(|p| p.x).reduce(f32::max).unwrap();
    assert!(least > 0.95 && most < 1.02, "{least} to {most}");
    // At edges, reflections are those of another sample of the pixel.
    let four = mean(&drawn(Samples::Four));
    assert!((four / mean(&one) - 1.0).abs() < 0.01, "{four}, {}", mean(&one));
}

/// Spheres of glass under bands of light show what the path tracer's do, upside down.
#[gpu_test]
fn gpu_glass_agrees_with_the_path_tracer(gpu: &Gpu) {
    let (mut scene, camera) = spheres(glass);
    scene.sky = Vec3::ZERO;
    // Brighter from below.
    scene.environment = Some(image(256, 128, 0.0, |d| Vec3::splat(1.3 - 0.8 * d.y + 0.4 * (8.0 * d.x).sin())));
    let (thin, _) = spheres(|i| Material { thickness: 0.0, perceptual_roughness: 0.0, ..glass(i) });
    let thin = Scene { environment: scene.environment.clone(), sky: Vec3::ZERO, ..thin };
    let drawn = |scene| image_of(gpu, SIZE, settings(sampled(Tracer::BVH)), scene, &camera);
    let (actual, straight) = (drawn(&scene), drawn(&thin));
    let truth = traced_of(SIZE, &scene, &camera, 8, 128);
    for (row, ((actual, straight), truth)) in
        rows(&actual).into_iter().zip(rows(&straight)).zip(rows(&truth)).enumerate()
    {
        let (energy, error, without) = (mean(actual) / mean(truth), off(actual, truth), off(straight, truth));
        println!("row {row}: energy {energy:.4}, difference {error:.4}, as thin smooth glass {without:.4}");
        assert!((energy - 1.0).abs() < 0.03, "row {row}: {energy}");
        assert!(error < 0.06 && (row == 1 || error < 0.4 * without), "row {row}: {error}, {without}");
    }
}

/// Red and blue light are refracted apart as in the path tracer: where the environment is brighter below than above, one half of a ball is red
/// and the other is blue. The separation is 1.3 times the path tracer's, presumably for want of Fresnel reflection at the far boundary.
#[gpu_test]
fn gpu_dispersion_agrees_with_the_path_tracer(gpu: &Gpu) {
    let ball = |dispersion| move |i| Material { dispersion, thickness: 1.0, perceptual_roughness: 0.1, ..glass(i) };
    let environment = image(256, 128, 0.0, |d| Vec3::splat(1.3 - d.y));
    let of = |dispersion: f32| {
        let (scene, camera) = spheres(ball(dispersion));
        (Scene { environment: Some(environment.clone()), sky: Vec3::ZERO, ..scene }, camera)
    };
    // The mean of red less blue, positive in the upper halves of the rows and negative in the lower.
    let apart = |pixels: &[Vec3]| {
        let signed = |(i, p): (usize, &Vec3)| f64::from(if (i / 102) % 24 < 12 { p.x - p.z } else { p.z - p.x });
        pixels.iter().enumerate().map(signed).sum::<f64>() / pixels.len() as f64
    };
    let drawn = |dispersion| {
        let (scene, camera) = of(dispersion);
        apart(&image_of(gpu, SIZE, settings(sampled(Tracer::BVH)), &scene, &camera))
    };
    let (scene, camera) = of(8.0);
    let (actual, without) = (drawn(8.0), drawn(0.0));
    let truth = apart(&traced_of(SIZE, &scene, &camera, 8, 128));
    println!("red less blue {actual:.5}, path tracer {truth:.5}, without dispersion {without:.5}");
    assert!(without.abs() < 0.01 * truth.abs() && (actual / truth - 1.0).abs() < 0.4, "{actual}, {truth}, {without}");
}

/// A lamp behind a frosted sheet shines through it, towards where the path tracer says.
#[gpu_test]
fn gpu_lamps_shine_through_frosted_sheets(gpu: &Gpu) {
    let sheet = Material { base_color: Vec4::new(0.9, 0.6, 0.3, 1.0), perceptual_roughness: 0.4, ..glass(6) };
    let mut scene = scene_of(vec![quad(0, Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y)], vec![sheet]);
    scene.lights = vec![Light::point(Vec3::new(0.3, 0.2, -1.0), Vec3::splat(2.0))];
    let camera = looking([0.0, 0.0, 3.0], [0.0, 0.0, 0.0]);
    let drawn = image_of(gpu, SIZE, settings(sampled(Tracer::BVH)), &scene, &camera);
    let truth = traced_of(SIZE, &scene, &camera, 2, 16);
    let (energy, error) = (mean(&drawn) / mean(&truth), off(&drawn, &truth));
    assert!(mean(&truth) > 1e-3 && (energy - 1.0).abs() < 0.02 && error < 0.04, "{energy}, {error}");
}

/// A slab of coloured glass absorbs by the length of the way through it, in the middle of an image without an environment too.
#[gpu_test]
fn gpu_a_slab_absorbs_by_distance(gpu: &Gpu) {
    let lamp = Material { emissive: Vec3::ONE, base_color: Vec3::ZERO.extend(1.0), ..Material::default() };
    let body =
        Material { ior: 1.0, attenuation_color: Vec3::new(0.5, 0.25, 1.0), attenuation_distance: 1.0, ..glass(0) };
    let slab = |front: f32, back: f32| {
        vec![
            quad(0, -3.0 * Vec3::Z, 20.0 * Vec3::X, 20.0 * Vec3::Y),
            quad(1, front * Vec3::Z, 5.0 * Vec3::X, 5.0 * Vec3::Y),
            quad(1, back * Vec3::Z, 5.0 * Vec3::Y, 5.0 * Vec3::X),
        ]
    };
    let camera = looking([0.0, 0.0, 4.0], [0.0, 0.0, 0.0]);
    for depth in [0.5, 2.0] {
        let scene = scene_of(slab(1.0, 1.0 - depth), vec![lamp.clone(), body.clone()]);
        let size = UVec2::new(9, 9);
        let drawn = image_of(gpu, size, settings(sampled(Tracer::BVH)), &scene, &camera);
        let expected = Vec3::new(0.5, 0.25, 1.0).powf(depth);
        let actual = drawn[4 * 9 + 4];
        assert!(actual.abs_diff_eq(expected, 0.01), "{depth} m: {actual}, not {expected}");
    }
}

/// The nearest refracting draws have an image each; the farther ones share the first.
#[test]
fn the_nearest_draws_see_one_another() {
    let draw = |behind| Draw {
        indices: 0..0,
        base_vertex: 0,
        instances: 0..0,
        material: 0,
        alpha: DrawAlpha::Transparent,
        behind,
        lobes: Lobes::MetallicRoughness,
        scatters_from_behind: false,
        facing: Facing { side: None, mirrored: false },
        bounds: Bounds::EMPTY,
    };
    let [covers, refracts] = [ImageBehind::Covers, ImageBehind::Refracts].map(draw);
    let split = |draws: &[&Draw]| {
        let runs: Vec<&[&Draw]> = draws.chunks(1).collect();
        split_for_images(&runs).iter().map(|(needs_image, runs)| (*needs_image, runs.len())).collect::<Vec<_>>()
    };
    assert_eq!(split(&[&covers, &covers]), [(false, 2)]);
    assert_eq!(split(&[&refracts, &covers]), [(true, 2)]);
    assert_eq!(split(&[&covers, &refracts, &covers, &refracts]), [(false, 1), (true, 2), (true, 1)]);
    let many = split(&[&refracts; MOST_IMAGES + 3]);
    assert_eq!(many.len(), MOST_IMAGES);
    assert_eq!(many[0], (true, 4));
}
