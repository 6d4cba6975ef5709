mod bands;
mod cached;
mod coats;
mod contacts;
mod counts;
mod emission;
mod from_behind;
mod history;
mod lamps;
mod lobes;
mod mirrors;
mod new_entries;
mod noise;
mod probes;
mod rounds;
mod tracers;

use glam::{Affine3A, UVec2, Vec3, Vec4};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_reference::Settings as TracerSettings;
use lanternfish_scene::{AlphaMode, Camera, Environment, Light, Material, Scene, generate::demo};

use crate::{
    RenderError, RenderedImage, Renderer, Settings,
    direct_light::Direct,
    settings::{Attenuation, Indirect, Samples, Shadows, Tracer},
    techniques::{Bounces, HitLight, IndirectClamp, IndirectResolution, Sampled},
    testing::{
        Random, apart, counted, evaluate_module,
        light::{
            LARGE, SIZE, closed_box, cornell, floor, image_of, looking, matt, mean, off, rendered, rendering, sampled,
            settings, traced, traced_of,
        },
        quad, scene_of,
        walks::{self, pixels},
    },
};

/// Eye and target of a camera in front of the Cornell box.
const CAMERA: ([f32; 3], [f32; 3]) = ([0.0, 1.0, 2.6], [0.0, 1.0, 0.0]);

/// A mean of so many frames.
fn over_frames(rays: Sampled, accumulate: u32) -> Settings {
    settings(rays).with_accumulate(accumulate)
}

/// The tracers that the device supports.
fn tracers(gpu: &Gpu) -> impl Iterator<Item = Tracer> {
    let has_ray_query = gpu.description.ray_query;
    Tracer::in_one_level().into_iter().filter(move |tracer| *tracer != Tracer::RAY_QUERY || has_ray_query)
}

/// An open floor has its albedo times the sky's radiance, for any rays. A mirror has its reflectance times the radiance of the reflected surface.
#[gpu_test]
fn gpu_simple_scenes_have_the_light_of_their_sky_and_mirrors(gpu: &Gpu) {
    let camera = looking([0.0, 2.0, 2.0], [0.0, 0.0, 0.0]);
    let sky = Vec3::new(1.0, 2.0, 4.0);
    let image = Environment { width: 4, height: 2, pixels: vec![sky; 8], rotation: 0.0 };
    let floor = Scene { sky, ..floor(matt(0.5)) };
    let under_an_image = Scene { environment: Some(image), ..floor.clone() };
    let mirror = Material { metallic: 1.0, perceptual_roughness: 0.0, ..matt(0.8) };
    let lamp = Material { emissive: Vec3::new(3.0, 2.0, 1.0), ..matt(0.0) };
    let (below, above) =
        (quad(0, Vec3::ZERO, 10.0 * Vec3::X, -10.0 * Vec3::Z), quad(1, 2.0 * Vec3::Y, 10.0 * Vec3::X, 10.0 * Vec3::Z));
    let under_a_lamp = scene_of(vec![below, above], vec![mirror, lamp]);
    // The camera looks down, where the Fresnel term is at its minimum.
    let down = looking([0.0, 1.5, 0.1], [0.0, 0.0, 0.0]);
    // Single pixels of the mirror are off by 3 %.
    for (name, scene, camera, expected, most) in [
        ("floor", floor, &camera, 0.5 * sky, 2e-3),
        ("floor under an image", under_an_image, &camera, 0.5 * sky, 2e-3),
        ("mirror", under_a_lamp, &down, 0.8 * Vec3::new(3.0, 2.0, 1.0), 0.05),
    ] {
        for tracer in tracers(gpu) {
            let actual = rendering(gpu, settings(sampled(tracer)), &scene, camera);
            let off = |pixel: Vec3| (pixel / expected - 1.0).abs().max_element();
            let worst = actual.iter().map(|pixel| off(*pixel)).fold(0.0, f32::max);
            let mean = actual.iter().sum::<Vec3>() / actual.len() as f32;
            // Up to three of 64 rays may graze the floor and, with an environment image, point below it.
            assert!(off(mean) < 2e-3 && worst < most, "{name}, {tracer}: {mean}, {worst}");
        }
    }
}

/// Few rays estimate a small sun without missing it or all hitting it: each reads the environment prefiltered over the solid angle that it represents.
#[gpu_test]
fn gpu_few_rays_estimate_a_small_sun(gpu: &Gpu) {
    let (width, height, row) = (64, 32, 8);
    let mut pixels = vec![Vec3::ZERO; width * height];
    pixels[row * width + 20] = Vec3::splat(1000.0);
    let scene = Scene { environment: Some(Environment { width, height, pixels, rotation: 0.0 }), ..floor(matt(0.5)) };
    // Bilinear interpolation between pixels doubles the sun's width and height, and halves its mean radiance.
    let step = std::f64::consts::PI / height as f64;
    let colatitude = (row as f64 + 0.5) * step;
    let expected = 0.5 / std::f64::consts::PI * 1000.0 * step * step * colatitude.sin() * colatitude.cos();
    let camera = looking([0.0, 2.0, 2.0], [0.0, 0.0, 0.0]);
    for diffuse_rays in [4, 32] {
        let few = Sampled { diffuse_rays, ..sampled(Tracer::BVH) };
        let actual = rendering(gpu, settings(few), &scene, &camera);
        let energy = mean(&actual) / expected;
        println!("{diffuse_rays} rays: {energy:.3} of the light");
        assert!((energy - 1.0).abs() < 0.25, "{diffuse_rays} rays: {energy}");
    }
}

