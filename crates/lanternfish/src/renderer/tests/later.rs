//! Frames that never wait show what frames that wait show, or what they showed last.

use glam::{Affine3A, Vec3};
use lanternfish_gpu::{Growth, testing};
use lanternfish_scene::{
    Camera,
    generate::{demo, light_rain},
};

use crate::{
    RenderedImage, Renderer,
    settings::Culling,
    testing::later::{Path, check, settings, walk},
};

#[test]
fn gpu_frames_that_do_not_wait_show_whole_images_alone() {
    let Some(gpu) = testing::gpu("gpu_frames_that_do_not_wait_show_whole_images_alone") else { return };
    let scene = demo("atrium").unwrap();
    let camera = scene.cameras[0].clone();
    let step = |i: usize| {
        let towards = Affine3A::from_translation(0.02 * i as f32 * Vec3::NEG_Z);
        let camera = Camera { world_from_camera: camera.world_from_camera * towards, ..camera.clone() };
        (camera, [10, 3000, 10, 6000][i / 6 % 4])
    };
    let path = Path { scene: scene.clone(), range: 3.0, size: [32, 24], step: &step, frames: 24 };
    for culling in Culling::all() {
        let name = culling.name();
        let outcome = walk(gpu, &settings(culling), &path);
        println!("{name}: {outcome:?}");
        check(&outcome);
    }
}

#[test]
fn gpu_a_mean_is_of_whole_frames_alone() {
    let Some(gpu) = testing::gpu("gpu_a_mean_is_of_whole_frames_alone") else { return };
    let mut scene = demo("cornell").unwrap();
    scene.lights.extend(light_rain(&scene.bounds(), 3000, Some(2.0), 1, 0.0));
    let mean_after = |growth: Growth, frames: u32| {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings(Culling::default())).unwrap();
        renderer.set_growth(growth).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let refine = |renderer: &mut Renderer| {
            let rendering: RenderedImage =
                renderer.refine(&uploaded, &[(&scene.cameras[0], 24, 16)]).unwrap().remove(0);
            rendering.radiance
        };
        let mut last = Vec::new();
        // `refine` reads the image, and so waits between frames: room that is lacking is there for the next.
        let lacking = if growth == Growth::Deferred { 1 } else { 0 };
        for i in 0..frames + lacking {
            last = refine(&mut renderer);
            if i == 0 && growth == Growth::Deferred {
                assert!(last.iter().all(|texel| texel[..3] == [0.0; 3]), "the first frame had room");
                // The same frames again, with the room that is there now.
                renderer.reset();
            }
        }
        let pool = renderer.pool.get_mut().unwrap();
        (last, pool.waits(), pool.arrived().held)
    };
    let (expected, waits, _) = mean_after(Growth::Blocking, 4);
    let (found, none, held) = mean_after(Growth::Deferred, 4);
    assert_eq!((none, held), (0, 1));
    assert!(waits >= 8 && found == expected, "not the mean of the same frames");
    // It can fail: a frame more is another mean.
    assert!(found != mean_after(Growth::Deferred, 5).0);
}

/// Ten lights become a hundred thousand and ten again, while the camera goes through Sponza.
#[test]
#[ignore = "takes minutes on a software adapter"]
fn gpu_a_path_through_sponza_never_waits() {
    let test = "gpu_a_path_through_sponza_never_waits";
    let Some(gpu) = testing::gpu(test) else { return };
    let Some(file) = testing::shared(test, "assets/sponza/Sponza.glb") else { return };
    let scene = lanternfish_scene::load(&file).unwrap();
    let camera = scene.default_camera(64.0 / 36.0);
    const FRAMES: usize = 300;
    let step = |i: usize| {
        let way = i as f32 / FRAMES as f32;
        let turn = Affine3A::from_rotation_y(0.5 * (std::f32::consts::TAU * way).sin());
        let towards = Affine3A::from_translation(way * 3.0 * Vec3::NEG_Z);
        let camera = Camera { world_from_camera: camera.world_from_camera * turn * towards, ..camera.clone() };
        // Ten times as many every twenty-five frames, and then a tenth.
        let decade = [1, 1, 2, 3, 4, 5, 5, 4, 3, 2, 1, 1][i / 25];
        (camera, 10u32.pow(decade))
    };
    let path = Path { scene: scene.clone(), range: 1.0, size: [64, 36], step: &step, frames: FRAMES };
    let outcome = walk(gpu, &settings(Culling::default()), &path);
    println!("{outcome:?}");
    check(&outcome);
}
