//! Sheen, a grain and thin films under an environment and a light.

use glam::{UVec2, Vec3};
use lanternfish_gpu::testing;
use lanternfish_scene::{Camera, Light, Material, Scene, generate::demo};

use crate::{
    settings::Tracer,
    testing::{
        image,
        light::{image_of, looking, mean, off, sampled, settings, traced_of},
    },
};

const SIZE: UVec2 = UVec2::new(102, 48);

/// Two rows of spheres with a white and a dark base, the roughness of their lobe from 0 (left) to 1 (right).
fn spheres(lobe: impl Fn(&mut Material, f32)) -> (Scene, Camera) {
    let mut scene = demo("furnace").unwrap();
    scene.lights = vec![Light::directional(Vec3::new(-0.5, -0.6, -1.0), Vec3::splat(1.5))];
    scene.sky = Vec3::ZERO;
    // Bands, black behind the spheres.
    let bands = |d: Vec3| Vec3::splat((1.0 + (12.0 * d.y).cos()) * ((d.z + 0.7) / 1.2).clamp(0.0, 1.0));
    scene.environment = Some(image(256, 128, 0.0, bands));
    for (i, material) in scene.materials.iter_mut().enumerate() {
        let base_color = Vec3::splat(if i < 6 { 0.8 } else { 0.1 }).extend(1.0);
        *material = Material { base_color, metallic: 0.0, perceptual_roughness: 0.6, ..Material::default() };
        lobe(material, (i % 6) as f32 / 5.0);
    }
    (scene, looking([0.0, 0.0, 4.2], [0.0, 0.0, 0.0]))
}

/// The energy of each row, relative to the path tracer's, is that of the row without the lobe within `tolerance`, and the lobe changes at least
/// a row by more than that. Images of spheres this small lack up to 3 % at their edges, with and without a lobe.
fn agrees(name: &str, tolerance: f64, lobe: impl Fn(&mut Material, f32)) {
    let Some(gpu) = testing::gpu(name) else { return };
    let (scene, camera) = spheres(lobe);
    let (plain, _) = spheres(|_, _| {});
    let drawn = |scene| image_of(gpu, SIZE, settings(sampled(Tracer::BVH)), scene, &camera);
    let (actual, without) = (drawn(&scene), drawn(&plain));
    let [truth, truth_without] = [&scene, &plain].map(|scene| traced_of(SIZE, scene, &camera, 3, 256));
    let mut change = 0.0f64;
    for row in 0..2 {
        let half = |pixels: &[Vec3]| {
            let middle = pixels.len() / 2;
            mean(if row == 0 { &pixels[..middle] } else { &pixels[middle..] })
        };
        let (energy, energy_without) = (half(&actual) / half(&truth), half(&without) / half(&truth_without));
        change = change.max((half(&actual) / half(&without) - 1.0).abs());
        let apart = [(&actual, &truth), (&without, &truth_without)].map(|(a, b)| off(a, b));
        println!("{name}: off by {apart:.4?}");
        println!("{name}, row {row}: energy {energy:.4}, without the lobe {energy_without:.4}");
        assert!((energy / energy_without - 1.0).abs() < tolerance, "{name}, row {row}: {energy}, {energy_without}");
        assert!((energy_without - 1.0).abs() < 0.04, "{name}, row {row}: {energy_without}");
    }
    assert!(change > 2.0 * tolerance, "{name}: the lobe changes {change}");
}

#[test]
fn gpu_sheen_agrees_with_the_path_tracer() {
    agrees("gpu_sheen_agrees_with_the_path_tracer", 0.03, |material, roughness| {
        (material.sheen_color, material.sheen_roughness) = (Vec3::splat(0.9), roughness);
    });
}

#[test]
fn gpu_grains_agree_with_the_path_tracer() {
    agrees("gpu_grains_agree_with_the_path_tracer", 0.03, |material, roughness| {
        (material.metallic, material.perceptual_roughness) = (1.0, 0.2 + 0.4 * roughness);
        (material.anisotropy, material.anisotropy_rotation) = (0.7, 0.5);
    });
}

#[test]
fn gpu_thin_films_agree_with_the_path_tracer() {
    agrees("gpu_thin_films_agree_with_the_path_tracer", 0.03, |material, roughness| {
        material.perceptual_roughness = 0.1 + 0.5 * roughness;
        (material.iridescence, material.iridescence_ior) = (1.0, 1.8);
        material.iridescence_thickness = 150.0 + 500.0 * roughness;
    });
}
