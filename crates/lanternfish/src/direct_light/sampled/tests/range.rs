//! Light that half floats hold only in a unit of the scene: suns, lamps beside walls, scenes in the dark.

use glam::{UVec2, Vec3};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{Camera, Environment, Light, Material, Scene};

use crate::{
    GpuScene, RenderError, RenderedImage, Renderer, Settings,
    settings::{Attenuation, Exposure, ImageSettings},
    techniques::{Denoise, LightSamples, SampledLights},
    testing::{
        counted,
        light::{floor, image_of, looking, matt, rendered},
        quad,
    },
};

const SIZE: UVec2 = UVec2::new(41, 31);

/// Direct light with inverse-square falloff, without ranges.
fn every_light() -> Settings {
    Settings::direct_light().with_attenuation(Attenuation::Physical).with_range_threshold(1e-12)
}

fn sampled(denoise: Denoise) -> Settings {
    let direct = SampledLights { light_samples: LightSamples::Two, denoise };
    every_light().with_direct(direct)
}

/// Sampled light of a scene with one light is every light, pixel by pixel; returns the brightest pixel.
fn has_every_light(gpu: &Gpu, scene: &Scene, camera: &Camera) -> f32 {
    let every = image_of(gpu, SIZE, every_light(), scene, camera);
    for denoise in [Denoise::Off, Denoise::On] {
        let sampled = image_of(gpu, SIZE, sampled(denoise), scene, camera);
        for (pixel, (sampled, every)) in sampled.iter().zip(&every).enumerate() {
            let off = (sampled - every).abs().max_element();
            assert!(off <= 0.02 * every.max_element(), "{denoise:?}, pixel {pixel}: {sampled} for {every}");
        }
    }
    every.iter().map(|pixel| pixel.max_element()).fold(0.0, f32::max)
}

#[gpu_test]
fn gpu_a_sun_and_a_lamp_beside_a_wall_keep_their_light(gpu: &Gpu) {
    let glossy = Material { perceptual_roughness: 0.25, specular: 1.0, ..matt(0.5) };
    let mut scene = floor(glossy);
    scene.lights = vec![Light::directional(Vec3::new(0.0, -1.0, -1.0).normalize(), Vec3::splat(120_000.0))];
    // Towards the sun's mirror image.
    let peak = has_every_light(gpu, &scene, &looking([0.0, 1.0, -2.0], [0.0, 0.0, -1.0]));
    assert!(peak > 65_504.0, "{peak}");

    let mut scene = floor(matt(0.15));
    scene.lights = vec![Light::point(Vec3::new(0.0, 0.01, 0.0), Vec3::splat(100.0))];
    let peak = has_every_light(gpu, &scene, &looking([0.0, 0.1, 0.1], [0.0, 0.0, 0.0]));
    let expected = 0.15 / std::f32::consts::PI * 100.0 / 1e-4;
    assert!((peak / expected - 1.0).abs() < 0.05, "{peak} nits for {expected}");
}

#[gpu_test]
fn gpu_a_dark_scene_is_a_bright_one_with_less_light(gpu: &Gpu) {
    let image = |scale: f32| {
        let mut scene = floor(Material { emissive: Vec3::splat(0.1 * scale), ..matt(0.5) });
        scene.sky = Vec3::splat(0.2 * scale);
        scene.lights = vec![Light::point(Vec3::new(0.0, 0.5, 0.0), Vec3::splat(4.0 * scale))];
        image_of(gpu, SIZE, sampled(Denoise::On), &scene, &looking([0.0, 1.0, 2.0], [0.0, 0.0, 0.0]))
    };
    let bright = image(1.0);
    for scale in [2f32.powi(-24), 2f32.powi(14)] {
        for (dark, bright) in image(scale).iter().zip(&bright) {
            assert!((*dark / scale - bright).abs().max_element() <= 2e-3 * bright.max_element(), "{dark}, {bright}");
        }
    }
}

/// A floor, a glowing square and a lamp under an environment, with so many times the light.
fn outdoors(scale: f32) -> Scene {
    let mut scene = floor(matt(0.5));
    scene.materials.push(Material { emissive: Vec3::splat(0.5 * scale), ..matt(0.5) });
    scene.meshes[0].primitives.push(quad(1, Vec3::new(0.5, 0.3, 0.0), 0.2 * Vec3::X, 0.2 * Vec3::Y));
    scene.lights = vec![Light::point(Vec3::new(0.0, 0.5, 0.0), Vec3::splat(4.0 * scale))];
    let pixels = (0..128).map(|i| Vec3::splat(scale * (i % 5) as f32)).collect();
    scene.environment = Some(Environment { width: 16, height: 8, pixels, rotation: 0.0 });
    scene
}

