mod slices;

use glam::{Vec3, Vec3Swizzles};
use lanternfish::{
    settings::{Culling, DebugView, Exposure, Shadows, Tracer},
    techniques::{Clustered, Grouping, Tiled},
};
use lanternfish_gpu::testing;
use lanternfish_scene::generate::demo;

use super::*;

/// Draws until `frames` frames are averaged. Blocks until the device is idle after each.
fn draw(viewport: &mut Viewport, camera: &Camera, frames: u32) {
    for _ in 0..50 {
        let is_of_camera = viewport.averaged.1.as_ref() == Some(camera);
        if is_of_camera && viewport.averaged() >= frames && !viewport.is_busy() {
            return;
        }
        if !viewport.is_busy() {
            viewport.draw(camera).unwrap();
        }
        viewport.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        viewport.poll();
    }
    panic!("{} frames of {frames}", viewport.averaged());
}

/// Creates a separate viewport of the Cornell box on the shared device.
fn cornell(gpu: &Gpu, settings: &Settings) -> Viewport {
    let gpu = Gpu { device: gpu.device.clone(), queue: gpu.queue.clone(), description: gpu.description.clone() };
    let mut viewport = Viewport::new(gpu, demo("cornell").unwrap(), settings).unwrap();
    viewport.resize(UVec2::new(48, 32));
    viewport
}

/// A scene of many copies is traced in two levels, whatever was shown before.
#[gpu_test]
fn gpu_each_scene_that_is_opened_chooses_its_tracer(gpu: &Gpu) {
    let mut viewport = cornell(gpu, &Settings::direct_light());
    let mut street = demo("street").unwrap();
    street.instances = vec![street.instances; 3].concat();
    let (two_levels, cornell) = (Shadows::Traced(Tracer::TWO_LEVEL), demo("cornell").unwrap());
    for (scene, is_of_copies) in [(street, true), (cornell, false)] {
        viewport.open(scene).unwrap();
        assert_eq!(viewport.settings().shadows.technique == two_levels, is_of_copies);
        viewport.set(&Settings::direct_light()).unwrap();
        assert_eq!(viewport.settings().shadows.technique == two_levels, is_of_copies);
    }
}

/// Changed lights give the same image as a scene with these lights. Rejected lights change nothing.
#[gpu_test]
fn gpu_changed_lights_equal_those_of_a_new_scene(gpu: &Gpu) {
    let settings = Settings::direct_light().with_shadows(Shadows::BVH);
    let mut viewport = cornell(gpu, &settings);
    let camera = viewport.scene.default_camera(1.5);
    draw(&mut viewport, &camera, 2);
    let (first, lights) = (viewport.pixels().unwrap(), viewport.scene.lights.clone());
    let held = Arc::clone(&viewport.scene);
    let lamp = Light::point(viewport.scene.bounds().center(), Vec3::new(0.5, 0.0, 0.0));
    let mut changed = [lights.clone(), vec![lamp]].concat();
    changed[0].intensity *= 0.1;
    viewport.set_lights(changed.clone()).unwrap();
    assert!(viewport.scene.lights == changed && held.lights == lights, "other holders of the scene see it unchanged");
    draw(&mut viewport, &camera, 2);
    let mut again = cornell(gpu, &settings);
    let mut scene = Scene::clone(&again.scene);
    scene.lights = changed;
    again.open(scene).unwrap();
    draw(&mut again, &camera, 2);
    let before = (viewport.scene.lights.clone(), viewport.pixels().unwrap());
    assert!(before.1 == again.pixels().unwrap() && before.1 != first);
    let mut wrong = before.0.clone();
    (wrong[0].intensity, wrong[1].position.x) = (Vec3::ONE, f32::NAN);
    assert!(viewport.set_lights(wrong).is_err() && viewport.scene.lights == before.0);
    let mut moved = camera.clone();
    moved.world_from_camera.translation.x += 0.3;
    draw(&mut viewport, &moved, 1);
    draw(&mut viewport, &camera, 2);
    assert!(viewport.pixels().unwrap() == before.1, "a rejected light is on the device");
}

