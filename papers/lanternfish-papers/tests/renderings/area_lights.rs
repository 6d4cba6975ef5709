//! Area lights: disks and rectangles against the path tracer, and equal images for every culling technique.

use glam::Vec3;
use lanternfish::{
    RenderedImage, Renderer, Settings,
    settings::{Culling, DebugView, Samples, Shadows},
    techniques::{Assignment, ClusterTest, Clustered, Sampled, TileSize, Tiled},
};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_metrics::{RelativeError, RgbImage};
use lanternfish_papers::RasterGrid;
use lanternfish_reference as reference;
use lanternfish_scene::{AlphaMode, Camera, Light, Material, Projection, Scene, generate};

use crate::support::{counter, differing, linear, quad, render, scene_of};

const SIZE: (u32, u32) = (96, 64);

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

/// Direct light only.
fn ground_truth(scene: &Scene, camera: &Camera, samples: u64) -> RgbImage {
    let settings = reference::Settings { max_depth: 2, ..reference::Settings::default() };
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
    let expected = ground_truth(&scene, &camera, 2048);
    let settings = || Settings::direct_light().with_accumulate(64).with_shadows(Shadows::BVH);
    let actual = accumulated(gpu, &scene, &camera, settings());
    // The noise of both: 0.8 % at the median. With several samples per pixel, surfaces at edges use the rays of a neighbour.
    let check = |name: &str, actual: &RgbImage, within: f32| {
        let error = compare(name, actual, &expected);
        assert!(error.median() < 0.01, "{name}: median {}", error.median());
        assert!(error.fraction_within(0.05) > within, "{name}: within 5 %: {}", error.fraction_within(0.05));
        assert!((error.energy_ratio() - 1.0).abs() < 0.005, "{name}: energy {}", error.energy_ratio());
    };
    check("64 frames of 16 rays", &actual, 0.97);
    // Lights of all kinds have more shadow bits with a radius; with several samples per pixel some rays start in shading.
    let soft = settings().with_light_radius(1e-3);
    check("beside soft shadows", &accumulated(gpu, &scene, &camera, soft), 0.97);
    let samples = settings().with_samples(Samples::Four).with_accumulate(32);
    check("four samples", &accumulated(gpu, &scene, &camera, samples), 0.93);
    // More rays than a frame has shadow bits.
    let many = settings().with_shadow_rays(255).with_accumulate(32);
    check("255 rays", &accumulated(gpu, &scene, &camera, many), 0.97);

    // Negative control: one per cent of light, the sheet's shadow, and light that comes from the middle.
    let mut brighter = scene.clone();
    brighter.lights.iter_mut().for_each(|light| light.intensity *= 1.01);
    let error = compare("1 % brighter", &accumulated(gpu, &brighter, &camera, settings()), &expected);
    assert!(error.energy_ratio() > 1.005, "insensitive to 1 % of light");
    let unshadowed = settings().with_shadows(Shadows::None);
    let error = compare("without shadows", &accumulated(gpu, &scene, &camera, unshadowed), &expected);
    assert!(error.energy_ratio() > 1.02 && error.fraction_within(0.05) < 0.95, "insensitive to shadows");
    let mut smaller = scene.clone();
    for light in smaller.lights.iter_mut().filter(|light| light.area().is_some()) {
        let (area, position) = (light.area().unwrap(), light.position);
        *light = Light::disk(position, light.direction, 0.02, light.intensity);
        light.intensity *= area / light.area().unwrap();
    }
    let error = compare("small lights", &accumulated(gpu, &smaller, &camera, settings()), &expected);
    assert!(error.fraction_within(0.05) < 0.9, "insensitive to the lights' size");
}

