//! Coloured and grey shadows of panes and alpha-blended leaves, against the path tracer.

use glam::{UVec2, Vec3};
use lanternfish_gpu::{Engine, testing};
use lanternfish_scene::{AlphaMode, Camera, Image, Light, Material, Sampler, Scene, Texture, TextureRef};

use crate::{
    Renderer, Settings,
    settings::{Indirect, Samples, Shadows, Tracer},
    techniques::{Denoise, HitLight, Sampled, SampledLights},
    testing::{
        edited_engine,
        light::{LARGE, SIZE, closed_box, looking, matt, sampled, settings, traced_of},
        quad, scene_of,
    },
};

/// A white floor. Above it a red pane and, in part of its way, a blue one; and beside them a leaf of half-transparent texels in half of its
/// image. The camera is below them, above their shadows: the sun stands 35 degrees off the normal.
fn scene_with_panes() -> (Scene, Camera) {
    let glass = |r, g, b| Material {
        base_color: Vec3::new(r, g, b).extend(1.0),
        transmission: 1.0,
        perceptual_roughness: 0.0,
        ..matt(0.0)
    };
    let red = Material { specular: 1.0, ..glass(0.8, 0.1, 0.1) };
    let blue = Material { specular: 1.0, ..glass(0.3, 0.4, 0.9) };
    let mut leaf = Material { alpha_mode: AlphaMode::Blend, ..matt(0.5) };
    (leaf.base_color.w, leaf.base_color_texture) = (0.6, Some(TextureRef::new(0)));
    let sheet = |material, x, y| quad(material, Vec3::new(x, y, 0.0), 0.5 * Vec3::X, -0.5 * Vec3::Z);
    let floor = quad(0, Vec3::ZERO, 10.0 * Vec3::X, -10.0 * Vec3::Z);
    let parts = vec![floor, sheet(1, -0.7, 3.0), sheet(2, -1.0, 4.0), sheet(3, 0.7, 3.0)];
    let mut scene = scene_of(parts, vec![matt(0.8), red, blue, leaf]);
    let rgba = (0..64).flat_map(|i| [255, 255, 255, if i % 8 < 4 { 255 } else { 128 }]).collect();
    scene.images = vec![Image { name: String::new(), width: 8, height: 8, rgba }];
    (scene.samplers, scene.textures) = (vec![Sampler::default()], vec![Texture { image: 0, sampler: 0 }]);
    let (sine, cosine) = 35f32.to_radians().sin_cos();
    scene.lights = vec![Light::directional(Vec3::new(sine, -cosine, 0.0), Vec3::splat(3.0))];
    (scene, looking([2.1, 2.9, 0.6], [2.1, 0.0, 0.0]))
}

