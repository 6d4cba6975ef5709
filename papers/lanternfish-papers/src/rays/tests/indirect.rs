//! Indirect light with rays through deep images. Bounds are those of exact tracers plus the loss of deep images, which
//! their README explains.

use glam::Vec3;
use lanternfish::{
    Renderer, Settings,
    settings::{Indirect, Tracer},
    techniques::{Bounces, HitLight, Sampled},
};
use lanternfish_scene::{Environment, Light, Material, Scene, generate::demo};

use crate::{
    ACROSS_TEXELS, DeepImageSettings, DeepStore, WITHIN_TEXEL,
    testing::{
        self,
        light::{
            LARGE, closed_box, cornell, floor, image_of, looking, matt, mean, off, rendering, sampled, settings,
            traced_of,
        },
        quad, scene_of,
    },
};

const TRACERS: [Tracer; 2] = [WITHIN_TEXEL, ACROSS_TEXELS];

fn deep(tracer: Tracer, resolution: u32) -> Settings {
    let structure = DeepImageSettings { resolution, ..DeepImageSettings::default() };
    settings(sampled(tracer)).with_structure(structure)
}

/// Light that is known: of a sky and of an environment on a floor, of a lamp in a mirror, and in a closed box that
/// emits evenly its own emission, half of it from all sides, and half of what was reflected once.
#[gpu_test]
fn gpu_known_light_is_found_through_deep_images(gpu: &Gpu) {
    let sky = Vec3::new(1.0, 2.0, 4.0);
    let white = Environment { width: 4, height: 2, pixels: vec![sky; 8], rotation: 0.0 };
    let open = Scene { sky, ..floor(matt(0.5)) };
    let mirror = Material { metallic: 1.0, perceptual_roughness: 0.0, ..matt(0.8) };
    let lamp = Material { emissive: Vec3::new(3.0, 2.0, 1.0), ..matt(0.0) };
    let below = quad(0, Vec3::ZERO, 10.0 * Vec3::X, -10.0 * Vec3::Z);
    let above = quad(1, 2.0 * Vec3::Y, 10.0 * Vec3::X, 10.0 * Vec3::Z);
    let cases = [
        ("sky", open.clone(), ([0.0, 2.0, 2.0], [0.0; 3]), 0.5 * sky, 0.03),
        ("environment", Scene { environment: Some(white), ..open }, ([0.0, 2.0, 2.0], [0.0; 3]), 0.5 * sky, 0.03),
        (
            "mirror",
            scene_of(vec![below, above], vec![mirror, lamp]),
            ([0.0, 1.5, 0.1], [0.0; 3]),
            0.8 * Vec3::new(3.0, 2.0, 1.0),
            0.02,
        ),
        (
            "closed box",
            closed_box(Material { emissive: Vec3::ONE, ..matt(0.5) }),
            ([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]),
            Vec3::splat(1.75),
            0.03,
        ),
    ];
    for tracer in TRACERS {
        for (what, scene, (eye, target), expected, most) in &cases {
            let images = DeepImageSettings { resolution: 128, supersampling: 2, ..DeepImageSettings::default() };
            let settings = settings(sampled(tracer)).with_structure(images);
            let actual = rendering(gpu, settings, scene, &looking(*eye, *target));
            let mean = actual.iter().copied().sum::<Vec3>() / actual.len() as f32;
            assert!((mean / *expected - 1.0).abs().max_element() < *most, "{what}, {tracer}: {mean}, not {expected}");
        }
    }
}

fn bounce(all_light: &[Vec3], direct: &[Vec3]) -> Vec<Vec3> {
    all_light.iter().zip(direct).map(|(a, b)| *a - *b).collect()
}

/// Ground truth: paths of up to three segments through exact triangles. Bounds are about a quarter above the measured
/// values.
#[gpu_test]
fn gpu_one_bounce_through_deep_images_is_the_path_tracers(gpu: &Gpu) {
    let scene = cornell();
    let camera = scene.cameras[0].clone();
    let traced = |depth| traced_of(LARGE, &scene, &camera, depth, 192);
    let ground_truth = bounce(&traced(3), &traced(2));
    let alone = image_of(gpu, LARGE, deep(Tracer::BVH, 128).with_indirect(Indirect::NONE), &scene, &camera);
    for tracer in TRACERS {
        let actual = bounce(&image_of(gpu, LARGE, deep(tracer, 128), &scene, &camera), &alone);
        let (off, energy) = (off(&actual, &ground_truth), mean(&actual) / mean(&ground_truth));
        println!("{tracer}: off by {off:.4}, energy {energy:.4}");
        assert!(off < 0.25 && (energy - 1.0).abs() < 0.09, "{tracer}: off {off}, energy {energy}");
    }
}

