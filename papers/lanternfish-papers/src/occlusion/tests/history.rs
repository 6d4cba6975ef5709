//! Temporal accumulation of ambient visibility.

use glam::{Affine3A, Vec3};
use lanternfish::{
    Settings,
    settings::{History, Shadows},
};
use lanternfish_scene::{Scene, generate};

use crate::{
    Deep, DeepImageSettings, DirectionSet,
    testing::{
        self,
        walks::{SIZE, mean, off, pixels, renderer, steps, walked},
    },
};

/// Light from the environment only.
fn settings(history: History) -> Settings {
    let directions = DirectionSet::ZonalEqualArea { count: 40 };
    Settings::direct_light()
        .with_occlusion(Deep::default())
        .with_history(history)
        .with_shadows(Shadows::None)
        .with_structure(DeepImageSettings { resolution: 32, directions, ..DeepImageSettings::default() })
}

/// The Cornell box without a lamp, under a sky.
fn under_sky() -> Scene {
    let mut scene = generate::demo("cornell").unwrap();
    scene.lights.clear();
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    scene.sky = Vec3::ONE;
    scene
}

/// While the camera moves, the random texels of the frames average out: less noise, the same light.
#[gpu_test]
fn gpu_a_camera_that_moves_takes_the_noise_of_ambient_visibility_away(gpu: &Gpu) {
    let walk = steps(16);
    let last = &walk[walk.len() - 1..];
    let scene = under_sky();
    // The direction set is rotated between the frames of a mean, not between frames: at rest, the frames average over all texels.
    let mut rested = renderer(gpu, settings(History::On));
    let uploaded = rested.upload(&scene).unwrap();
    let ground_truth = (0..48).map(|_| rested.render(&uploaded, &last[0], SIZE.into()).unwrap()).last().unwrap();
    let ground_truth = pixels(&ground_truth);
    let [without, with] = [History::Off, History::On].map(|history| walked(gpu, settings(history), &scene, &walk));
    let [noise, accumulated] = [&without, &with].map(|rendering| off(rendering, &ground_truth));
    let light = mean(&with) / mean(&ground_truth);
    println!("error {noise:.4} without, {accumulated:.4} with; {light:.4} of the light");
    assert!(accumulated < 0.8 * noise && (light - 1.0).abs() < 0.01, "{noise} {accumulated} {light}");
}

/// History is reset in the frame in which something has moved: the image equals that of a single frame, to the bit.
#[gpu_test]
fn gpu_moved_objects_reset_the_history_of_ambient_visibility(gpu: &Gpu) {
    let camera = &steps(1)[0];
    let before = under_sky();
    let mut after = before.clone();
    let block = after.instances.last_mut().expect("the box has blocks");
    block.world_from_object = Affine3A::from_translation(Vec3::new(0.3, 0.4, 0.2)) * block.world_from_object;
    let mut renderer = renderer(gpu, settings(History::On));
    let mut uploaded = renderer.upload(&before).unwrap();
    (0..8).for_each(|_| drop(renderer.render(&uploaded, camera, SIZE.into()).unwrap()));
    renderer.update(&mut uploaded, &after).unwrap();
    let moved = pixels(&renderer.render(&uploaded, camera, SIZE.into()).unwrap());
    let alone = walked(gpu, settings(History::Off), &after, &steps(1));
    let later = (0..8).map(|_| renderer.render(&uploaded, camera, SIZE.into()).unwrap()).last().unwrap();
    assert!(moved == alone, "error {}", off(&moved, &alone));
    // Later frames accumulate the new state.
    assert!(off(&pixels(&later), &alone) < 0.05, "{}", off(&pixels(&later), &alone));
    // Negative control: the block's motion is visible.
    let alone_before = walked(gpu, settings(History::Off), &before, &steps(1));
    assert!(off(&alone_before, &alone) > 0.01);
}
