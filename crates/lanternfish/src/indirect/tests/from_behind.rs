//! Light from behind surfaces that scatter it through (`KHR_materials_diffuse_transmission`).

use glam::{UVec2, Vec3, Vec4};
use lanternfish_gpu::testing;
use lanternfish_scene::{AlphaMode, Camera, Image, Light, Material, Sampler, Scene, Texture, TextureRef};

use crate::{
    settings::{Indirect, Samples, Tracer},
    techniques::{Bounces, HitLight, Sampled, SampledLights},
    testing::{
        light::{SIZE, closed_box, image_of, looking, matt, mean, off, sampled, settings, traced_of},
        quad, scene_of,
    },
};

const LARGE: UVec2 = UVec2::new(61, 31);

fn leaf() -> Material {
    Material {
        base_color: Vec4::new(0.3, 0.6, 0.2, 1.0),
        metallic: 0.0,
        perceptual_roughness: 0.6,
        double_sided: true,
        diffuse_transmission: 0.6,
        diffuse_transmission_color: Vec3::new(0.9, 0.7, 0.2),
        ..Material::default()
    }
}

/// Three sheets on a floor between a lamp and the viewer; the middle one has a sheen and a coat. A bar before the lamp shades a part of them.
fn sheets() -> (Scene, Camera) {
    let sheet =
        |material, x: f32| quad(material, Vec3::new(x, 0.6, 0.0), 0.45 * Vec3::new(0.9, 0.0, 0.4), 0.6 * Vec3::Y);
    let layered = Material { sheen_color: Vec3::splat(0.5), sheen_roughness: 0.5, clearcoat: 1.0, ..leaf() };
    let mut scene = scene_of(
        vec![
            sheet(0, -1.0),
            sheet(1, 0.0),
            sheet(0, 1.0),
            quad(2, Vec3::ZERO, 4.0 * Vec3::X, -4.0 * Vec3::Z),
            quad(2, Vec3::new(0.0, 0.8, -0.8), 2.0 * Vec3::X, 0.05 * Vec3::Y),
        ],
        vec![leaf(), layered, matt(0.5)],
    );
    scene.lights = vec![
        Light::point(Vec3::new(0.3, 0.9, -1.6), Vec3::new(9.0, 8.0, 7.0)),
        Light::point(Vec3::new(0.0, 2.0, 1.5), Vec3::splat(0.5)),
    ];
    (scene, looking([0.0, 0.9, 3.0], [0.0, 0.6, 0.0]))
}

/// Asserts that the energy of an image and its pixels are those of the truth, within these limits.
fn agrees(name: &str, found: &[Vec3], truth: &[Vec3], [most_energy, most_apart]: [f64; 2]) {
    let (energy, apart) = (mean(found) / mean(truth), off(found, truth));
    println!("{name}: energy {energy:.4}, off by {apart:.4}");
    assert!((energy - 1.0).abs() < most_energy && apart < most_apart, "{name}: {energy}, {apart}");
}

/// Direct light from behind is the path tracer's, from lists and from samples, with hard shadows.
#[gpu_test]
fn gpu_lights_behind_a_leaf_shine_through(gpu: &Gpu) {
    let (scene, camera) = sheets();
    let truth = traced_of(LARGE, &scene, &camera, 2, 64);
    let listed = settings(sampled(Tracer::BVH)).with_range_threshold(1e-6);
    let listed = listed.with_indirect(Indirect::NONE);
    let drawn = listed.clone().with_direct(SampledLights::default());
    // With one sample a pixel most of the difference is at edges of shadows.
    let several = listed.with_samples(Samples::Four);
    for (name, settings, most) in [("listed", several, 0.12), ("sampled", drawn, 0.25)] {
        agrees(name, &image_of(gpu, LARGE, settings, &scene, &camera), &truth, [0.02, most]);
    }
    // The check can fail: without light from behind most is missing.
    let mut opaque = scene.clone();
    opaque.materials.iter_mut().for_each(|material| material.diffuse_transmission_color = Vec3::ZERO);
    let found = traced_of(LARGE, &opaque, &camera, 2, 16);
    assert!(mean(&found) < 0.9 * mean(&truth), "{} {}", mean(&found), mean(&truth));
}