/// The inside of a closed box is dark even if its outside is bright: light leaks through walls that are thinner than
/// the distance that deep images skip.
#[gpu_test]
fn gpu_light_leaks_through_deep_images_are_small(gpu: &Gpu) {
    let mut scene = closed_box(matt(0.5));
    // Outside, from above: 1000 lx on the roof.
    scene.lights.push(Light::directional(Vec3::new(0.1, -1.0, 0.2), Vec3::splat(1000.0)));
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    for tracer in TRACERS {
        let actual = rendering(gpu, settings(sampled(tracer)), &scene, &camera);
        // From radiance to irradiance of surfaces of albedo 0.5.
        let inside = mean(&actual) * std::f64::consts::PI / 0.5;
        println!("{tracer}: {inside:.3} lx inside of 1000 outside");
        assert!(inside <= 10.0, "{tracer}: {inside}");
    }
}

const CAMERA: ([f32; 3], [f32; 3]) = ([0.0, 1.0, 2.6], [0.0, 1.0, 0.0]);

/// Deep images lose some of the light before the cache lookup: see their README.
#[gpu_test]
fn gpu_cache_entries_light_hits_of_deep_images(gpu: &Gpu) {
    let (scene, camera) = (cornell(), looking(CAMERA.0, CAMERA.1));
    let cached = |tracer, hit_light| Sampled {
        diffuse_rays: 16,
        glossy_rays: 0,
        hit_light,
        bounces: Bounces::ONE,
        ..sampled(tracer)
    };
    let over_frames = |indirect| settings(sampled(Tracer::BVH)).with_accumulate(8).with_indirect(indirect);
    let direct = mean(&rendering(gpu, over_frames(Indirect::NONE), &scene, &camera));
    let indirect = |rays: Sampled| mean(&rendering(gpu, over_frames(rays.into()), &scene, &camera)) - direct;
    let expected = indirect(cached(Tracer::BVH, HitLight::Shaded));
    for tracer in TRACERS {
        let actual = indirect(cached(tracer, HitLight::Cached)) / expected;
        println!("{tracer}: {actual:.4} of the light");
        assert!((actual - 1.0).abs() < 0.08, "{tracer}: {actual}");
    }
}

/// The result does not depend on the grouping of samples into passes, nor on growth of the cache's table.
#[gpu_test]
fn gpu_rays_through_deep_images_are_the_same_in_any_grouping(gpu: &Gpu) {
    let (scene, camera) = (cornell(), looking(CAMERA.0, CAMERA.1));
    let of = |rounds: u64, first_entries: u32, rays: Sampled| {
        crate::testing::inside::limit_samples_and_first_entries(rounds, first_entries);
        let structure = DeepImageSettings { resolution: 32, ..DeepImageSettings::default() };
        let settings = settings(rays).with_accumulate(2).with_structure(structure);
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        renderer.render(&uploaded, &camera, [31, 23]).unwrap().radiance
    };
    let rays = Sampled { diffuse_rays: 5, glossy_rays: 2, ..sampled(WITHIN_TEXEL) };
    let [one, all] = [1, 16].map(|rounds| of(rounds, 1 << 17, rays));
    assert!(one == all);
    let cached = Sampled { diffuse_rays: 4, hit_light: HitLight::Cached, bounces: Bounces::All, first_rays: 1, ..rays };
    assert!(of(16, 64, cached) == of(16, 1 << 17, cached), "another image while the table grows");
    // Negative control: other rays give another image.
    assert!(of(16, 1 << 17, Sampled { diffuse_rays: 4, ..rays }) != all);
}

#[gpu_test]
fn gpu_every_store_gives_the_same_light(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let of = |store| {
        let deep_images = DeepImageSettings { store, merge_texels: 0.0, ..DeepImageSettings::default() };
        let settings = settings(sampled(WITHIN_TEXEL)).with_structure(deep_images);
        rendering(gpu, settings, &scene, &scene.cameras[0])
    };
    let expected = of(DeepStore::LinearArray);
    for store in [DeepStore::LinkedList, DeepStore::SortedLinkedList] {
        // If several surfaces have the same depth, a linked list may return any of them.
        let off = off(&of(store), &expected);
        assert!(off < 0.01, "{store}: {off}");
    }
}
