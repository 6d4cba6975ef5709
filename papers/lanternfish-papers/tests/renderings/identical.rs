//! Images that must be equal, bit for bit.

use glam::Vec3;
use lanternfish::{
    RenderedImage, Renderer, Settings,
    settings::{Culling, RayCulling, RayRangeCulling, Samples, Shadows, TextureBinding},
    techniques::{Assignment, ClusterShape, Clustered, Grouping, TileSize, Tiled},
};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_papers::{RasterGrid, normals::naive_normals};
use lanternfish_scene::{AlphaMode, Camera, Light, LightKind, Material, Scene, StereoRig, generate};

use crate::{
    normals::render_edited,
    support::{counter, differing, left_out_on_old_software, linear, quad, render},
};

const SIZE: (u32, u32) = (48, 30);
/// In the full tier.
const LARGE: (u32, u32) = (150, 90);

/// The Cornell box with many random small lights, with spots, a sun, and a coloured thin dielectric in front.
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
    let thin_dielectric =
        quad(scene.materials.len() - 1, Vec3::new(0.3, 0.9, 0.7), Vec3::new(0.4, 0.0, 0.2), Vec3::Y * 0.5);
    let mesh = scene.instances[0].mesh;
    scene.meshes[mesh].primitives.push(thin_dielectric);
    (scene, camera)
}

/// Points, spots, a sun, disks and rectangles: every culling technique gives the same image with the same rays.
#[gpu_test(crate::gpu)]
fn gpu_tiles_and_clusters_do_not_change_pixels(gpu: &Gpu) {
    let clustered = |shape, assignment| Culling::from(Clustered { shape, assignment, ..Clustered::default() });
    let cullings = [
        Culling::from(Tiled { tile_size: TileSize::Px32, aabb_test: true }),
        Culling::from(RasterGrid { tile_size: TileSize::Px16, layers: 7 }),
        clustered(ClusterShape::Perspective { pixels: 16 }, Assignment::Hierarchy),
        Culling::from(Tiled { tile_size: TileSize::Px8, aabb_test: false }),
        clustered(ClusterShape::Orthographic { side: 0.25 }, Assignment::BruteForce),
        clustered(ClusterShape::Displaced { pixels: 32, distance: 3.0 }, Assignment::Hierarchy),
    ];
    let (mut scene, camera) = cornell_in_rain(1);
    for (i, light) in scene.lights.iter_mut().enumerate().skip(2).step_by(9) {
        let towards = Vec3::new((i as f32).sin(), -0.5, (2.0 * i as f32).sin()).normalize();
        let (position, range, intensity) = (light.position, light.range, 10.0 * light.intensity);
        let area = match i % 2 {
            0 => Light::disk(position, towards, 0.1, intensity),
            _ => Light::rectangle(position, towards, Vec3::X, [0.3, 0.1], intensity),
        };
        *light = Light { range, ..area };
    }
    // Few rays to areas.
    let usual = Settings::direct_light().with_shadow_rays(2);
    let rendering = |scene: &Scene, culling| render(gpu, scene, &camera, SIZE, usual.clone().with_culling(culling));
    let all = rendering(&scene, Culling::NONE);
    for culling in cullings.into_iter().take(if testing::is_full() { 6 } else { 3 }) {
        let culled = rendering(&scene, culling.clone());
        assert_eq!(differing(&culled, &all), 0, "{culling:?}");
        assert_eq!(culled.display, all.display, "{culling:?}");
        // The same rays, too: an additional light in a list is out of range.
        assert_eq!(counter(&culled, "shadows/rays"), counter(&all, "shadows/rays"), "{culling:?}");
    }
    // Negative control: a light whose range is a tenth shorter gives another image, and so do areas alone.
    let is_seen = |of: fn(&Light) -> bool| {
        let mut shorter = scene.clone();
        let lights = shorter.lights.iter_mut().filter(|light| of(light));
        lights.for_each(|light| light.range = light.range.map(|range| 0.9 * range));
        differing(&rendering(&shorter, Culling::default()), &all) > 40
    };
    assert!(is_seen(|_| true) && is_seen(|light| light.area().is_some()));
    // A scene without its area lights equals one that never had any.
    let mut points = scene.clone();
    points.lights.retain(|light| light.area().is_none());
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), usual.clone()).unwrap();
    let mut uploaded = renderer.upload(&scene).unwrap();
    for (scene, expected) in [(&points, &rendering(&points, Culling::NONE)), (&scene, &all)] {
        renderer.update(&mut uploaded, scene).unwrap();
        let actual = renderer.render(&uploaded, &camera, SIZE.into()).unwrap();
        assert_eq!(differing(&actual, expected), 0, "{} lights", scene.lights.len());
    }
}

