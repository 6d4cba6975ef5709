//! Area lights: disks and rectangles against the path tracer.

use glam::Vec3;
use lanternfish::{
    Settings,
    settings::{DebugView, Samples, Shadows},
    techniques::Sampled,
};
use lanternfish_gpu::Gpu;
use lanternfish_metrics::{RelativeError, RgbImage};
use lanternfish_reference as reference;
use lanternfish_scene::{AlphaMode, Camera, Light, Material, Projection, Scene};

use crate::support::{counter, linear, quad, render, scene_of};

const SIZE: (u32, u32) = (48, 32);

fn surface(base_color: [f32; 3], metallic: f32, perceptual_roughness: f32) -> Material {
    let base_color = Vec3::from(base_color).extend(1.0);
    Material { base_color, metallic, perceptual_roughness, double_sided: true, ..Material::default() }
}

/// A panel, a disk and a point light over a diffuse floor, a glossy and a metal plate, and a sheet that casts a shadow on them.
fn still_life() -> (Scene, Camera) {
    let materials = vec![
        surface([0.8, 0.8, 0.8], 0.0, 1.0),
        surface([0.7, 0.3, 0.2], 0.0, 0.3),
        surface([0.9, 0.7, 0.4], 1.0, 0.4),
        surface([0.3, 0.5, 0.8], 0.0, 0.7),
    ];
    let quads = vec![
        quad(0, Vec3::ZERO, 3.0 * Vec3::X, -3.0 * Vec3::Z),
        quad(1, Vec3::new(-0.8, 0.02, 0.2), 0.7 * Vec3::X, -0.7 * Vec3::Z),
        quad(2, Vec3::new(0.9, 0.4, -0.3), 0.6 * Vec3::X, Vec3::new(0.0, 0.35, -0.4)),
        quad(3, Vec3::new(0.1, 0.7, 0.1), 0.4 * Vec3::X, -0.3 * Vec3::Z),
    ];
    let mut scene = scene_of(quads, materials);
    let panel = Light::rectangle(Vec3::new(-0.4, 1.6, -0.6), Vec3::NEG_Y, Vec3::X, [1.2, 0.4], Vec3::splat(4.0));
    let towards = Vec3::new(-1.0, -0.8, -0.3).normalize();
    let disk = Light::disk(Vec3::new(1.6, 1.1, 0.6), towards, 0.35, Vec3::new(6.0, 5.0, 3.0));
    let point = Light::point(Vec3::new(-1.6, 1.2, 0.8), Vec3::new(0.2, 0.3, 0.5));
    scene.lights = vec![panel, point, disk];
    let projection = Projection::Perspective { fov_y: 0.7, near: 0.05 };
    (scene, Camera::look_at(Vec3::new(0.0, 1.7, 3.2), Vec3::new(0.0, 0.3, 0.0), projection))
}

/// The path tracer's image; with a depth of 2 it has direct light only.
fn ground_truth(scene: &Scene, camera: &Camera, max_depth: u32, samples: u64) -> RgbImage {
    let settings = reference::Settings { max_depth, ..reference::Settings::default() };
    let tracer = reference::Tracer::new(scene, settings).unwrap();
    let mut film = reference::Film::new(SIZE.into()).unwrap();
    tracer.render(camera, &mut film, samples);
    RgbImage::new(SIZE.0 as usize, SIZE.1 as usize, film.mean()).unwrap()
}

fn compare(name: &str, actual: &RgbImage, ground_truth: &RgbImage) -> RelativeError {
    let error = RelativeError::measure(actual, ground_truth, 1e-3).unwrap();
    println!(
        "{name}: median {:.3} %, {:.2} % within 5 %, energy {:+.3} %",
        100.0 * error.median(),
        100.0 * error.fraction_within(0.05),
        100.0 * (error.energy_ratio() - 1.0)
    );
    error
}

fn accumulated(gpu: &Gpu, scene: &Scene, camera: &Camera, settings: Settings) -> RgbImage {
    linear(&render(gpu, scene, camera, SIZE, settings))
}