fn drawn(engine: &Engine, settings: Settings, scene: &Scene, camera: &Camera, size: UVec2) -> Vec<Vec3> {
    let mut renderer = Renderer::with_engine(engine, settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    let rendering = renderer.render(&uploaded, camera, size.into()).unwrap();
    rendering.radiance.iter().map(|pixel| Vec3::from_slice(pixel)).collect()
}

/// The greatest error of a channel's energy, over that of the path tracer: of the complete image, and of the coloured and grey shadows.
fn error(actual: &[Vec3], truth: &[Vec3], open: &[Vec3]) -> f32 {
    let part = |i: usize| match truth[i] / open[i] {
        part if part.min_element() > 0.98 => 0,
        part if part.max_element() - part.min_element() > 0.05 => 1,
        _ => 2,
    };
    let errors = [None, Some(1), Some(2)].map(|shadow| {
        let is_inside = |i: &usize| shadow.is_none_or(|shadow| part(*i) == shadow);
        let inside: Vec<usize> = (0..truth.len()).filter(is_inside).collect();
        assert!(inside.len() > 60, "{shadow:?}: {} pixels", inside.len());
        let [found, expected] = [actual, truth].map(|image| inside.iter().map(|i| image[*i]).sum::<Vec3>());
        println!("{} pixels: {}", inside.len(), found / expected);
        (found / expected - 1.0).abs().max_element()
    });
    errors.into_iter().fold(0.0, f32::max)
}

/// Settings with direct light alone, of a mean of frames, whose edges are smooth.
fn direct() -> Settings {
    settings(sampled(Tracer::BVH)).with_indirect(Indirect::NONE).with_shadows(Shadows::BVH).with_accumulate(8)
}

#[gpu_test]
fn gpu_panes_and_leaves_cast_the_shadows_of_the_path_tracer(gpu: &Gpu) {
    let (scene, camera) = scene_with_panes();
    let without = |scene: &Scene| {
        let mut open = scene.clone();
        open.meshes[0].primitives.truncate(1);
        open
    };
    let mut lit_by_lamp = scene.clone();
    let radiance = Vec3::new(50.0, 40.0, 30.0);
    let down = Vec3::new(0.57, -0.82, 0.0).normalize();
    lit_by_lamp.lights = vec![Light::rectangle(Vec3::new(-2.8, 7.0, 0.0), down, Vec3::Z, [0.5, 0.5], radiance)];
    let truth =
        |scene: &Scene| [traced_of(LARGE, scene, &camera, 2, 64), traced_of(LARGE, &without(scene), &camera, 2, 64)];
    let (of_sun, of_lamp) = (truth(&scene), truth(&lit_by_lamp));
    let engine = testing::engine(gpu);
    let counts = if testing::is_full() { vec![Samples::One, Samples::Four] } else { vec![Samples::One] };
    let sunny = |settings| error(&drawn(&engine, settings, &scene, &camera, LARGE), &of_sun[0], &of_sun[1]);
    for &samples in &counts {
        let [sun, wide] = [0.0, 0.53].map(|diameter| sunny(direct().with_samples(samples).with_sun_diameter(diameter)));
        let image = drawn(&engine, direct().with_samples(samples), &lit_by_lamp, &camera, LARGE);
        let lamp = error(&image, &of_lamp[0], &of_lamp[1]);
        assert!(sun.max(wide).max(lamp) < 0.05, "{samples}: {sun}, {wide}, {lamp}");
    }
    if gpu.description.ray_query {
        let queried = sunny(direct().with_shadows(Shadows::RAY_QUERY));
        assert!(queried < 0.05, "{queried}");
    }

    let denoise = Denoise::Off;
    let few = direct().with_direct(SampledLights { denoise, ..SampledLights::default() }).with_accumulate(64);
    for samples in counts {
        let of_samples = sunny(few.clone().with_samples(samples));
        assert!(of_samples < 0.05, "sampled, {samples}: {of_samples}");
    }

    if !testing::is_full() {
        return;
    }
    // Blind shaders are caught.
    for (module, from, to) in [
        ("gpu_scene/mask", "ray_passes *= ", "ray_passes = 0.9 * "),
        ("shadows/tinted", "incoming.irradiance * part", "incoming.irradiance"),
        ("direct_light/sampled/trace", "seen = passes();", "seen = vec3f(1.0);"),
    ] {
        let engine = edited_engine(gpu, &[(module, from, to)]);
        let settings = if module.contains("sampled") { few.clone() } else { direct() };
        let wrong = error(&drawn(&engine, settings, &scene, &camera, LARGE), &of_sun[0], &of_sun[1]);
        assert!(wrong > 0.05, "blind to {to}: {wrong}");
    }
}

/// Sun falls through the red pane that closes a box: what its walls scatter to one another has the path tracer's colours.
#[gpu_test]
fn gpu_light_behind_a_pane_bounces_in_the_colours_of_the_path_tracer(gpu: &Gpu) {
    let mut scene = closed_box(matt(0.5));
    scene.meshes[0].primitives[3].material = 1;
    scene.materials.push(scene_with_panes().0.materials[1].clone());
    scene.lights = vec![Light::directional(Vec3::new(0.3, -1.0, 0.2).normalize(), Vec3::splat(3.0))];
    let camera = looking([0.0, 0.4, 0.9], [0.0, -0.2, 0.0]);
    let less = |all: &[Vec3], direct: &[Vec3]| all.iter().sum::<Vec3>() - direct.iter().sum::<Vec3>();
    let [one_bounce, of_sun] = [3, 2].map(|depth| traced_of(SIZE, &scene, &camera, depth, 256));
    let engine = testing::engine(gpu);
    let unlit = drawn(&engine, direct(), &scene, &camera, SIZE);
    let cached = Sampled { hit_light: HitLight::Cached, ..sampled(Tracer::BVH) };
    for light in [sampled(Tracer::BVH), cached] {
        let all = drawn(&engine, direct().with_indirect(light), &scene, &camera, SIZE);
        let ratio = less(&all, &unlit) / less(&one_bounce, &of_sun);
        println!("{ratio}");
        assert!((ratio - 1.0).abs().max_element() < 0.05, "{:?}: {ratio}", light.hit_light);
    }
}
