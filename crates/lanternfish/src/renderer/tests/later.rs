//! Frames with deferred readback show the same images as frames with blocking readback, or the last complete image.

use glam::{Affine3A, Vec3};
use lanternfish_gpu::{Gpu, Growth, testing};
use lanternfish_scene::{
    Camera,
    generate::{demo, light_rain},
};

use crate::{
    RenderedImage, Renderer,
    settings::Culling,
    testing::later::{Path, check, settings, walk},
};

/// Lights of the atrium become many and few again, while the camera moves.
fn check_deferred(gpu: &Gpu, cullings: &[Culling]) {
    let scene = demo("atrium").unwrap();
    let camera = scene.cameras[0].clone();
    let step = |i: usize| {
        let towards = Affine3A::from_translation(0.02 * i as f32 * Vec3::NEG_Z);
        let camera = Camera { world_from_camera: camera.world_from_camera * towards, ..camera.clone() };
        (camera, [10, 3000, 10, 6000][i / 6 % 4])
    };
    let path = Path { scene: scene.clone(), range: 3.0, size: [32, 24], step: &step, frames: 24 };
    for culling in cullings {
        let outcome = walk(gpu, &settings(culling.clone()), &path);
        println!("{}: {outcome:?}", culling.name());
        check(&outcome);
    }
}

#[gpu_test]
fn gpu_deferred_frames_show_only_complete_images(gpu: &Gpu) {
    check_deferred(gpu, &[Culling::default()]);
}

#[gpu_test(full)]
fn gpu_deferred_frames_of_every_culling_show_only_complete_images(gpu: &Gpu) {
    check_deferred(gpu, &Culling::all());
}

#[gpu_test]
fn gpu_a_mean_contains_only_complete_frames(gpu: &Gpu) {
    let mut scene = demo("cornell").unwrap();
    scene.lights.extend(light_rain(&scene.bounds(), 3000, Some(2.0), 1, 0.0));
    let mean_after = |growth: Growth, frames: u32| {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings(Culling::default())).unwrap();
        renderer.set_growth(growth).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let refine = |renderer: &mut Renderer| {
            let rendering: RenderedImage =
                renderer.refine(&uploaded, &[(&scene.cameras[0], [24, 16])]).unwrap().remove(0);
            rendering.radiance
        };
        let mut last = Vec::new();
        // `refine` reads the image and so waits between frames: the next frame has the missing capacity.
        let lacking = if growth == Growth::Deferred { 1 } else { 0 };
        for i in 0..frames + lacking {
            last = refine(&mut renderer);
            if i == 0 && growth == Growth::Deferred {
                assert!(last.iter().all(|texel| texel[..3] == [0.0; 3]), "the first frame was complete");
                // The same frames again, with the larger lists.
                renderer.reset();
            }
        }
        let pool = renderer.pool.get_mut().unwrap();
        (last, pool.waits(), pool.arrived().held)
    };
    let (expected, waits, _) = mean_after(Growth::Blocking, 4);
    let (actual, none, held) = mean_after(Growth::Deferred, 4);
    assert_eq!((none, held), (0, 1));
    assert!(waits >= 8 && actual == expected, "not the mean of the same frames");
    // Check that the test can fail: one more frame gives another mean.
    assert!(actual != mean_after(Growth::Deferred, 5).0);
}

/// Ten lights become a hundred thousand and ten again, while the camera moves through Sponza.
#[gpu_test(full)]
fn gpu_a_path_through_sponza_never_waits(gpu: &Gpu) {
    let test = "gpu_a_path_through_sponza_never_waits";
    let Some(file) = testing::shared(test, "assets/sponza/Sponza.glb") else { return };
    let scene = lanternfish_scene::load(&file).unwrap();
    let camera = scene.default_camera(64.0 / 36.0);
    const FRAMES: usize = 96;
    let step = |i: usize| {
        let way = i as f32 / FRAMES as f32;
        let rotation = Affine3A::from_rotation_y(0.5 * (std::f32::consts::TAU * way).sin());
        let towards = Affine3A::from_translation(way * 3.0 * Vec3::NEG_Z);
        let camera = Camera { world_from_camera: camera.world_from_camera * rotation * towards, ..camera.clone() };
        // Multiplied by ten every eight frames, then divided by ten.
        let decade = [1, 1, 2, 3, 4, 5, 5, 4, 3, 2, 1, 1][i / 8];
        (camera, 10u32.pow(decade))
    };
    let path = Path { scene: scene.clone(), range: 1.0, size: [64, 36], step: &step, frames: FRAMES };
    let outcome = walk(gpu, &settings(Culling::default()), &path);
    println!("{outcome:?}");
    check(&outcome);
}