/// Ground truth: paths of up to three segments through exact triangles. The limits are about a quarter above the measured values.
#[gpu_test]
fn gpu_one_bounce_matches_path_tracer(gpu: &Gpu) {
    let scene = cornell();
    let camera = scene.cameras[0].clone();
    let (direct, one_bounce) = (traced_of(LARGE, &scene, &camera, 2, 192), traced_of(LARGE, &scene, &camera, 3, 192));
    // Only the bounce is compared: edges have one sample per pixel in one image and many in the other.
    let alone =
        image_of(gpu, LARGE, settings(Sampled::default().one_bounce()).with_indirect(Indirect::NONE), &scene, &camera);
    let bounce = |whole: &[Vec3], part: &[Vec3]| whole.iter().zip(part).map(|(a, b)| *a - *b).collect::<Vec<Vec3>>();
    let ground_truth = bounce(&one_bounce, &direct);
    assert!(mean(&ground_truth) > 0.1 * mean(&direct), "there is little indirect light");
    let actual = bounce(&image_of(gpu, LARGE, settings(sampled(Tracer::BVH)), &scene, &camera), &alone);
    let (apart, energy) = (off(&actual, &ground_truth), mean(&actual) / mean(&ground_truth));
    println!("off by {apart:.4}, energy {energy:.4}");
    assert!(apart < 0.2 && (energy - 1.0).abs() < 0.03, "off {apart}, energy {energy}");
    // The test can fail: white walls reflect another amount of light.
    let mut white = scene.clone();
    white.materials.iter_mut().for_each(|material| material.base_color = Vec4::ONE);
    let of = |indirect| {
        image_of(gpu, LARGE, settings(Sampled::default().one_bounce()).with_indirect(indirect), &white, &camera)
    };
    let actual = bounce(&of(Indirect::from(sampled(Tracer::BVH))), &of(Indirect::NONE));
    assert!(off(&actual, &ground_truth) > 0.5, "{}", off(&actual, &ground_truth));
}

/// Ray hits also reflect the light of the environment, a constant or an image, with and without a lamp: as much as paths of up to three segments.
#[gpu_test]
fn gpu_environment_lights_hits(gpu: &Gpu) {
    // A box without a lid.
    let mut scene = closed_box(matt(0.7));
    scene.meshes[0].primitives.remove(3);
    let camera = looking([0.0, 0.8, 0.8], [0.0, -1.0, -0.6]);
    let gradient =
        (0..128).map(|i| Vec3::new(0.2 + 0.01 * (i % 16) as f32, 0.5, 1.0 - 0.05 * (i / 16) as f32)).collect();
    let image = Environment { width: 16, height: 8, pixels: gradient, rotation: 0.3 };
    let lamp = Light::point(Vec3::new(0.3, 0.2, 0.0), Vec3::splat(0.3));
    for (name, sky, environment, lights) in [
        ("a constant sky", Vec3::splat(0.6), None, vec![]),
        ("an image", Vec3::ZERO, Some(image.clone()), vec![]),
        ("an image and a lamp", Vec3::ZERO, Some(image), vec![lamp]),
    ] {
        (scene.sky, scene.environment, scene.lights) = (sky, environment, lights);
        let seen = |max_depth| mean(&traced(&scene, &camera, max_depth, 128));
        let (direct, ground_truth) = (seen(2), seen(3));
        let actual = mean(&rendering(gpu, settings(sampled(Tracer::BVH)), &scene, &camera));
        println!(
            "{name}: direct {direct:.4}, with a bounce {ground_truth:.4}, estimate {:.4} of that",
            actual / ground_truth
        );
        assert!(direct < 0.8 * ground_truth, "{name}: a bounce adds little light");
        assert!((actual / ground_truth - 1.0).abs() < 0.02, "{name}: {actual} of {ground_truth}");
    }
    // Metal that reflects metal.
    scene.lights.clear();
    for perceptual_roughness in [0.2, 0.8] {
        scene.materials = vec![Material { metallic: 1.0, perceptual_roughness, ..matt(0.9) }];
        let [direct, ground_truth] = [2, 3].map(|max_depth| mean(&traced(&scene, &camera, max_depth, 128)));
        let actual = mean(&rendering(gpu, settings(sampled(Tracer::BVH)), &scene, &camera));
        println!(
            "metal of roughness {perceptual_roughness}: direct {direct:.4}, {ground_truth:.4}, estimate {:.4} of that",
            actual / ground_truth
        );
        assert!(
            (actual / ground_truth - 1.0).abs() < 0.05,
            "roughness {perceptual_roughness}: {actual} of {ground_truth}"
        );
    }
}

