//! Pictures that must be one, bit for bit, however they were made.

use glam::Vec3;
use lanternfish::{
    Picture, Renderer, Settings,
    settings::{
        Assignment, ClusterShape, ClusterTest, Clustered, Culling, RayCulling, Shadows, TextureBinding, TileSize, Tiled,
    },
};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{AlphaMode, Camera, Light, LightKind, Material, Scene, generate};

use crate::support::{counter, differing, left_out_on_old_software, quad, render};

const SIZE: (u32, u32) = (150, 90);

fn all_cullings() -> Vec<Culling> {
    let mut cullings = vec![Culling::All];
    for tile_size in TileSize::ALL.iter().copied() {
        cullings.extend([false, true].map(|aabb_test| Culling::Tiled(Tiled { tile_size, aabb_test })));
    }
    for shape in [
        ClusterShape::Perspective { pixels: 16 },
        ClusterShape::Perspective { pixels: 48 },
        ClusterShape::Orthographic { side: 0.25 },
        ClusterShape::Displaced { pixels: 32, distance: 3.0 },
    ] {
        for assignment in Assignment::ALL.iter().copied() {
            for test in ClusterTest::ALL.iter().copied() {
                let clustered = Clustered { shape, assignment, test, ..Clustered::default() };
                cullings.push(Culling::Clustered(clustered));
            }
        }
    }
    cullings
}

/// The Cornell box in light rain, with spots, a sun, and a coloured pane in front of it all.
fn cornell_in_rain(seed: u32) -> (Scene, Camera) {
    let mut scene = generate::demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    scene.lights.extend(generate::light_rain(&scene.bounds(), 120, Some(0.6), seed, 0.0));
    for (i, light) in scene.lights.iter_mut().enumerate().skip(1).step_by(3) {
        light.kind = LightKind::Spot { inner_angle: 0.1, outer_angle: 0.2 + 0.01 * i as f32 };
    }
    scene.lights.push(Light::directional(Vec3::new(-0.4, -1.0, -0.8), Vec3::splat(0.3)));
    let glass = Material {
        base_color: Vec3::new(0.2, 0.7, 0.9).extend(0.4),
        metallic: 0.0,
        perceptual_roughness: 0.4,
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..Material::default()
    };
    scene.materials.push(glass);
    let pane = quad(scene.materials.len() - 1, Vec3::new(0.3, 0.9, 0.7), Vec3::new(0.4, 0.0, 0.2), Vec3::Y * 0.5);
    let mesh = scene.instances[0].mesh;
    scene.meshes[mesh].primitives.push(pane);
    (scene, camera)
}

#[test]
fn gpu_tiles_and_clusters_change_no_pixel() {
    let Some(gpu) = testing::gpu("gpu_tiles_and_clusters_change_no_pixel") else { return };
    let (scene, camera) = cornell_in_rain(1);
    let picture =
        |scene: &Scene, culling| render(gpu, scene, &camera, SIZE, Settings { culling, ..Default::default() });
    let all = picture(&scene, Culling::All);
    let mut listed = Vec::new();
    for culling in all_cullings() {
        let tiled = picture(&scene, culling);
        assert_eq!(differing(&tiled, &all), 0, "{culling:?}");
        assert_eq!(tiled.display, all.display, "{culling:?}");
        // The same rays, too: a light more in a list is a light out of reach.
        assert_eq!(counter(&tiled, "shadows/rays"), counter(&all, "shadows/rays"), "{culling:?}");
        let tests = counter(&tiled, "light_culling/light_tests");
        listed.push((counter(&tiled, "light_culling/listed_lights"), tests));
    }
    println!("listed lights, all, then 8, 16, 32 px without and with boxes: {listed:?}");
    // It can fail: other rain is another picture, and so is a light whose range is a tenth shorter.
    assert!(differing(&picture(&cornell_in_rain(2).0, Culling::All), &all) > 1000);
    let mut shorter = scene.clone();
    shorter.lights.iter_mut().for_each(|light| light.range = light.range.map(|range| 0.9 * range));
    assert!(differing(&picture(&shorter, Culling::default()), &all) > 1000);
}

#[test]
fn gpu_pictures_are_the_same_from_run_to_run() {
    let Some(gpu) = testing::gpu("gpu_pictures_are_the_same_from_run_to_run") else { return };
    let (scene, camera) = cornell_in_rain(3);
    let settings = || Settings { shadows: Shadows::Bvh, ..Default::default() };
    let first = render(gpu, &scene, &camera, SIZE, settings());
    assert_eq!(differing(&render(gpu, &scene, &camera, SIZE, settings()), &first), 0, "a new renderer");

    // A renderer that has made other pictures keeps lists and targets; none of it may show.
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings()).unwrap();
    let other = cornell_in_rain(4);
    let (scene, other_scene) = (renderer.upload(&scene).unwrap(), renderer.upload(&other.0).unwrap());
    let other = renderer.render(&other_scene, &other.1, SIZE.0 + 13, SIZE.1 - 20).unwrap();
    for run in 0..3 {
        let again = renderer.render(&scene, &camera, SIZE.0, SIZE.1).unwrap();
        assert_eq!(differing(&again, &first), 0, "run {run} of one renderer");
    }
    // It can fail.
    let same_size = renderer.render(&other_scene, &camera, SIZE.0, SIZE.1).unwrap();
    assert!(differing(&same_size, &first) > 1000 && other.width == SIZE.0 + 13);
}

fn atrium() -> (Scene, Camera) {
    let scene = generate::demo("atrium").unwrap();
    let camera = scene.cameras[0].clone();
    (scene, camera)
}

