//! What glossy rays show of the surfaces that they hit.

use glam::{UVec2, Vec3, Vec4};
use lanternfish_gpu::testing;
use lanternfish_scene::{Camera, Image, Light, Material, Sampler, Scene, Texture, TextureRef};

use crate::{
    settings::Tracer,
    techniques::{Bounces, HitLight, Sampled},
    testing::{
        light::{image_of, looking, matt, mean, off, sampled, settings, traced_of},
        quad, scene_of,
    },
};

const SIZE: UVec2 = UVec2::new(96, 48);

/// A mirror, seen from the front, before a wall with stripes much narrower than a voxel of the radiance cache, behind the viewer.
fn striped_wall_in_a_mirror(far_lights: usize) -> (Scene, Camera) {
    let mirror = Material { metallic: 1.0, perceptual_roughness: 0.0, ..matt(0.9) };
    let striped = Material { base_color_texture: Some(TextureRef::new(0)), base_color: Vec4::ONE, ..matt(0.8) };
    let mut scene = scene_of(
        vec![
            quad(0, Vec3::new(0.0, 0.0, -1.0), Vec3::X, Vec3::Y),
            quad(1, Vec3::new(0.0, 0.0, 3.0), -2.0 * Vec3::X, 2.0 * Vec3::Y),
            // The scene, and its voxels, are large.
            quad(2, Vec3::new(0.0, -12.0, 0.0), 40.0 * Vec3::X, -40.0 * Vec3::Z),
        ],
        vec![mirror, striped, matt(0.5)],
    );
    // Eight texels a stripe: hits read textures without interpolation.
    let texel = |x: usize| if (x / 8).is_multiple_of(2) { [255, 255, 255, 255] } else { [10, 10, 10, 255] };
    scene.images = vec![Image { name: String::new(), width: 64, height: 1, rgba: (0..64).flat_map(texel).collect() }];
    scene.samplers = vec![Sampler::default()];
    scene.textures = vec![Texture { image: 0, sampler: 0 }];
    scene.lights = vec![Light::directional(Vec3::new(0.3, -0.2, 1.0), Vec3::splat(3.0))];
    scene.lights.extend((0..far_lights).map(|_| Light::point(Vec3::new(0.0, 900.0, 0.0), Vec3::splat(1e-3))));
    scene.sky = Vec3::splat(0.2);
    (scene, looking([0.0, 0.0, 0.4], [0.0, 0.0, -1.0]))
}

/// A mirror shows textures and shadows as they are, not the voxels of the radiance cache, from which it has the further bounces.
#[gpu_test]
fn gpu_mirrors_show_what_is_narrower_than_a_voxel(gpu: &Gpu) {
    let rays = Sampled { hit_light: HitLight::Cached, bounces: Bounces::All, ..sampled(Tracer::BVH) };
    let of = |far_lights| {
        let (scene, camera) = striped_wall_in_a_mirror(far_lights);
        let truth = traced_of(SIZE, &scene, &camera, 12, 64);
        let found = image_of(gpu, SIZE, settings(rays), &scene, &camera);
        (mean(&found) / mean(&truth), off(&found, &truth))
    };
    // With many lights hits are read from the cache, and the stripes are lost: the check can fail.
    let [few, many] = [0, 20].map(of);
    println!("energy and error: {few:.4?}, with many lights {many:.4?}");
    assert!((few.0 - 1.0).abs() < 0.03 && few.1 < 0.15 && many.1 > 0.3, "{few:?}, {many:?}");
}