#[gpu_test]
fn gpu_an_image_follows_sizes_settings_and_scenes(gpu: &Gpu) {
    let gpu = Gpu { device: gpu.device.clone(), queue: gpu.queue.clone(), description: gpu.description.clone() };
    let (scene, hall) = (demo("cornell").unwrap(), demo("hall").unwrap());
    let camera = scene.default_camera(1.5);
    let settings = Settings::direct_light().with_shadows(Shadows::BVH);
    let mut viewport = Viewport::new(gpu, scene, &settings).unwrap();
    assert!(viewport.resize(UVec2::new(48, 32)) && !viewport.resize(UVec2::new(48, 32)));
    assert!(viewport.has_more(&camera));
    draw(&mut viewport, &camera, 3);
    let first = viewport.pixels().unwrap();
    assert!(first.iter().filter(|pixel| pixel[..3] != [0; 3]).count() > 300 && viewport.report.is_some());
    // A camera change restarts accumulation.
    let mut moved = camera.clone();
    moved.world_from_camera.translation.x += 0.3;
    assert!(viewport.has_more(&moved));
    draw(&mut viewport, &moved, 1);
    assert!(viewport.averaged() == 1 && viewport.pixels().unwrap() != first);
    viewport.set(&settings.clone().with_debug_view(Some(DebugView::Normal))).unwrap();
    draw(&mut viewport, &camera, 1);
    assert!(viewport.change.is_some() && !viewport.has_more(&camera), "debug views are not averaged");
    viewport.set(&settings).unwrap();
    draw(&mut viewport, &camera, 3);
    assert!(viewport.pixels().unwrap() == first, "back again");
    // A viewport of size 0, and another scene.
    assert!(viewport.resize(UVec2::ZERO) && viewport.size() == UVec2::ONE);
    draw(&mut viewport, &camera, 1);
    viewport.resize(UVec2::new(48, 32));
    let elsewhere = hall.default_camera(1.5);
    viewport.open(hall).unwrap();
    draw(&mut viewport, &elsewhere, 2);
    assert!(viewport.pixels().unwrap() != first);
}

/// The surface at each pixel lies in a visible cluster, and the bird's-eye view shows all visible clusters.
#[gpu_test]
fn gpu_visible_clusters_contain_the_visible_surfaces(gpu: &Gpu) {
    let mut viewport = cornell(gpu, &Settings::direct_light().with_shadows(Shadows::BVH));
    let camera = viewport.scene.default_camera(1.5);
    assert!(!viewport.shows(&camera));
    draw(&mut viewport, &camera, 1);
    assert!(viewport.shows(&camera));
    let grids = viewport.clusters().unwrap();
    let tracer =
        lanternfish_reference::Tracer::new(&viewport.scene, lanternfish_reference::Settings::default()).unwrap();
    let (mut visible, mut all) = (0, 0);
    for (x, y) in (0..48).step_by(5).flat_map(|x| (0..32).step_by(5).map(move |y| (x, y))) {
        let Some(place) = tracer.probe(&camera, [f64::from(x) + 0.5, f64::from(y) + 0.5], [48, 32]) else { continue };
        let cluster = crate::clusters::at(&grids, 0, place.p).expect("the grid contains all visible surfaces");
        all += 1;
        visible += u32::from(cluster.lights.is_some());
        assert!(cluster.lights.unwrap_or(0) <= viewport.scene.lights.len() as u32);
    }
    // At a cluster boundary, rounding may select the neighbour.
    assert!(all > 30 && visible + 2 >= all, "{visible} of {all}");
    let view = crate::overlay::BirdsEye::new(&lanternfish_scene::Controls::new(camera.clone(), 2.0), 1.5, &grids);
    let all: usize = grids.iter().map(|grid| grid.visible.len()).sum();
    assert!(view.all == all && view.clusters.len() == all && all > 1 && view.outlines.len() == 1, "{all}");
}