/// Uploads, updates and every output agree on the unit: a scene that has become brighter, or of which a part has, is as
/// after a new upload.
#[gpu_test(full)]
fn gpu_light_that_is_stored_in_another_unit_is_the_same(gpu: &Gpu) {
    const SCALE: f32 = 16384.0;
    let camera = looking([0.0, 1.0, 2.0], [0.0, 0.2, 0.0]);
    let settings =
        Settings { image: ImageSettings { exposure: Exposure::Auto, ..Default::default() }, ..Settings::default() };
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let mut shown = |scene: &GpuScene| renderer.render(scene, &camera, SIZE.into()).unwrap();
    let near = |a: &RenderedImage, b: &RenderedImage, scale: f32| {
        let pairs = a.radiance.iter().flatten().zip(b.radiance.iter().flatten());
        pairs.map(|(a, b)| (a - scale * b).abs() / (scale * b).max(0.01 * scale)).fold(0.0, f32::max)
    };
    let uploader = Renderer::with_engine(&testing::engine(gpu), Settings::default()).unwrap();
    let upload = |scene: &Scene| uploader.upload(scene).unwrap();
    let (dim, bright) = (outdoors(1.0), outdoors(SCALE));
    let (mut of_dim, mut of_bright) = (shown(&upload(&dim)), shown(&upload(&bright)));
    of_dim.radiance.iter_mut().chain(&mut of_bright.radiance).for_each(|pixel| pixel[3] = 0.0);
    assert!(upload(&bright).light_unit() > 8.0 * upload(&dim).light_unit());
    assert!(near(&of_bright, &of_dim, SCALE) < 0.02, "{}", near(&of_bright, &of_dim, SCALE));
    assert_eq!(of_dim.exposure.unwrap() - of_bright.exposure.unwrap(), SCALE.log2());
    // Updates: to a much brighter scene; and with another instance and an environment that stays, to a dimmer lamp.
    let mut updated = upload(&dim);
    uploader.update(&mut updated, &bright).unwrap();
    assert_eq!(updated.light_unit(), upload(&bright).light_unit());
    let mut dimmer = bright.clone();
    dimmer.lights[0].intensity *= 0.1;
    dimmer.instances.push(dimmer.instances[0].clone());
    let mut kept = upload(&bright);
    uploader.update(&mut kept, &dimmer).unwrap();
    for (updated, scene) in [(updated, bright), (kept, dimmer)] {
        let off = near(&shown(&updated), &shown(&upload(&scene)), 1.0);
        assert!(off < 0.02, "{off}");
    }
    let lamp = Light::point(Vec3::Y, Vec3::splat(1e9));
    assert!(matches!(uploader.set_light(&mut upload(&dim), 0, &lamp), Err(RenderError::NeedsUpdate { .. })));
}

/// A lamp 1 cm from the floor among 48 others: the mean of frames against every light.
#[gpu_test]
fn gpu_a_mean_of_sampled_light_keeps_the_light_beside_lamps(gpu: &Gpu) {
    let mut scene = floor(matt(0.15));
    let lamp = |i: u32| Vec3::new((i % 7) as f32 / 3.0 - 1.0, 0.4, (i / 7) as f32 / 3.0 - 1.0);
    scene.lights = (0..48).map(|i| Light::point(lamp(i), Vec3::splat(1.0))).collect();
    scene.lights.push(Light::point(Vec3::new(0.0, 0.01, 0.0), Vec3::splat(100.0)));
    let camera = looking([0.0, 0.3, 0.3], [0.0, 0.0, 0.0]);
    let image = |settings: Settings| image_of(gpu, SIZE, settings, &scene, &camera);
    let sum = |pixels: &[Vec3], is_in: &dyn Fn(usize) -> bool| -> f64 {
        pixels.iter().enumerate().filter(|(i, _)| is_in(*i)).map(|(_, pixel)| f64::from(pixel.x)).sum()
    };
    let every = image(every_light().with_accumulate(32));
    let mut sorted: Vec<f32> = every.iter().map(|pixel| pixel.x).collect();
    sorted.sort_by(f32::total_cmp);
    let hot = sorted[sorted.len() - sorted.len() / 100];
    for (denoise, least) in [(Denoise::Off, 0.998), (Denoise::On, 0.995)] {
        let mean = image(sampled(denoise).with_accumulate(32));
        let hottest = |i: usize| every[i].x >= hot;
        let ratios = [&hottest as &dyn Fn(usize) -> bool, &|_| true].map(|part| sum(&mean, part) / sum(&every, part));
        println!("{denoise:?}: hottest hundredth {:.4}, all {:.4}", ratios[0], ratios[1]);
        assert!(ratios.iter().all(|ratio| (least..=2.0 - least).contains(ratio)), "{denoise:?}: {ratios:?}");
    }
}

/// Two hundred faint quads beside a lamp: their part of the list is their part of the light. Alone they have all of it.
#[gpu_test]
fn gpu_faint_triangles_leave_the_list_to_lights(gpu: &Gpu) {
    let mut scene = floor(matt(0.5));
    scene.materials.push(Material { emissive: Vec3::splat(0.01), ..matt(0.0) });
    for i in 0..200 {
        let center = Vec3::new((i % 20) as f32 / 10.0 - 1.0, 1.0, (i / 20) as f32 / 5.0 - 1.0);
        scene.meshes[0].primitives.push(quad(1, center, 0.02 * Vec3::X, 0.02 * Vec3::Z));
    }
    let listed = |scene: &Scene| {
        let (settings, camera) = (sampled(Denoise::On), looking([0.0, 0.6, 0.3], [0.0, 0.0, 0.0]));
        let image = rendered(gpu, SIZE, settings, scene, &camera);
        counted(&image, "direct_light/listed") / u64::from(SIZE.x * SIZE.y)
    };
    assert!((200..=256).contains(&listed(&scene)), "{}", listed(&scene));
    scene.lights = vec![Light::point(0.8 * Vec3::Y, Vec3::splat(100.0))];
    assert!(listed(&scene) <= 33, "{}", listed(&scene));
}