#[test]
fn gpu_texture_arrays_change_no_pixel() {
    let test = "gpu_texture_arrays_change_no_pixel";
    let Some(gpu) = testing::gpu(test) else { return };
    if !gpu.description.texture_arrays {
        return testing::left_out(test, "this adapter has no texture arrays");
    }
    let (scene, camera) = atrium();
    let picture = |scene: &Scene, textures| {
        render(gpu, scene, &camera, SIZE, Settings { textures, shadows: Shadows::None, ..Default::default() })
    };
    let array = picture(&scene, TextureBinding::Array);
    assert_eq!(differing(&picture(&scene, TextureBinding::PerMaterial), &array), 0);
    // It can fail: with the textures in another order.
    let mut turned = scene.clone();
    turned.textures.rotate_left(1);
    assert!(differing(&picture(&turned, TextureBinding::PerMaterial), &array) > 1000);
}

#[test]
fn gpu_a_thousand_lights_over_one_tile() {
    let Some(gpu) = testing::gpu("gpu_a_thousand_lights_over_one_tile") else { return };
    let mut scene = generate::demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    scene.lights = generate::light_rain(&scene.bounds(), 1000, Some(3.0), 5, 0.0);
    let picture = |culling, count: usize| {
        let scene = Scene { lights: scene.lights[..count].to_vec(), ..scene.clone() };
        render(gpu, &scene, &camera, (16, 16), Settings { culling, ..Default::default() })
    };
    let all = picture(Culling::All, 1000);
    let tiled = picture(Culling::default(), 1000);
    // One tile of 16 pixels is the whole picture.
    let listed = counter(&tiled, "light_culling/listed_lights");
    println!("{listed} lights over one tile, {} rays", counter(&tiled, "shadows/rays"));
    assert!(listed > 900, "{listed} lights over one tile");
    assert_eq!(differing(&tiled, &all), 0);
    // It can fail: each hundred of the lights shows, the last ones too.
    let mut fewer = all;
    for count in [900, 500, 32] {
        let picture = picture(Culling::default(), count);
        assert!(differing(&picture, &fewer) > 100, "the lights from {count} on do not show");
        fewer = picture;
    }
}

#[test]
fn gpu_rays_to_lights_behind_a_surface_change_no_pixel() {
    let test = "gpu_rays_to_lights_behind_a_surface_change_no_pixel";
    let Some(gpu) = testing::gpu(test) else { return };
    if left_out_on_old_software(test, gpu, "2 pixels of the atrium differ there; the cause is not known") {
        return;
    }
    let (cornell, cornell_camera) = cornell_in_rain(6);
    let (mut atrium, atrium_camera) = atrium();
    atrium.lights.extend(generate::light_rain(&atrium.bounds(), 60, Some(4.0), 6, 0.0));
    for (scene, camera) in [(cornell, cornell_camera), (atrium, atrium_camera)] {
        let picture = |ray_culling| {
            let settings = Settings { ray_culling, shadows: Shadows::Bvh, ..Default::default() };
            render(gpu, &scene, &camera, SIZE, settings)
        };
        let rays = |picture: &Picture| counter(picture, "shadows/rays");
        let none = picture(RayCulling::None);
        let surface = picture(RayCulling::Surface);
        assert_eq!(differing(&surface, &none), 0, "{}", scene.name);
        assert!(rays(&surface) < rays(&none), "{}: no ray was saved", scene.name);
        // Normals from depth are wrong at edges, the five-sample one less often [Elagabani2025, §4.3.1].
        let naive = picture(RayCulling::Naive);
        let improved = picture(RayCulling::Improved);
        let wrong = [differing(&naive, &none), differing(&improved, &none)];
        println!(
            "{}: {} rays for all lights, {} by the surface's normal, {} naive, {} improved; {wrong:?} pixels differ",
            scene.name,
            rays(&none),
            rays(&surface),
            rays(&naive),
            rays(&improved)
        );
        assert!(wrong[1] < wrong[0], "{}: {wrong:?}", scene.name);
    }
}

/// Share of pixels that two tracers may see differently. Each of a pixel's rays is decided by a rounding where it passes an
/// edge closer than a few of them, or starts that close to another surface. Measured: 33 and 3 of 57,600 pixels.
const TRACER_PIXELS: f64 = 1e-3;

#[test]
fn gpu_tracers_agree() {
    let test = "gpu_tracers_agree";
    let Some(gpu) = testing::gpu(test) else { return };
    if !gpu.description.ray_query {
        return testing::left_out(test, "this adapter has no ray query");
    }
    let (cornell, cornell_camera) = cornell_in_rain(8);
    let (atrium, atrium_camera) = atrium();
    for (scene, camera) in [(cornell, cornell_camera), (atrium, atrium_camera)] {
        let picture =
            |gpu: &Gpu, shadows| render(gpu, &scene, &camera, (320, 180), Settings { shadows, ..Default::default() });
        let [bvh, ray_query, none] = [Shadows::Bvh, Shadows::RayQuery, Shadows::None].map(|s| picture(gpu, s));
        let pixels = (bvh.width * bvh.height) as usize;
        let differ = differing(&bvh, &ray_query);
        println!("{}: {differ} of {pixels} pixels differ between tracers", scene.name);
        assert_eq!(counter(&bvh, "shadows/rays"), counter(&ray_query, "shadows/rays"));
        assert!(differ as f64 <= TRACER_PIXELS * pixels as f64, "{}: {differ} of {pixels}", scene.name);
        // It can fail: without shadows much more differs.
        assert!(differing(&bvh, &none) > pixels / 10, "{}: shadows do not show", scene.name);
    }
}