/// Stereo images of one frame equal those of each eye alone, with shared and with separate light lists.
#[gpu_test]
fn gpu_stereo_images_equal_single_eye_images(gpu: &Gpu) {
    let base = Settings::direct_light().with_shadows(Shadows::BVH).with_exposure(Exposure::Ev(1.0));
    for grouping in [Grouping::Individual, Grouping::Enclosed] {
        let culling = Culling::from(Clustered { grouping, ..Clustered::default() });
        let mut viewport = cornell(gpu, &base.clone().with_culling(culling));
        let camera = viewport.scene.default_camera(1.5);
        draw(&mut viewport, &camera, 2);
        let one = viewport.pixels().unwrap();
        viewport.show_to(Some(Eyes::Parallel(0.2)));
        assert!(viewport.has_more(&camera) && viewport.right_image().is_some());
        draw(&mut viewport, &camera, 2);
        let (both, cameras) = (viewport.pixels().unwrap(), viewport.cameras(&camera));
        assert_eq!(viewport.clusters().unwrap().len(), if grouping == Grouping::Enclosed { 1 } else { 2 });
        let halves =
            [0, 48].map(|from| both.chunks(96).flat_map(|row| row[from..from + 48].to_vec()).collect::<Vec<_>>());
        assert!(both.len() == 2 * one.len() && halves[0] != halves[1] && halves[0] != one);
        for (half, of_eye) in halves.iter().zip(&cameras) {
            let mut alone = cornell(gpu, &base);
            draw(&mut alone, of_eye, 2);
            assert!(alone.pixels().unwrap() == *half, "{grouping:?}, {}", of_eye.name);
        }
        viewport.show_to(None);
        draw(&mut viewport, &camera, 2);
        assert!(viewport.pixels().unwrap() == one, "mono again");
    }
}

/// The tile of each pixel lists all lights that reach its surface. The lists of all tiles add up to the counter.
#[gpu_test]
fn gpu_tiles_list_the_lights_of_their_pixels(gpu: &Gpu) {
    let culling = Culling::from(Tiled::default());
    let mut viewport = cornell(gpu, &Settings::direct_light().with_culling(culling).with_shadows(Shadows::BVH));
    let (camera, middle) = (viewport.scene.default_camera(1.5), viewport.scene.bounds().center());
    assert!(viewport.tiles().unwrap().is_empty(), "before the first frame");
    let near = |x: f32| Light { range: Some(0.4), ..Light::point(middle + Vec3::new(x, -0.6, 0.0), Vec3::ONE) };
    viewport.set_lights([viewport.scene.lights.clone(), vec![near(-0.5), near(0.0), near(0.5)]].concat()).unwrap();
    draw(&mut viewport, &camera, 1);
    let tiles = viewport.tiles().unwrap().remove(0);
    assert_eq!((tiles.dimensions, tiles.lights.len()), (UVec2::new(3, 2), 6));
    assert!(
        tiles.lights.iter().all(|listed| *listed <= 4) && tiles.lights.iter().any(|listed| *listed != tiles.lights[0])
    );
    let tracer =
        lanternfish_reference::Tracer::new(&viewport.scene, lanternfish_reference::Settings::default()).unwrap();
    let mut reached = 0;
    for (x, y) in (0..48).step_by(3).flat_map(|x| (0..32).step_by(3).map(move |y| (x, y))) {
        let (tile, listed) = tiles.at(UVec2::new(x, y)).expect("a tile");
        assert_eq!(tile, UVec2::new(x / 16, y / 16));
        let Some(place) = tracer.probe(&camera, [f64::from(x) + 0.5, f64::from(y) + 0.5], [48, 32]) else { continue };
        let (_, reaching) = tracer.lights_at(&place, 64);
        assert!(listed as usize >= reaching, "{listed} of {reaching} lights at {x}, {y}");
        reached += reaching;
    }
    assert!(reached > 0);
    let all: u32 = tiles.lights.iter().sum();
    let counters = &viewport.report.as_ref().unwrap().counters;
    assert!(counters.iter().any(|(_, count)| *count == u64::from(all)), "{all} of {counters:?}");
}