/// Without occluders, `shadows none` equals the ground truth too: all of the light, not only that of the light's centre.
#[gpu_test(crate::gpu)]
fn gpu_area_lights_without_shadows_keep_all_light(gpu: &Gpu) {
    let (mut scene, camera) = still_life();
    scene.meshes[0].primitives.truncate(1);
    scene.materials[0].perceptual_roughness = 0.4;
    let expected = ground_truth(&scene, &camera, 1024);
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
    let expected = ground_truth(&scene, &camera, 2048);
    let settings = || Settings::direct_light().with_accumulate(64).with_shadows(Shadows::BVH);
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
    let settings = reference::Settings { max_depth: 3, ..reference::Settings::default() };
    let tracer = reference::Tracer::new(&scene, settings).unwrap();
    let mut film = reference::Film::new(SIZE.into()).unwrap();
    tracer.render(&camera, &mut film, 1024);
    let expected = RgbImage::new(SIZE.0 as usize, SIZE.1 as usize, film.mean()).unwrap();
    // Few lights are all weighted; many are selected by the tree: with additional dark lights the panel's light is the same.
    for others in [0, 20] {
        let dim = (0..others).map(|i| Light::point(Vec3::new(0.0, 0.5 + 0.01 * i as f32, 9.0), Vec3::splat(1e-6)));
        let lit = Scene { lights: scene.lights.iter().cloned().chain(dim).collect(), ..scene.clone() };
        // Without filter, which blurs the light next to the panel.
        let unfiltered = Sampled { filter_radius: 0, ..Sampled::default() }.one_bounce();
        let settings = Settings::default().with_accumulate(16).with_indirect(unfiltered);
        let actual = accumulated(gpu, &lit, &camera, settings);
        // Squares of 64 pixels reduce the noise of both close to the panel to 3 % at the median, from 9 % for single pixels.
        let [actual, expected] = [&actual, &expected].map(|image| image.box_downsampled(8).unwrap());
        let error = compare(&format!("one bounce, {others} other lights"), &actual, &expected);
        assert!((error.energy_ratio() - 1.0).abs() < 0.01, "{}", error.energy_ratio());
        assert!(error.median() < 0.05, "median {}", error.median());
    }
}

fn cullings() -> Vec<Culling> {
    let clustered = |assignment, test| Culling::from(Clustered { assignment, test, ..Clustered::default() });
    vec![
        Culling::from(Tiled { tile_size: TileSize::Px8, aabb_test: true }),
        Culling::from(Tiled { tile_size: TileSize::Px32, aabb_test: false }),
        clustered(Assignment::Hierarchy, ClusterTest::PlanesAndBox),
        clustered(Assignment::BruteForce, ClusterTest::Planes),
        Culling::from(RasterGrid::default()),
    ]
}

#[gpu_test(crate::gpu)]
fn gpu_points_and_areas_are_the_same_with_every_culling_technique(gpu: &Gpu) {
    let mut scene = generate::demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    scene.lights.extend(generate::light_rain(&scene.bounds(), 500, Some(0.4), 2, 0.0));
    for (i, light) in scene.lights.iter_mut().enumerate().skip(3).step_by(16) {
        let towards = Vec3::new((i as f32).sin(), -0.5, (2.0 * i as f32).sin()).normalize();
        let (position, range) = (light.position, light.range);
        let area = match i % 32 < 16 {
            true => Light::disk(position, towards, 0.1, 10.0 * light.intensity),
            false => Light::rectangle(position, towards, Vec3::X, [0.3, 0.1], 10.0 * light.intensity),
        };
        *light = Light { range, ..area };
    }
    let rendering =
        |scene: &Scene, culling| render(gpu, scene, &camera, SIZE, Settings::direct_light().with_culling(culling));
    let all = rendering(&scene, Culling::NONE);
    let rays = |rendering: &RenderedImage| counter(rendering, "shadows/rays");
    for culling in cullings() {
        let actual = rendering(&scene, culling.clone());
        assert_eq!(differing(&actual, &all), 0, "{culling:?}");
        assert_eq!(rays(&actual), rays(&all), "{culling:?}");
    }
    // Negative control: areas whose range is a tenth shorter, and only the lights without an area.
    let mut shorter = scene.clone();
    let areas = shorter.lights.iter_mut().filter(|light| light.area().is_some());
    areas.for_each(|light| light.range = light.range.map(|range| 0.9 * range));
    assert!(differing(&rendering(&shorter, Culling::default()), &all) > 500);
    // Lights are added and removed: a scene without its area lights equals one that never had any.
    let mut points = scene.clone();
    points.lights.retain(|light| light.area().is_none());
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), Settings::direct_light()).unwrap();
    let mut uploaded = renderer.upload(&scene).unwrap();
    for (scene, expected) in [(&scene, &all), (&points, &rendering(&points, Culling::NONE)), (&scene, &all)] {
        renderer.update(&mut uploaded, scene).unwrap();
        let actual = renderer.render(&uploaded, &camera, SIZE.into()).unwrap();
        assert_eq!(differing(&actual, expected), 0, "{} lights", scene.lights.len());
    }
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
    assert!(lit > 2000 && lit == shown, "{lit} of {shown} see all of the light");
    // Sixteen rays for each pixel of the floor, and no others.
    assert_eq!(counter(&rays, "shadows/rays"), 16 * lit as u64);
}