#[gpu_test(crate::gpu)]
fn gpu_area_lights_are_the_path_tracers(gpu: &Gpu) {
    let (scene, camera) = still_life();
    let expected = ground_truth(&scene, &camera, 2, 1024);
    let settings = |frames| Settings::direct_light().with_accumulate(frames).with_shadows(Shadows::BVH);
    for (name, settings, within) in [
        // The noise of both is 0.6 % at the median. Fewer frames than 64 smooth edges less: 90 % with 16.
        ("64 frames of 16 rays", settings(64), 0.97),
        // Lights of all kinds have more shadow bits with a radius.
        ("beside soft shadows", settings(16).with_light_radius(1e-3), 0.87),
        // Surfaces at edges use the rays of a neighbour; some rays start in shading.
        ("four samples", settings(16).with_samples(Samples::Four), 0.87),
        // More rays than a frame has shadow bits.
        ("255 rays", settings(8).with_shadow_rays(255), 0.82),
    ] {
        let error = compare(name, &accumulated(gpu, &scene, &camera, settings), &expected);
        assert!(error.median() < 0.01, "{name}: median {}", error.median());
        assert!(error.fraction_within(0.05) > within, "{name}: within 5 %: {}", error.fraction_within(0.05));
        assert!((error.energy_ratio() - 1.0).abs() < 0.005, "{name}: energy {}", error.energy_ratio());
    }

    // Negative control: one per cent of light, the sheet's shadow, and light that comes from the middle.
    let mut brighter = scene.clone();
    brighter.lights.iter_mut().for_each(|light| light.intensity *= 1.01);
    let error = compare("1 % brighter", &accumulated(gpu, &brighter, &camera, settings(16)), &expected);
    assert!(error.energy_ratio() > 1.005, "insensitive to 1 % of light");
    let unshadowed = settings(64).with_shadows(Shadows::None);
    let error = compare("without shadows", &accumulated(gpu, &scene, &camera, unshadowed), &expected);
    assert!(error.energy_ratio() > 1.02 && error.fraction_within(0.05) < 0.95, "insensitive to shadows");
    let mut smaller = scene.clone();
    for light in smaller.lights.iter_mut().filter(|light| light.area().is_some()) {
        let (area, position) = (light.area().unwrap(), light.position);
        *light = Light::disk(position, light.direction, 0.02, light.intensity);
        light.intensity *= area / light.area().unwrap();
    }
    let error = compare("small lights", &accumulated(gpu, &smaller, &camera, settings(64)), &expected);
    assert!(error.fraction_within(0.05) < 0.9, "insensitive to the lights' size");
}

/// Without occluders, `shadows none` equals the ground truth too: all of the light, not only that of the light's centre.
#[gpu_test(crate::gpu)]
fn gpu_area_lights_without_shadows_keep_all_light(gpu: &Gpu) {
    let (mut scene, camera) = still_life();
    scene.meshes[0].primitives.truncate(1);
    scene.materials[0].perceptual_roughness = 0.4;
    let expected = ground_truth(&scene, &camera, 2, 1024);
    let settings = Settings::direct_light().with_accumulate(64).with_shadows(Shadows::None);
    let error = compare("no shadows", &accumulated(gpu, &scene, &camera, settings), &expected);
    assert!(error.median() < 0.01 && (error.energy_ratio() - 1.0).abs() < 0.005, "{}", error.energy_ratio());
}

