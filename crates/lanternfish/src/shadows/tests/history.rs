//! Temporal accumulation of soft shadows.

use glam::Vec3;
use lanternfish_gpu::testing;
use lanternfish_scene::{Camera, Light, Scene, generate};

use crate::{
    Renderer, Settings,
    settings::{Attenuation, History, Samples, Shadows},
    testing::walks::{SIZE, mean, off, pixels, renderer, steps, walked},
};

fn settings(history: History, shadow_rays: u32) -> Settings {
    let attenuation = Attenuation::Physical;
    Settings::direct_light()
        .with_light_radius(0.15)
        .with_shadow_rays(shadow_rays)
        .with_history(history)
        .with_attenuation(attenuation)
        .with_shadows(Shadows::BVH)
}

/// Two lamps of different colours in the Cornell box. The blocks occlude one of them from much of the floor.
fn box_of_two() -> Scene {
    let mut scene = generate::demo("cornell").unwrap();
    scene.lights = vec![
        Light::point(Vec3::new(0.4, 1.7, 0.5), Vec3::new(3.0, 2.0, 0.5)),
        Light::point(Vec3::new(-0.7, 1.2, 0.6), Vec3::new(0.3, 0.8, 2.0)),
    ];
    scene
}

/// The same scene with a rectangle light.
fn with_rectangle() -> Scene {
    let mut scene = box_of_two();
    scene.lights.truncate(1);
    let down = Light::rectangle(Vec3::new(-0.4, 1.8, 0.2), -Vec3::Y, Vec3::X, [0.6, 0.3], Vec3::splat(6.0));
    scene.lights.push(down);
    scene
}

/// A renderer's first image and a mean of frames are bitwise the same with and without a history; hard shadows always are.
#[gpu_test]
fn gpu_first_images_and_hard_shadows_are_the_same_with_a_history(gpu: &Gpu) {
    // Hard lights between area lights: all are summed in the order of the list.
    let mut mixed = with_rectangle();
    mixed.lights.insert(1, Light::directional(Vec3::new(0.3, -1.0, -0.4), Vec3::splat(0.7)));
    mixed.lights.push(Light::point(Vec3::new(0.5, 0.9, 0.7), Vec3::new(0.2, 0.3, 0.1)));
    for light_radius in if testing::is_full() { vec![0.15, 0.0] } else { vec![0.15] } {
        for (accumulate, samples) in [(1, Samples::One), (5, Samples::Four)] {
            let of = |history| {
                let settings = settings(history, 2)
                    .with_accumulate(accumulate)
                    .with_samples(samples)
                    .with_light_radius(light_radius);
                walked(gpu, settings, &mixed, &steps(1))
            };
            assert!(of(History::Off) == of(History::On), "{accumulate} frames, {samples:?}");
        }
    }
    let hard = |history| walked(gpu, settings(history, 2).with_light_radius(0.0), &box_of_two(), &steps(4));
    assert!(hard(History::Off) == hard(History::On));
}

/// While the camera moves, accumulation reduces the noise and keeps the mean light. At rest, means are as accurate as without it.
#[gpu_test]
fn gpu_history_reduces_soft_shadow_noise_in_motion(gpu: &Gpu) {
    let walk = steps(16);
    let last = &walk[walk.len() - 1..];
    // A disk and a rectangle.
    let scene = with_rectangle();
    let mean_ground_truth = walked(gpu, settings(History::Off, 32).with_accumulate(16), &scene, last);
    let hard = walked(gpu, settings(History::Off, 32).with_light_radius(0.0), &scene, last);
    // Of one frame, through the pixel centres.
    let ground_truth = walked(gpu, settings(History::Off, 255), &scene, last);
    let [without, with] = [History::Off, History::On].map(|history| walked(gpu, settings(history, 2), &scene, &walk));
    let [noise, accumulated] = [&without, &with].map(|rendering| off(rendering, &ground_truth));
    let light_ratio = mean(&with) / mean(&ground_truth);
    println!(
        "off by {noise:.4} without, {accumulated:.4} with; {light_ratio:.4} of the light; hard {:.4}",
        off(&hard, &ground_truth)
    );
    assert!(accumulated < 0.6 * noise && (light_ratio - 1.0).abs() < 0.01, "{noise} {accumulated} {light_ratio}");

    let rested = |history| {
        let mut renderer = renderer(gpu, settings(history, 2));
        let uploaded = renderer.upload(&scene).unwrap();
        let mut refine = |camera: &Camera| {
            let renderings = renderer.refine(&uploaded, &[(camera, SIZE.into())]).unwrap();
            pixels(&renderings[0])
        };
        walk.iter().for_each(|camera| drop(refine(camera)));
        (0..31).map(|_| refine(&last[0])).last().unwrap()
    };
    let [without, with] = [History::Off, History::On].map(|history| off(&rested(history), &mean_ground_truth));
    println!("at rest: off by {without:.4} without, {with:.4} with");
    assert!(with < 1.1 * without, "{without} {with}");
}