/// Two stereo views, and a mirrored one in the opposite direction.
fn views(head: &Camera) -> Vec<Camera> {
    let [left, right] = StereoRig::vive().cameras(head, 0.05);
    let mut back = head.clone();
    back.world_from_camera *= glam::Affine3A::from_rotation_y(3.0);
    vec![left, right, back]
}

fn check_views(gpu: &Gpu, samples: Samples) {
    let (scene, mut head) = cornell_in_rain(1);
    // Into the box: the frusta of the eyes are wide.
    head.world_from_camera *= glam::Affine3A::from_translation(2.0 * Vec3::NEG_Z);
    let cameras = views(&head);
    let renderings = |cameras: &[Camera], culling| {
        let settings = Settings::direct_light().with_culling(culling).with_samples(samples);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let scene = renderer.upload(&scene).unwrap();
        let views: Vec<_> = cameras.iter().map(|camera| (camera, SIZE.into())).collect();
        renderer.render_views(&scene, &views)
    };
    let alone = cameras.iter().map(|c| renderings(std::slice::from_ref(c), Culling::NONE).unwrap().remove(0));
    let alone: Vec<RenderedImage> = alone.collect();
    // Negative control: the eyes do not see the same.
    assert!(differing(&alone[0], &alone[1]) > 100);
    let mut cullings = vec![(Culling::from(Tiled::default()), 3), (Culling::from(RasterGrid::default()), 3)];
    for shape in [
        ClusterShape::Perspective { pixels: 32 },
        ClusterShape::Displaced { pixels: 32, distance: 2.0 },
        ClusterShape::Orthographic { side: 0.3 },
    ] {
        for grouping in Grouping::ALL.iter().copied() {
            let culling = Culling::from(Clustered { shape, grouping, ..Clustered::default() });
            // No perspective grid covers views with opposite directions.
            let through_eye = !matches!(shape, ClusterShape::Orthographic { .. });
            if through_eye && grouping == Grouping::Enclosed {
                let error = renderings(&cameras, culling.clone()).unwrap_err().to_string();
                assert!(error.contains("ortho:"), "{error}");
            }
            cullings.push((culling, if through_eye { 2 } else { 3 }));
        }
    }
    for (culling, count) in cullings {
        let together = renderings(&cameras[..count], culling.clone()).unwrap();
        for (i, (together, alone)) in together.iter().zip(&alone).enumerate() {
            assert_eq!(differing(together, alone), 0, "view {i}, {samples} samples, {culling:?}");
        }
    }
}

#[gpu_test(crate::gpu)]
fn gpu_views_that_share_clusters_equal_single_views(gpu: &Gpu) {
    check_views(gpu, Samples::One);
}

#[gpu_test(full, crate::gpu)]
fn gpu_samples_of_views_that_share_clusters_equal_those_of_single_views(gpu: &Gpu) {
    check_views(gpu, Samples::Four);
}

/// More samples smooth edges: the image is closer to the mean of a much larger one.
#[gpu_test(full, crate::gpu)]
fn gpu_more_samples_are_closer_to_the_ground_truth_at_edges(gpu: &Gpu) {
    // The atrium has edges where walls, steps and mouldings touch: points beside their triangle are inside another one.
    // Measured: 0.45 and 0.63; with shading at the pixels' centres: 0.61 and 0.73.
    for (name, (scene, camera), scale, most) in
        [("the box", cornell_in_rain(1), 8, 0.53), ("the atrium", atrium(), 4, 0.66)]
    {
        let (one, four) = errors_at_edges(gpu, &scene, &camera, scale);
        println!("{name}: root mean square error: {one:.4} with one sample, {four:.4} with four");
        assert!(four < most * one, "{name}: {four} and {one}");
    }
}

