//! Clear coats mirror indirect light and the environment with their own roughness and normal.

use glam::{UVec2, Vec3, Vec4};
use lanternfish_gpu::testing;
use lanternfish_scene::{Camera, Image, Light, Material, Sampler, Scene, Texture, TextureRef, generate::demo};

use crate::{
    Settings,
    settings::Tracer,
    testing::{
        apart, image,
        light::{SIZE, image_of, looking, mean, off, rendering, sampled, settings, traced},
        quad, scene_of,
    },
};

/// 2,448 pixels of each row of spheres.
const LARGE: UVec2 = UVec2::new(102, 48);

/// Two rows of coated spheres, the coat's roughness from 0 (left) to 1 (right): above a black surface, and above a rough grey one.
fn spheres() -> (Scene, Camera) {
    let mut scene = demo("furnace").unwrap();
    scene.lights.clear();
    for (i, material) in scene.materials.iter_mut().enumerate() {
        let is_black = i < 6;
        *material = Material {
            base_color: if is_black { Vec4::W } else { Vec3::splat(0.5).extend(1.0) },
            metallic: 0.0,
            specular: if is_black { 0.0 } else { 1.0 },
            perceptual_roughness: 0.9,
            clearcoat: 1.0,
            clearcoat_roughness: (i % 6) as f32 / 5.0,
            ..Material::default()
        };
    }
    let camera = looking([0.0, 0.0, 4.2], [0.0, 0.0, 0.0]);
    (scene, camera)
}

/// Under an environment with bright and dark bands a coat above black is a specular layer of its own roughness.
#[gpu_test]
fn gpu_coats_mirror_the_environment_with_their_own_roughness(gpu: &Gpu) {
    let (mut coated, camera) = spheres();
    coated.sky = Vec3::ZERO;
    // Black behind the spheres, which the camera sees.
    let bands = |d: Vec3| Vec3::splat((1.0 + (12.0 * d.y).cos()) * ((d.z + 0.7) / 1.2).clamp(0.0, 1.0));
    coated.environment = Some(image(256, 128, 0.0, bands));
    let mut plain = coated.clone();
    for material in &mut plain.materials {
        (material.perceptual_roughness, material.specular) = (material.clearcoat_roughness, 1.0);
        material.clearcoat = 0.0;
    }
    let upper = |scene| image_of(gpu, LARGE, settings(sampled(Tracer::BVH)), scene, &camera)[..2448].to_vec();
    let apart = off(&upper(&coated), &upper(&plain));
    // A quarter above the measured difference, which is noise. A coat as blurred as the surface below is off by ten times as much.
    assert!(apart < 0.02, "off by {apart}");
}

/// A smooth coat above a rough surface mirrors a lamp with a sharp border.
#[gpu_test]
fn gpu_coats_mirror_surfaces_sharply(gpu: &Gpu) {
    let coated = Material {
        base_color: Vec4::W,
        metallic: 0.0,
        specular: 0.0,
        perceptual_roughness: 1.0,
        clearcoat: 1.0,
        ..Material::default()
    };
    let lamp = Material { emissive: Vec3::splat(25.0), base_color: Vec4::W, double_sided: true, ..Material::default() };
    let floor = quad(0, Vec3::ZERO, 10.0 * Vec3::X, -10.0 * Vec3::Z);
    let ceiling = quad(1, Vec3::new(5.0, 2.0, 0.0), 5.0 * Vec3::X, 10.0 * Vec3::Z);
    let scene = scene_of(vec![floor, ceiling], vec![coated, lamp]);
    let camera = looking([0.0, 1.5, 0.1], [0.0, 0.0, 0.0]);
    let actual = rendering(gpu, settings(sampled(Tracer::BVH)), &scene, &camera);
    // 4 % of the lamp at its normal, on the right; a few per cent more towards the image's corners.
    for row in actual.chunks(SIZE.x as usize) {
        let (dark, bright) = (row.iter().filter(|p| p.x < 0.02), row.iter().filter(|p| (0.96..1.2).contains(&p.x)));
        let (dark, bright) = (dark.count(), bright.count());
        assert!(dark >= 14 && bright >= 14, "{dark} dark and {bright} bright pixels: {row:?}");
    }
}

/// Uniform light: no coated surface is brighter than it, and a white one below a coat loses at most 5 %.
#[gpu_test]
fn gpu_coats_do_not_gain_energy(gpu: &Gpu) {
    let (mut scene, camera) = spheres();
    scene.materials.iter_mut().for_each(|material| (material.base_color, material.specular) = (Vec4::ONE, 1.0));
    let actual = image_of(gpu, LARGE, settings(sampled(Tracer::BVH)), &scene, &camera);
    let (least, most) = actual.iter().fold((1.0f32, 0.0f32), |(a, b), pixel| (a.min(pixel.x), b.max(pixel.x)));
    println!("{least:.4} to {most:.4}, mean {:.4}", mean(&actual));
    assert!(most <= 1.02 && mean(&actual) > 0.95, "{least} to {most}");
}

/// The normal map of a coat tilts the coat alone, in the renderer as in the path tracer.
#[gpu_test]
fn gpu_normal_maps_of_coats_tilt_coats_alone(gpu: &Gpu) {
    let coated = Material {
        base_color: Vec4::W,
        metallic: 0.0,
        specular: 0.0,
        clearcoat: 1.0,
        clearcoat_roughness: 0.5,
        ..Material::default()
    };
    let mut sheet = quad(0, Vec3::ZERO, Vec3::X, Vec3::Y);
    sheet.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4];
    let scene = |scale: Option<f32>| {
        let mut material = coated.clone();
        if let Some(scale) = scale {
            material.clearcoat_normal_texture = Some(TextureRef::new(0));
            material.clearcoat_normal_scale = scale;
        }
        let mut scene = apart(&scene_of(vec![sheet.clone()], vec![material]));
        scene.lights.push(Light::directional(Vec3::new(0.3, 0.1, -1.0), Vec3::splat(3.0)));
        scene.images.push(Image { name: String::new(), width: 1, height: 1, rgba: vec![90, 110, 240, 255] });
        scene.samplers.push(Sampler::default());
        scene.textures.push(Texture { image: 0, sampler: 0 });
        scene
    };
    let camera = looking([0.0, 0.0, 2.0], [0.0, 0.0, 0.0]);
    let drawn = |scale| mean(&rendering(gpu, Settings::direct_light(), &scene(scale), &camera));
    let truth = |scale| mean(&traced(&scene(scale), &camera, 2, 64));
    let [without, flat, tilted] = [None, Some(0.0), Some(1.0)].map(drawn);
    println!("without {without:.4}, flat {flat:.4}, tilted {tilted:.4}, traced {:.4}", truth(Some(1.0)));
    assert!((flat / without - 1.0).abs() < 1e-3 && (tilted / without - 1.0).abs() > 0.1);
    for scale in [None, Some(1.0)] {
        let ratio = drawn(scale) / truth(scale);
        assert!((ratio - 1.0).abs() < 0.02, "{scale:?}: {ratio}");
    }
}