fn shiny() -> Scene {
    let mut scene = box_of_two();
    for material in &mut scene.materials {
        (material.perceptual_roughness, material.metallic) = (0.2, 0.5);
    }
    scene
}

/// The noise of one lamp's shadow does not affect another lamp's highlight.
#[gpu_test]
fn gpu_a_highlight_beside_a_penumbra_stays_clean(gpu: &Gpu) {
    let mut scene = shiny();
    // One lamp is mirrored in the back wall, unoccluded; the tall block hides the other one.
    scene.lights[0].position = Vec3::new(0.0, 1.0, 0.9);
    scene.lights[1].position = Vec3::new(-0.9, 0.5, 0.5);
    let walk = steps(12);
    let last = &walk[walk.len() - 1..];
    let ground_truth = walked(gpu, settings(History::Off, 255), &scene, last);
    let [noise, accumulated] = [History::Off, History::On]
        .map(|history| off(&walked(gpu, settings(history, 2), &scene, &walk), &ground_truth));
    println!("off by {noise:.4} without, {accumulated:.4} with");
    assert!(accumulated < 0.7 * noise, "{noise} {accumulated}");
}

/// A mirrored rectangle: no spots at its fixed points. The mean light of one walk has much variance: several walks of different lengths.
#[gpu_test(full)]
fn gpu_a_highlight_of_a_rectangle_stays_clean(gpu: &Gpu) {
    let mut scene = shiny();
    scene.lights = with_rectangle().lights.split_off(1);
    let walks = [6, 8, 10, 12, 14, 16].map(|length| {
        let walk = steps(length);
        let last = &walk[walk.len() - 1..];
        let ground_truth = walked(gpu, settings(History::Off, 32).with_accumulate(32), &scene, last);
        let [without, with] =
            [History::Off, History::On].map(|history| walked(gpu, settings(history, 4), &scene, &walk));
        [off(&without, &ground_truth), off(&with, &ground_truth), mean(&with) / mean(&ground_truth)]
    });
    let [noise, accumulated, light] =
        [0, 1, 2].map(|i| walks.iter().map(|walk| walk[i]).sum::<f32>() / walks.len() as f32);
    println!("a rectangle: off by {noise:.4} without, {accumulated:.4} with; {light:.4} of the light");
    assert!(accumulated < 0.9 * noise && (light - 1.0).abs() < 0.02, "{noise} {accumulated} {light}");
}

/// The shadow of a lamp that moves follows it.
#[gpu_test]
fn gpu_a_soft_shadow_follows_its_lamp(gpu: &Gpu) {
    let camera = &steps(1)[0];
    let before = box_of_two();
    let mut after = before.clone();
    after.lights[0].position.x = -0.5;
    let ground_truth = walked(gpu, settings(History::Off, 255), &after, &steps(1));
    let alone = off(&walked(gpu, settings(History::Off, 2), &after, &steps(1)), &ground_truth);
    let mut renderer = renderer(gpu, settings(History::On, 2));
    let mut uploaded = renderer.upload(&before).unwrap();
    let render = |renderer: &mut Renderer, uploaded: &crate::GpuScene| {
        pixels(&renderer.render(uploaded, camera, SIZE.into()).unwrap())
    };
    (0..16).for_each(|_| drop(render(&mut renderer, &uploaded)));
    let settled = off(&render(&mut renderer, &uploaded), &walked(gpu, settings(History::Off, 255), &before, &steps(1)));
    renderer.update(&mut uploaded, &after).unwrap();
    let frames: Vec<f32> = (0..16).map(|_| off(&render(&mut renderer, &uploaded), &ground_truth)).collect();
    println!("settled {settled:.4}; after the move {:.4?}; a frame alone {alone:.4}", [0, 3, 15].map(|k| frames[k]));
    assert!(settled < 0.5 * alone);
    assert!(frames[0] < 1.1 * alone && frames[3] < 0.8 * alone && frames[15] < 0.5 * alone, "{frames:?}");
}
