//! Emissive triangles.

use super::*;
use crate::techniques::{Denoise, SampledLights};

/// A square lamp of this half edge above the middle of a floor, facing it.
fn lamp_over_floor(half: f32, height: f32, radiance: f32, floor: Material) -> Scene {
    let lamp = Material { emissive: Vec3::splat(radiance), double_sided: false, ..matt(0.0) };
    let ground = quad(0, Vec3::ZERO, 4.0 * Vec3::X, -4.0 * Vec3::Z);
    scene_of(vec![ground, quad(1, height * Vec3::Y, half * Vec3::X, half * Vec3::Z)], vec![floor, lamp])
}

/// A lamp that less than one of a thousand rays hits lights every pixel correctly.
#[gpu_test]
fn gpu_a_small_lamp_lights_every_pixel(gpu: &Gpu) {
    let (half, height, radiance) = (0.01f32, 1.0f32, 1000.0f32);
    let scene = lamp_over_floor(half, height, radiance, matt(0.5));
    let camera = looking([0.0, 0.9, 0.1], [0.0, 0.0, 0.0]);
    let few = Sampled { diffuse_rays: 2, glossy_rays: 0, ..sampled(Tracer::BVH) };
    let actual = rendering(gpu, settings(few), &scene, &camera);
    // Straight below: L A / d² lux on a surface of albedo 0.5.
    let below = 0.5 / std::f32::consts::PI * radiance * 4.0 * half * half / (height * height);
    let middle = actual[SIZE.x as usize * (SIZE.y as usize / 2) + SIZE.x as usize / 2].x;
    assert!((middle / below - 1.0).abs() < 0.03, "{middle}, not {below}");
    assert!(actual.iter().all(|pixel| pixel.x > 0.3 * below), "a pixel is dark");
}

/// Rays that hit lamps count emission once, together with rays to lamps or with sampled direct light, on matt and on glossy floors, for large and small lamps.
#[gpu_test]
fn gpu_emission_is_neither_lost_nor_counted_twice(gpu: &Gpu) {
    let camera = looking([0.0, 0.8, 1.6], [0.0, 0.0, 0.0]);
    let unfiltered = Direct::from(SampledLights { denoise: Denoise::Off, ..SampledLights::default() });
    let metal = Material { metallic: 1.0, perceptual_roughness: 0.35, ..matt(0.8) };
    for (name, floor) in [("matt", matt(0.5)), ("metal", metal)] {
        for (half, height, diffuse_rays, glossy_rays) in [(0.5, 1.0, 16, 16), (0.05, 0.6, 32, 8), (1.0, 0.3, 16, 16)] {
            let scene = lamp_over_floor(half, height, 10.0, floor.clone());
            let rays = Sampled { diffuse_rays, glossy_rays, ..sampled(Tracer::BVH) };
            let expected = mean(&traced(&scene, &camera, 2, 256));
            for direct in [Direct::NONE, unfiltered.clone()] {
                let of_direct = settings(rays).with_direct(direct.clone());
                let energy = mean(&rendering(gpu, of_direct, &scene, &camera)) / expected;
                println!(
                    "{name}, lamp of {half} at {height}, {diffuse_rays} and {glossy_rays}, {direct:?}: {energy:.4}"
                );
                assert!((energy - 1.0).abs() < 0.03, "{name}, lamp of {half} at {height}, {direct:?}: {energy}");
            }
        }
    }
}

/// Areas and emission whose products overflow 32-bit floats give finite radiance.
#[gpu_test]
fn gpu_extreme_lamps_give_finite_radiance(gpu: &Gpu) {
    let camera = looking([0.0, 0.8, 1.6], [0.0, 0.0, 0.0]);
    let few = Sampled { diffuse_rays: 4, glossy_rays: 2, ..sampled(Tracer::BVH) };
    for (half, radiance) in [(1e11, 1.0), (0.5, f32::MAX), (1e11, f32::MAX)] {
        let mut scene = lamp_over_floor(half, 1.0, radiance, matt(0.5));
        scene.meshes[0].primitives[1].normals = vec![Vec3::NEG_Y; 4];
        // Another lamp, so that the tree has a choice.
        scene.meshes[0].primitives.push(quad(1, Vec3::new(1.0, 0.5, 0.0), 0.1 * Vec3::X, 0.1 * Vec3::Z));
        let actual = rendering(gpu, settings(few), &scene, &camera);
        assert!(actual.iter().all(|pixel| pixel.is_finite()), "lamp of {half} m and {radiance} nits");
        // Rays miss a triangle whose coordinates have no precision of a metre; the light of the other lamp must remain.
        assert!(mean(&actual) > 1e-3, "lamp of {half} m and {radiance} nits: {}", mean(&actual));
    }
}

/// Emission is also reflected by the walls onto the floor.
#[gpu_test]
fn gpu_emission_is_reflected_once(gpu: &Gpu) {
    let mut scene = closed_box(matt(0.5));
    let lamp = Material { emissive: Vec3::new(30.0, 20.0, 10.0), double_sided: false, ..matt(0.0) };
    scene.materials.push(lamp);
    scene.meshes[0].primitives.push(quad(1, Vec3::new(0.2, 0.5, 0.0), 0.1 * Vec3::X, 0.1 * Vec3::Z));
    let camera = looking([0.0, -0.2, 0.9], [0.0, -0.9, -1.0]);
    let [direct, ground_truth] = [2, 3].map(|depth| traced(&scene, &camera, depth, 256));
    assert!(mean(&ground_truth) > 1.05 * mean(&direct), "{} of {} is reflected", mean(&ground_truth), mean(&direct));
    for tracer in tracers(gpu) {
        let actual = rendering(gpu, settings(sampled(tracer)), &scene, &camera);
        let energy = mean(&actual) / mean(&ground_truth);
        println!("{tracer}: energy {energy:.4}");
        let most = 0.03;
        assert!((energy - 1.0).abs() < most, "{tracer}: {energy}");
    }
}