/// Transparent surfaces trace their own rays.
#[gpu_test(crate::gpu)]
fn gpu_area_lights_on_a_transparent_sheet_are_the_path_tracers(gpu: &Gpu) {
    let (mut scene, camera) = still_life();
    // A rough transparent sheet beneath the opaque one, in its shadow, over a black background.
    scene.materials[1].alpha_mode = AlphaMode::Blend;
    scene.materials[1].base_color.w = 0.5;
    scene.materials[1].perceptual_roughness = 1.0;
    let primitives = &mut scene.meshes[0].primitives;
    primitives[1] = quad(1, Vec3::new(0.0, 0.02, 0.2), 1.5 * Vec3::X, -0.9 * Vec3::Z);
    primitives.remove(0);
    let expected = ground_truth(&scene, &camera, 2, 2048);
    let settings = || Settings::direct_light().with_accumulate(32).with_shadows(Shadows::BVH);
    let error = compare("a transparent sheet", &accumulated(gpu, &scene, &camera, settings()), &expected);
    // The path tracer hits a transparent surface at random, half of the time: its noise is 1.7 % at the median.
    assert!(error.median() < 0.025 && (error.energy_ratio() - 1.0).abs() < 0.005, "{}", error.energy_ratio());
    let unshadowed = settings().with_shadows(Shadows::None);
    let error =
        compare("a transparent sheet without shadows", &accumulated(gpu, &scene, &camera, unshadowed), &expected);
    assert!(error.energy_ratio() > 1.02, "insensitive to shadows");
}

/// Indirect rays see surfaces lit by area lights: the same bounce as the path tracer's.
#[gpu_test(crate::gpu)]
fn gpu_a_bounce_of_area_lights_is_the_path_tracers(gpu: &Gpu) {
    // Two walls that face each other; the panel lights one of them, and is too near for its centre to represent it.
    let white = surface([0.8; 3], 0.0, 1.0);
    let walls = vec![
        quad(0, Vec3::ZERO, 1.5 * Vec3::X, -1.5 * Vec3::Z),
        quad(0, Vec3::new(0.0, 1.0, 0.0), 1.5 * Vec3::X, 1.5 * Vec3::Z),
    ];
    let mut scene = scene_of(walls, vec![white]);
    let panel = Light::rectangle(0.7 * Vec3::Y, Vec3::Y, Vec3::X, [1.6, 1.0], Vec3::splat(3.0));
    scene.lights = vec![panel];
    let projection = Projection::Perspective { fov_y: 0.7, near: 0.05 };
    let camera = Camera::look_at(Vec3::new(0.0, 0.6, 3.5), Vec3::new(0.0, 0.45, 0.0), projection);
    let expected = ground_truth(&scene, &camera, 3, 1024);
    // Many lights are selected by the tree: with additional dark lights the panel's light is the same.
    scene.lights.extend((0..20).map(|i| Light::point(Vec3::new(0.0, 0.5 + 0.01 * i as f32, 9.0), Vec3::splat(1e-6))));
    // Without filter, which blurs the light next to the panel.
    let unfiltered = Sampled { filter_radius: 0, ..Sampled::default() }.one_bounce();
    let settings = Settings::default().with_accumulate(16).with_indirect(unfiltered);
    let actual = accumulated(gpu, &scene, &camera, settings);
    // Squares of 64 pixels reduce the noise of both close to the panel to 3 % at the median, from 9 % for single pixels. Energy: 1 % measured.
    let [actual, expected] = [&actual, &expected].map(|image| image.box_downsampled(8).unwrap());
    let error = compare("one bounce", &actual, &expected);
    assert!((error.energy_ratio() - 1.0).abs() < 0.02, "{}", error.energy_ratio());
    assert!(error.median() < 0.05, "median {}", error.median());
}

/// Without occluders all rays are unoccluded: the count equals that of the listed lights, each counted once.
#[gpu_test(crate::gpu)]
fn gpu_views_of_rays_count_those_to_areas(gpu: &Gpu) {
    let (mut scene, camera) = still_life();
    scene.meshes[0].primitives.truncate(1);
    scene.lights.truncate(1);
    let view = |view| {
        let settings = Settings::direct_light().with_debug_view(Some(view)).with_shadows(Shadows::BVH);
        render(gpu, &scene, &camera, SIZE, settings)
    };
    let (fractions, rays) = (view(DebugView::Visibility), view(DebugView::RayCount));
    let lit = fractions.display.iter().filter(|pixel| pixel[0] == 255).count();
    let shown = fractions.display.iter().filter(|pixel| pixel[0] > 0).count();
    assert!(lit > 500 && lit == shown, "{lit} of {shown} see all of the light");
    // Sixteen rays for each pixel of the floor, and no others.
    assert_eq!(counter(&rays, "shadows/rays"), 16 * lit as u64);
}