/// Root mean square errors with one and with four samples per pixel, against an image `fine` times as wide and high.
fn errors_at_edges(gpu: &Gpu, scene: &Scene, camera: &Camera, fine: u32) -> (f64, f64) {
    let rendering = |samples, scale: u32| {
        let settings = Settings::direct_light().with_samples(samples);
        linear(&render(gpu, scene, camera, (scale * LARGE.0, scale * LARGE.1), settings))
    };
    // Values above the display range are ignored: highlights are not triangle edges.
    let ground_truth = rendering(Samples::One, fine).box_downsampled(fine as usize).unwrap();
    let error = |samples| {
        let image = rendering(samples, 1);
        let squares = image
            .pixels
            .iter()
            .flatten()
            .zip(ground_truth.pixels.iter().flatten())
            .map(|(a, b)| f64::from(a.min(1.0) - b.min(1.0)).powi(2));
        (squares.sum::<f64>() / ground_truth.pixels.len() as f64).sqrt()
    };
    (error(Samples::One), error(Samples::Four))
}

#[gpu_test(crate::gpu)]
fn gpu_images_are_the_same_from_run_to_run(gpu: &Gpu) {
    let (scene, camera) = cornell_in_rain(3);
    let (other, other_camera) = cornell_in_rain(4);
    for culling in [Culling::default(), Culling::from(RasterGrid::default())] {
        let settings = || Settings::direct_light().with_shadows(Shadows::BVH).with_culling(culling.clone());
        let first = render(gpu, &scene, &camera, SIZE, settings());
        // A renderer that has rendered other images reuses lists and targets, without an effect on the image.
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings()).unwrap();
        let (scene, other) = (renderer.upload(&scene).unwrap(), renderer.upload(&other).unwrap());
        renderer.render(&other, &other_camera, [SIZE.0 + 13, SIZE.1 - 20]).unwrap();
        for run in 0..2 {
            let again = renderer.render(&scene, &camera, SIZE.into()).unwrap();
            assert_eq!(differing(&again, &first), 0, "run {run} of one renderer");
        }
        // Negative control.
        assert!(differing(&renderer.render(&other, &camera, SIZE.into()).unwrap(), &first) > 100);
    }
}

fn atrium() -> (Scene, Camera) {
    let scene = generate::demo("atrium").unwrap();
    let camera = scene.cameras[0].clone();
    (scene, camera)
}

#[gpu_test(crate::gpu)]
fn gpu_texture_arrays_do_not_change_pixels(gpu: &Gpu) {
    let test = "gpu_texture_arrays_do_not_change_pixels";
    if !gpu.description.texture_arrays {
        return testing::left_out(test, "this adapter has no texture arrays");
    }
    let (scene, camera) = atrium();
    // Means of frames use other texture gradients.
    let usual = Settings::direct_light().with_shadows(Shadows::None);
    let renderings = |scene: &Scene, textures| {
        let settings = usual.clone().with_textures(textures);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
        let uploaded = renderer.upload(scene).unwrap();
        [1, 3].map(|frames| {
            renderer.set(settings.clone().with_accumulate(frames)).unwrap();
            renderer.render(&uploaded, &camera, SIZE.into()).unwrap()
        })
    };
    // Negative control: with the textures in another order.
    let mut reordered = scene.clone();
    reordered.textures.rotate_left(1);
    let array = renderings(&scene, TextureBinding::Array);
    for (scene, is_same) in [(&scene, true), (&reordered, false)] {
        for (each, array) in renderings(scene, TextureBinding::PerMaterial).iter().zip(&array) {
            let differ = differing(each, array);
            assert!(if is_same { differ == 0 } else { differ > 100 }, "{differ} pixels, the same textures: {is_same}");
        }
    }
}

#[gpu_test(crate::gpu)]
fn gpu_a_thousand_lights_over_one_tile(gpu: &Gpu) {
    let mut scene = generate::demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    scene.lights = generate::light_rain(&scene.bounds(), 1000, Some(3.0), 5, 0.0);
    let rendering = |culling, count: usize| {
        let scene = Scene { lights: scene.lights[..count].to_vec(), ..scene.clone() };
        render(gpu, &scene, &camera, (16, 16), Settings::direct_light().with_culling(culling))
    };
    let all = rendering(Culling::NONE, 1000);
    let tiled = rendering(Culling::default(), 1000);
    // One tile of 16 pixels covers the image.
    let listed = counter(&tiled, "light_culling/listed_lights");
    println!("{listed} lights over one tile, {} rays", counter(&tiled, "shadows/rays"));
    assert!(listed > 900, "{listed} lights over one tile");
    assert_eq!(differing(&tiled, &all), 0);
    // Negative control: the last hundred of the lights shows.
    assert!(differing(&rendering(Culling::default(), 900), &all) > 100, "the lights from 900 on do not show");
}

