use glam::{Vec3, Vec4};
use lanternfish_gpu::testing;
use lanternfish_scene::{Camera, Material, Projection};

use super::{NewRoom, twin::openness};
use crate::{
    Renderer, Settings,
    settings::{Materials, Occlusion},
    testing::{quad, scene_of},
};

/// A white wall under an even sky is as bright as the twin says, whichever way it faces.
#[test]
fn gpu_new_room_is_its_twin() {
    let Some(gpu) = testing::gpu("gpu_new_room_is_its_twin") else { return };
    let room = NewRoom { ground: 0.25 };
    let settings =
        Settings { occlusion: Occlusion::NewRoom(room), materials: Materials::Lambert, ..Settings::direct_light() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
    let mut found = Vec::new();
    for normal in [Vec3::Z, Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.6, -0.8, 0.0)] {
        let right = normal.any_orthonormal_vector();
        let up = normal.cross(right);
        let mut scene = scene_of(vec![quad(0, Vec3::ZERO, 9.0 * right, 9.0 * up)], vec![Material::default()]);
        scene.sky = Vec3::splat(2.0);
        let camera = Camera::look_at(normal, Vec3::ZERO, Projection::Perspective { fov_y: 0.8, near: 0.02 });
        let uploaded = renderer.upload(&scene).unwrap();
        let picture = renderer.render(&uploaded, &camera, 24, 16).unwrap();
        let expected = 2.0 * openness(room.ground, normal);
        for pixel in &picture.radiance {
            // Half floats, of a normal in 16 bits.
            let off = (Vec4::from(*pixel).truncate() - expected).abs().max_element();
            assert!(off < 3e-3 * expected, "{normal}: {pixel:?}, expected {expected}");
        }
        found.push(expected);
    }
    assert!(found[1] > 1.5 * found[2], "the wall's way makes no difference: {found:?}");
}