/// A small emissive panel and a dark floor: irradiance falls with the square of the distance.
#[gpu_test]
fn gpu_moved_emitters_light_from_their_new_position(gpu: &Gpu) {
    let lamp = Material { emissive: Vec3::splat(50.0), ..matt(0.0) };
    let floor = quad(0, Vec3::ZERO, 4.0 * Vec3::X, -4.0 * Vec3::Z);
    let panel = quad(1, Vec3::Y, 0.5 * Vec3::X, 0.5 * Vec3::Z);
    let mut scene = apart(&scene_of(vec![floor, panel], vec![matt(0.5), lamp]));
    let camera = looking([0.0, 0.6, 0.6], [0.0, 0.0, 0.0]);
    for tracer in tracers(gpu) {
        let settings = settings(sampled(tracer));
        let mut renderer = walks::renderer(gpu, settings.clone());
        let mut uploaded = renderer.upload(&scene).unwrap();
        let before = pixels(&renderer.render(&uploaded, &camera, SIZE.into()).unwrap());
        scene.instances[1].world_from_object.translation.y += 2.0;
        renderer.update(&mut uploaded, &scene).unwrap();
        let after = pixels(&renderer.render(&uploaded, &camera, SIZE.into()).unwrap());
        assert!(mean(&after) < 0.4 * mean(&before), "{tracer}: {} to {}", mean(&before), mean(&after));
        let fresh = rendering(gpu, settings, &scene, &camera);
        assert!(off(&after, &fresh) < 0.02, "{tracer}: {}", off(&after, &fresh));
        scene.instances[1].world_from_object.translation.y -= 2.0;
    }
}

/// With one surface in a pixel, further samples do not change it; with two, each has its own light.
#[gpu_test]
fn gpu_samples_have_the_light_of_their_surfaces(gpu: &Gpu) {
    // A white floor under a white sky, and a black lid over a part of it, whose underside is invisible.
    let floor = quad(0, Vec3::ZERO, 4.0 * Vec3::X, -4.0 * Vec3::Z);
    let lid = quad(1, Vec3::new(-2.0, 0.5, 0.0), 2.0 * Vec3::X, -4.0 * Vec3::Z);
    let black = Material { base_color: Vec4::new(0.0, 0.0, 0.0, 1.0), ..matt(0.0) };
    let scene = Scene { sky: Vec3::ONE, ..scene_of(vec![floor, lid], vec![matt(0.5), black]) };
    let camera = looking([0.3, 6.0, 0.2], [0.0, 0.0, 0.0]);
    let of = |samples| {
        let settings = settings(Sampled { diffuse_rays: 256, ..sampled(Tracer::BVH) });
        rendering(gpu, settings.with_samples(samples), &scene, &camera)
    };
    let [one, four] = [Samples::One, Samples::Four].map(of);
    // Fraction of each pixel that the floor covers.
    let mut shining = scene.clone();
    shining.materials[0] = Material { base_color: Vec4::ONE, unlit: true, ..matt(0.0) };
    let direct = Settings::direct_light().with_samples(Samples::Four);
    let fraction = rendering(gpu, direct, &shining, &camera);
    let differing = one.iter().zip(&four).filter(|(a, b)| (**a - **b).abs().max_element() > 1e-3).count();
    let edges = SIZE.y as usize;
    assert!((edges / 4..=3 * edges).contains(&differing), "{differing} pixels differ");
    // The lid is lit by all of the sky, the floor at its border by half of it: no sample of the floor has the lid's light.
    let (width, height) = (SIZE.x as usize, SIZE.y as usize);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let around = (0..9).map(|i| one[(y + i / 3 - 1) * width + x + i % 3 - 1].x);
            let most = around.fold(0.0, f32::max);
            let most = 1.03 * fraction[y * width + x].x * most;
            assert!(four[y * width + x].x <= most + 1e-3, "{x}, {y}: {} of {most}", four[y * width + x]);
        }
    }
}

/// The library refuses values out of range, not only the command line.
#[gpu_test]
fn gpu_invalid_combinations_are_refused(gpu: &Gpu) {
    let (one, all) = (Sampled::default().one_bounce(), Sampled { hit_light: HitLight::Cached, ..Sampled::default() });
    for (rays, words) in [
        (Sampled { diffuse_rays: 0, ..one }, "rays"),
        (Sampled { filter_radius: 65, ..one }, "64 pixels"),
        (Sampled { cache_entries: 0, ..all }, ""),
        (Sampled { cache_entries: u32::MAX, ..all }, ""),
        (Sampled { cache_samples: 0, ..all }, ""),
        (Sampled { first_rays: 0, ..all }, ""),
        (Sampled { first_rays: 9, ..all }, ""),
        (Sampled { hit_light: HitLight::Shaded, bounces: Bounces::UpTo(2), ..all }, ""),
    ] {
        match Renderer::with_engine(&testing::engine(gpu), settings(rays)) {
            Err(RenderError::Together { needed, .. }) => assert!(needed.contains(words), "{rays:?}: {needed}"),
            other => panic!("{rays:?}: {other:?}"),
        }
    }
    // Indirect light works without shadow rays.
    walks::renderer(gpu, settings(one).with_shadows(Shadows::None));
}
