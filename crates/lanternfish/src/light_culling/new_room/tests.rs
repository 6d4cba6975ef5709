use glam::Vec3;
use lanternfish_gpu::testing;
use lanternfish_scene::Light;

use super::{NewRoom, twin::reaches_view};
use crate::{Renderer, Settings, settings::Culling, testing::Random};

/// As many lights are listed as the twin says, and the picture is that of all lights, to the bit.
#[test]
fn gpu_new_room_is_its_twin_and_loses_no_light() {
    let Some(gpu) = testing::gpu("gpu_new_room_is_its_twin_and_loses_no_light") else { return };
    let mut scene = lanternfish_scene::generate::demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    let eye = Vec3::from(camera.world_from_camera.translation);
    let mut random = Random::new(11);
    let mut near =
        |_| Light { range: Some(random.between(0.2, 3.0)), ..Light::point(eye + 4.0 * random.point(), Vec3::ONE) };
    scene.lights = (0..60).map(&mut near).collect();
    let expected =
        scene.lights.iter().filter(|light| reaches_view(&camera, light.position, light.range.unwrap())).count();
    assert!((10..55).contains(&expected), "{expected} of {} lights reach the view", scene.lights.len());
    let [all, found] = [Culling::All, Culling::NewRoom(NewRoom {})].map(|culling| {
        let settings = Settings { culling, ..Settings::direct_light() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        renderer.render(&uploaded, &camera, 64, 48).unwrap()
    });
    let listed = found.report.counters.iter().find(|(name, _)| name == "light_culling/listed_lights");
    assert_eq!(listed.map(|(_, count)| *count), Some(expected as u64));
    assert!(found.radiance == all.radiance, "pictures differ");
}