/// Images of `size`, pixels; large ones show where normals from depth are wrong.
fn check_rays_to_lights_behind(gpu: &Gpu, scenes: &[(Scene, Camera)], size: (u32, u32)) {
    for (scene, camera) in scenes {
        let settings = |ray_culling, ray_range_culling| {
            Settings::direct_light()
                .with_ray_culling(ray_culling)
                .with_ray_range_culling(ray_range_culling)
                .with_shadows(Shadows::BVH)
        };
        let rendering =
            |ray_culling, ray_range_culling| render(gpu, scene, camera, size, settings(ray_culling, ray_range_culling));
        let rays = |rendering: &RenderedImage| counter(rendering, "shadows/rays");
        let none = rendering(RayCulling::None, RayRangeCulling::Off);
        let range = rendering(RayCulling::None, RayRangeCulling::On);
        let facing = rendering(RayCulling::Surface, RayRangeCulling::Off);
        let surface = rendering(RayCulling::Surface, RayRangeCulling::On);
        for culled in [&range, &facing, &surface] {
            assert_eq!(differing(culled, &none), 0, "{}", scene.name);
        }
        // Each kind leaves out rays that the other traces.
        assert!(rays(&range) < rays(&none) && rays(&facing) < rays(&none), "{}: no ray was saved", scene.name);
        assert!(rays(&surface) < rays(&range).min(rays(&facing)), "{}: both save no more than one", scene.name);
        if size != LARGE {
            continue;
        }
        // Normals from depth are wrong at edges, the five-sample variant less often [Elagabani2025, §4.3.1].
        let improved = rendering(RayCulling::Improved, RayRangeCulling::On);
        let by_improved = settings(RayCulling::Improved, RayRangeCulling::On);
        let naive = render_edited(gpu, scene, camera, size, by_improved, naive_normals());
        let wrong = [differing(&naive, &none), differing(&improved, &none)];
        assert!(wrong[1] < wrong[0], "{}: {wrong:?}", scene.name);
    }
}

#[gpu_test(crate::gpu)]
fn gpu_rays_to_lights_behind_a_surface_do_not_change_pixels(gpu: &Gpu) {
    check_rays_to_lights_behind(gpu, &[cornell_in_rain(6)], SIZE);
}

#[gpu_test(full, crate::gpu)]
fn gpu_rays_to_lights_behind_surfaces_of_large_images_do_not_change_pixels(gpu: &Gpu) {
    let test = "gpu_rays_to_lights_behind_surfaces_of_large_images_do_not_change_pixels";
    if left_out_on_old_software(test, gpu, "2 pixels of the atrium differ there; the cause is not known") {
        return;
    }
    let (mut atrium, camera) = atrium();
    atrium.lights.extend(generate::light_rain(&atrium.bounds(), 60, Some(4.0), 6, 0.0));
    check_rays_to_lights_behind(gpu, &[cornell_in_rain(6), (atrium, camera)], LARGE);
}

#[gpu_test(crate::gpu)]
fn gpu_depth_alone_needs_no_surface_target(gpu: &Gpu) {
    let (scene, camera) = cornell_in_rain(6);
    let rendering = |ray_culling, shadows| {
        let settings = Settings::direct_light().with_ray_culling(ray_culling).with_shadows(shadows);
        // A pool of its own, whose memory is that of this frame.
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let image = renderer.render(&uploaded, &camera, SIZE.into()).unwrap();
        (image, renderer.memory().bytes)
    };
    let (surface, improved) =
        (rendering(RayCulling::Surface, Shadows::BVH), rendering(RayCulling::Improved, Shadows::BVH));
    let depth = rendering(RayCulling::Depth, Shadows::BVH);
    let unshadowed = rendering(RayCulling::Surface, Shadows::None);
    let pixels = u64::from(SIZE.0 * SIZE.1);
    // The scene has a pane, and rays from depth alone do not see it.
    assert_eq!(improved.1 - depth.1, (8 + 32) * pixels, "bytes of the surface target, and of light through panes");
    assert_eq!(counter(&depth.0, "shadows/rays"), counter(&improved.0, "shadows/rays"), "the culling is the same");
    let wrong = [&improved, &depth, &unshadowed].map(|image| differing(&image.0, &surface.0) as f64 / pixels as f64);
    println!("of all pixels differ: {wrong:?} (improved, depth, no shadows)");
    assert!(wrong[1] < 0.5 * wrong[2] && wrong[1] >= wrong[0], "{wrong:?}");
}