/// So is light of the sky and of other surfaces. A shell that scatters all light through is as bright inside as the sky, but for what its albedo takes; the
/// light of its other side is that of rays which hit it from inside.
#[gpu_test(full)]
fn gpu_the_sky_behind_a_leaf_shines_through(gpu: &Gpu) {
    let (mut scene, camera) = sheets();
    scene.lights.truncate(1);
    scene.sky = Vec3::new(0.2, 0.3, 0.5);
    let tint = Vec3::new(0.8, 0.6, 0.4);
    let shell = Material { diffuse_transmission: 1.0, diffuse_transmission_color: tint, specular: 0.0, ..leaf() };
    let shell = Scene { sky: Vec3::ONE, ..closed_box(shell) };
    for (name, scene, camera, size, within) in [
        ("sheets", scene, camera, LARGE, [0.02, 0.05]),
        ("shell", shell, looking([2.0, 2.5, 3.0], [0.0, 0.0, 0.0]), SIZE, [0.03, 0.06]),
    ] {
        // A ray from inside meets the light that one wall lets through.
        let truth = traced_of(size, &scene, &camera, 3, 256);
        agrees(name, &image_of(gpu, size, settings(sampled(Tracer::BVH)), &scene, &camera), &truth, within);
    }
}

/// Textures say where and in which colour; masked-out parts show nothing.
#[gpu_test]
fn gpu_textures_of_diffuse_transmission_are_read(gpu: &Gpu) {
    let (_, camera) = sheets();
    let rgba = |texels: [[u8; 4]; 4]| Image { name: String::new(), width: 2, height: 2, rgba: texels.concat() };
    let textured = Material {
        base_color_texture: Some(TextureRef::new(2)),
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        diffuse_transmission_texture: Some(TextureRef::new(0)),
        diffuse_transmission_color_texture: Some(TextureRef::new(1)),
        ..leaf()
    };
    let mut scene = scene_of(vec![quad(0, Vec3::new(0.0, 0.6, 0.0), 0.9 * Vec3::X, 0.5 * Vec3::Y)], vec![textured]);
    scene.images = vec![
        rgba([[0, 0, 0, 255], [0, 0, 0, 60], [0, 0, 0, 0], [0, 0, 0, 200]]),
        rgba([[255, 255, 255, 0], [255, 60, 60, 0], [60, 255, 60, 0], [90, 90, 255, 0]]),
        rgba([[255; 4], [255; 4], [255; 4], [255, 255, 255, 0]]),
    ];
    scene.samplers = vec![Sampler::default()];
    scene.textures = (0..3).map(|image| Texture { image, sampler: 0 }).collect();
    scene.lights = vec![Light::directional(Vec3::new(0.2, 0.1, 1.0), Vec3::splat(5.0))];
    let truth = traced_of(SIZE, &scene, &camera, 2, 64);
    let direct = settings(sampled(Tracer::BVH)).with_indirect(Indirect::NONE);
    agrees("textures", &image_of(gpu, SIZE, direct, &scene, &camera), &truth, [0.05, 0.15]);
}

/// Light goes through a closed shell, and from wall to wall inside, many times.
#[gpu_test]
fn gpu_light_in_a_shell_bounces_many_times(gpu: &Gpu) {
    let white = Material { diffuse_transmission: 0.5, diffuse_transmission_color: Vec3::splat(0.9), ..leaf() };
    let white = Material { base_color: Vec4::new(0.9, 0.9, 0.9, 1.0), specular: 0.0, ..white };
    let (scene, camera) = (Scene { sky: Vec3::ONE, ..closed_box(white) }, looking([2.0, 2.5, 3.0], [0.0, 0.0, 0.0]));
    let rays = Sampled { hit_light: HitLight::Cached, bounces: Bounces::All, ..sampled(Tracer::BVH) };
    let [truth, of_one] = [32, 3].map(|depth| traced_of(SIZE, &scene, &camera, depth, 128));
    agrees("shell", &image_of(gpu, SIZE, settings(rays), &scene, &camera), &truth, [0.02, 0.06]);
    assert!(mean(&of_one) < 0.95 * mean(&truth), "{} {}", mean(&of_one), mean(&truth));
}
