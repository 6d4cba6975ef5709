//! Viewports of a window: frames in slices, the last complete image, and another device that paints.

use lanternfish_gpu::read_texture;

use super::*;

/// The texels that the window would paint.
fn painted(viewport: &Viewport) -> Vec<[u8; 4]> {
    let gpu = viewport.interface();
    read_texture(&gpu.device, &gpu.queue, viewport.rendering().texture()).unwrap()
}

/// Draws a frame in slices. The painted image stays until the frame has ended. Returns the number of command buffers.
fn draw_slices(viewport: &mut Viewport, camera: &Camera) -> usize {
    let before = painted(viewport);
    viewport.last_ms = None;
    viewport.draw(camera).unwrap();
    let count = viewport.left();
    while viewport.left() > 0 {
        assert!(painted(viewport) == before, "{} of {count} slices are left", viewport.left());
        viewport.submit(2);
        viewport.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        assert!(viewport.is_busy() && viewport.is_idle());
        if viewport.left() > 0 {
            assert_eq!(viewport.poll(), None, "a frame ends with its last slice");
        }
    }
    assert!(viewport.poll().is_some() && !viewport.is_busy());
    count
}

/// The last complete image stays while a frame is in slices, also when the size changes. Each image equals that of whole frames.
#[gpu_test]
fn gpu_the_last_complete_image_stays_until_the_next_is_complete(gpu: &Gpu) {
    let settings = Settings::direct_light().with_shadows(Shadows::BVH);
    let apart = || Some(Arc::new(Gpu::open_listed(&gpu.description).unwrap()));
    for interface in [None, apart()] {
        let mut whole = cornell(gpu, &settings);
        let paints_apart = interface.is_some();
        let mut viewport = cornell(gpu, &settings).of_window(interface);
        // A window has no slices if paints do not wait for them.
        assert_eq!(std::mem::replace(&mut viewport.slices_frames, true), !paints_apart);
        assert_eq!(viewport.paints_apart(), paints_apart);
        let camera = viewport.scene.default_camera(1.5);
        for size in [UVec2::new(48, 32), UVec2::new(50, 33)] {
            assert!(whole.resize(size) | viewport.resize(size) || size.x == 48);
            // The first frames may overflow their lists.
            draw(&mut whole, &camera, 2);
            while viewport.averaged() < 2 {
                assert!(draw_slices(&mut viewport, &camera) > 4);
            }
            assert_eq!(viewport.rendering().texture().width(), size.x);
            assert!(painted(&viewport) == whole.pixels().unwrap(), "{size}, on another device: {paints_apart}");
        }
    }
}

/// A change of the scene in the middle of a frame: the next frames equal those of a new viewport.
#[gpu_test]
fn gpu_a_scene_may_change_between_slices(gpu: &Gpu) {
    let settings = Settings::direct_light().with_shadows(Shadows::BVH);
    let mut viewport = cornell(gpu, &settings).of_window(None);
    let camera = viewport.scene.default_camera(1.5);
    draw_slices(&mut viewport, &camera);
    draw_slices(&mut viewport, &camera);
    viewport.last_ms = None;
    viewport.draw(&camera).unwrap();
    viewport.submit(3);
    let mut lights = viewport.scene.lights.clone();
    lights[0].intensity = 0.3 * lights[0].intensity.zxy();
    viewport.set_lights(lights.clone()).unwrap();
    assert!(viewport.left() == 0 && viewport.averaged() == 0 && viewport.is_busy(), "the next frame waits");
    viewport.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    assert!(viewport.poll().is_some() && viewport.averaged() == 0);
    while viewport.averaged() < 2 {
        draw_slices(&mut viewport, &camera);
    }
    let mut other = cornell(gpu, &settings);
    other.set_lights(lights).unwrap();
    draw(&mut other, &camera, 2);
    assert!(painted(&viewport) == other.pixels().unwrap());
}
