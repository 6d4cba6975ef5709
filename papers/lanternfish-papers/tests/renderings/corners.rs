//! Images at the limits of valid requests.

use glam::Vec3;
use lanternfish::{
    Settings,
    settings::{Culling, DebugView, Indirect, Occlusion, RayCulling, Samples, Shadows},
};
use lanternfish_papers::{ACROSS_TEXELS, Deep, DeepImageSettings};
use lanternfish_scene::{Light, Scene, generate};

use crate::support::{Front, bits, render};

#[gpu_test(crate::gpu)]
fn gpu_empty_scenes_show_the_sky(gpu: &Gpu) {
    let sky = Vec3::new(0.25, 0.5, 2.0);
    let light = Light::point(Vec3::ONE, Vec3::ONE);
    let mut choices = vec![(Shadows::None, Culling::NONE), (Shadows::BVH, Culling::default())];
    choices.extend(gpu.description.ray_query.then_some((Shadows::RAY_QUERY, Culling::default())));
    for (shadows, culling) in choices {
        let settings = Settings::direct_light().with_shadows(shadows).with_culling(culling);
        for lights in [vec![], vec![light.clone()]] {
            let front = Front::render(gpu, &Scene { sky, lights, ..Scene::default() }, settings.clone());
            assert!(front.0.radiance.iter().all(|texel| *texel == [sky.x, sky.y, sky.z, 0.0]), "{shadows}");
        }
    }
}

#[gpu_test(crate::gpu)]
fn gpu_a_scene_without_lights_is_dark_except_for_emission(gpu: &Gpu) {
    let mut scene = generate::demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    let lit = render(gpu, &scene, &camera, (40, 40), Settings::direct_light());
    let bright =
        |rendering: &lanternfish::RenderedImage| rendering.radiance.iter().filter(|texel| texel[0] > 0.0).count();
    assert!(bright(&lit) > 1000, "negative control");
    scene.lights.clear();
    let usual = Settings::direct_light();
    let images = DeepImageSettings { resolution: 16, ..DeepImageSettings::default() };
    let deep = usual.clone().with_shadows(Shadows::Traced(ACROSS_TEXELS)).with_structure(images);
    let is_faulty = lanternfish_gpu::faulty_software(&gpu.device.adapter_info());
    let mut all = vec![usual.clone().with_culling(Culling::NONE), usual.clone(), usual.with_light_radius(0.1)];
    // Old drivers crash on shadows through deep images.
    all.extend((!is_faulty).then_some([deep.clone(), deep.with_light_radius(0.1)]).into_iter().flatten());
    for settings in all {
        let dark = render(gpu, &scene, &camera, (40, 40), settings.clone());
        // The lamp is an emissive quad.
        let glowing = dark.radiance.iter().filter(|texel| texel[..3] == [17.0, 12.0, 4.0]).count();
        assert!(glowing > 0 && bright(&dark) == glowing, "{settings:?}: {glowing} glow, {} are bright", bright(&dark));
    }
}

#[gpu_test(crate::gpu)]
fn gpu_any_size_shows_the_same_scene(gpu: &Gpu) {
    let mut scene = generate::demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    scene.lights.extend(generate::light_rain(&scene.bounds(), 40, Some(1.0), 1, 0.0));
    for size in [(1, 1), (1, 9), (9, 1), (16, 16), (37, 23)] {
        for view in [None, Some(DebugView::Depth), Some(DebugView::LightCount), Some(DebugView::RayCount)] {
            let settings = |culling| Settings::direct_light().with_culling(culling).with_debug_view(view);
            let tiled = render(gpu, &scene, &camera, size, settings(Culling::default()));
            assert_eq!(tiled.radiance.len(), (size.0 * size.1) as usize);
            assert_eq!(tiled.display.len(), tiled.radiance.len());
            let sum: f32 = tiled.radiance.iter().map(|texel| texel[1]).sum();
            assert!(sum > 0.0 && sum.is_finite(), "{size:?}: {sum}");
            if view.is_none() {
                let all = render(gpu, &scene, &camera, size, settings(Culling::NONE));
                assert_eq!(bits(&tiled), bits(&all), "{size:?}");
            }
        }
    }
}

#[gpu_test(crate::gpu)]
fn gpu_debug_views_do_not_change_the_radiance(gpu: &Gpu) {
    let mut scene = generate::demo("cornell").unwrap();
    // A single light has the same colour in every heat map of lights.
    scene.lights.extend(generate::light_rain(&scene.bounds(), 60, Some(0.5), 2, 0.0));
    let camera = scene.cameras[0].clone();
    let plain = render(gpu, &scene, &camera, (40, 30), Settings::direct_light());
    let mut displays = vec![plain.display.clone()];
    for view in DebugView::ALL.iter().copied() {
        // One view enables occlusion, which is otherwise off; under a black sky it adds no light.
        let occlusion = match view {
            DebugView::Occlusion => Occlusion::from(Deep::default()),
            _ => Occlusion::NONE,
        };
        // Another view needs indirect light to show any.
        let indirect = if view == DebugView::Indirect { Indirect::default() } else { Indirect::NONE };
        let settings =
            Settings::direct_light().with_debug_view(Some(view)).with_occlusion(occlusion).with_indirect(indirect);
        let rendering = render(gpu, &scene, &camera, (40, 30), settings.clone());
        if view == DebugView::BaseColor {
            assert_ne!(bits(&rendering), bits(&plain));
        } else if view == DebugView::Indirect {
            let with_indirect = render(gpu, &scene, &camera, (40, 30), settings.with_debug_view(None));
            assert_eq!(bits(&rendering), bits(&with_indirect), "{view}");
        } else {
            assert_eq!(bits(&rendering), bits(&plain), "{view}");
        }
        if view == DebugView::Nan {
            assert!(rendering.display.iter().all(|texel| texel[0] == texel[1]), "NaN in some pixel");
            // This view shows the result of several samples.
            let samples = Settings::direct_light().with_debug_view(Some(view)).with_samples(Samples::Four);
            let rendering = render(gpu, &scene, &camera, (40, 30), samples);
            assert!(rendering.display.iter().all(|texel| texel[0] == texel[1]), "NaN in some sample");
        }
        displays.push(rendering.display);
    }
    // All images differ, except that on these flat walls all normals agree up to the few edges.
    displays.sort();
    let all = displays.len();
    displays.dedup();
    assert!(displays.len() + 1 >= all, "{} of {all} images are different", displays.len());
}

#[gpu_test(crate::gpu)]
fn gpu_every_ray_culling_renders_without_depth(gpu: &Gpu) {
    // One pixel of sky beside one of wall: normals from depth sample across the border into the sky.
    let scene = generate::demo("cornell").unwrap();
    for ray_culling in RayCulling::ALL.iter().copied() {
        for size in [(1, 1), (3, 1)] {
            let settings = Settings::direct_light().with_ray_culling(ray_culling).with_shadows(Shadows::BVH);
            let rendering = render(gpu, &scene, &scene.cameras[0], size, settings);
            assert!(rendering.radiance.iter().flatten().all(|v| v.is_finite()), "{ray_culling} at {size:?}");
        }
    }
}
