//! The motion debug view: each view has its own previous frame, and renderers without motion store nothing.

use glam::{Affine3A, Vec3};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{Camera, Material, Projection, Scene};

use crate::{
    GpuScene, Renderer, Settings, Target, ViewRequest,
    debug_views::Scale,
    settings::{DebugView, Exposure, Shadows},
    testing::{quad, scene_of},
};

const SIZE: [u32; 2] = [16, 12];

fn settings(debug_view: Option<DebugView>) -> Settings {
    Settings::direct_light().with_debug_view(debug_view).with_shadows(Shadows::None).with_exposure(Exposure::Ev(0.0))
}

fn wall() -> Scene {
    scene_of(vec![quad(0, Vec3::ZERO, 40.0 * Vec3::X, 40.0 * Vec3::Y)], vec![Material::default()])
}

/// A pixel to the right is 1/6 m.
fn pixels(right: f32, down: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::new(right, -down, 0.0) / 6.0)
}

/// A camera moved by this number of pixels.
fn camera(right: f32, down: f32) -> Camera {
    let projection = Projection::Orthographic { half_height: 1.0, near: 0.01, far: 10.0 };
    let camera = Camera::look_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, projection);
    Camera { world_from_camera: pixels(right, down) * camera.world_from_camera, ..camera }
}

/// The uniform colour of an image.
fn color(display: &[[u8; 4]]) -> [u8; 3] {
    let [first @ .., _] = display[0];
    assert!(display.iter().all(|texel| *texel == display[0]), "{display:?}");
    first
}

/// True if a colour is one within a byte.
fn is(found: [u8; 3], expected: [f32; 3]) -> bool {
    found.iter().zip(expected).all(|(found, expected)| (f32::from(*found) - expected).abs() <= 1.0)
}

fn render(renderer: &mut Renderer, scene: &GpuScene, camera: &Camera) -> [u8; 3] {
    color(&renderer.render(scene, camera, SIZE).unwrap().display)
}

#[gpu_test]
fn gpu_motion_colours_are_relative_to_the_previous_frame(gpu: &Gpu) {
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings(Some(DebugView::Motion))).unwrap();
    let mut uploaded = renderer.upload(&wall()).unwrap();
    let still = camera(0.0, 0.0);
    assert_eq!(render(&mut renderer, &uploaded, &still), [0; 3], "the first frame");
    let mut position = [0.0, 0.0];
    for (right, down, hue) in [
        (8.0, 0.0, [1.0, 0.0, 0.0]),
        (0.0, 4.0, [0.5, 1.0, 0.0]),
        (-16.0, 0.0, [0.0, 1.0, 1.0]),
        (0.0, -2.0, [0.5, 0.0, 1.0]),
        (100.0, 0.0, [1.0, 0.0, 0.0]),
    ] {
        position = [position[0] + right, position[1] + down];
        renderer.move_instances(&mut uploaded, &[(0, pixels(position[0], position[1]))]).unwrap();
        let actual = render(&mut renderer, &uploaded, &still);
        let length = right.abs().max(down.abs());
        let expected = hue.map(|fraction| 255.0 * fraction * (length / 16.0).min(1.0));
        assert!(is(actual, expected), "{right}, {down}: {actual:?}, not {expected:?}");
        let scale = Scale::of(DebugView::Motion).unwrap();
        let of_scale = scale.color(scale.place(length)).map(f32::from);
        assert!(down != 0.0 || right < 0.0 || is(actual, of_scale), "{actual:?}, not {of_scale:?}");
        assert_eq!(render(&mut renderer, &uploaded, &still), [0; 3], "nothing has moved since");
    }
    // The camera moves right, the wall left; a change of settings in between restarts the history.
    assert!(is(render(&mut renderer, &uploaded, &camera(8.0, 0.0)), [0.0, 127.5, 127.5]));
    renderer.set(settings(None)).unwrap();
    renderer.set(settings(Some(DebugView::Motion))).unwrap();
    assert_eq!(render(&mut renderer, &uploaded, &still), [0; 3]);
}

fn shown(gpu: &Gpu, renderer: &mut Renderer, scene: &GpuScene, views: &[(u64, Camera)]) -> Vec<[u8; 3]> {
    let requests = views.iter().map(|(key, camera)| ViewRequest::of_camera(*key, camera, SIZE, Target::Own));
    let mut commands = gpu.device.create_command_encoder(&Default::default());
    let frame = renderer.record(&mut commands, scene, &requests.collect::<Vec<_>>()).unwrap();
    gpu.queue.submit([commands.finish()]);
    let frame = renderer.submitted(frame);
    renderer.read(frame).unwrap().iter().map(|rendering| color(&rendering.display)).collect()
}

#[gpu_test]
fn gpu_views_and_renderers_have_their_own_previous_frames(gpu: &Gpu) {
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings(Some(DebugView::Motion))).unwrap();
    let mut uploaded = renderer.upload(&wall()).unwrap();
    let at = |right| camera(right, 0.0);
    let (black, cyan) = ([0; 3], [0.0, 127.5, 127.5]);
    assert_eq!(shown(gpu, &mut renderer, &uploaded, &[(7, at(0.0)), (3, at(50.0))]), [black; 2]);
    // One camera moves; the views come in another order, and a third is new.
    let actual = shown(gpu, &mut renderer, &uploaded, &[(3, at(58.0)), (7, at(0.0)), (4, at(90.0))]);
    assert!(is(actual[0], cyan) && actual[1..] == [black; 2], "{actual:?}");
    // A view that skips a frame is compared with its own last frame.
    assert_eq!(shown(gpu, &mut renderer, &uploaded, &[(7, at(0.0))]), [black]);
    assert!(is(shown(gpu, &mut renderer, &uploaded, &[(3, at(66.0))])[0], cyan));
    // Another renderer of the same scene has no previous views.
    let mut other = Renderer::with_engine(renderer.engine(), renderer.settings().clone()).unwrap();
    renderer.move_instances(&mut uploaded, &[(0, pixels(-8.0, 0.0))]).unwrap();
    assert_eq!(shown(gpu, &mut other, &uploaded, &[(7, at(0.0))]), [black]);
    assert!(is(shown(gpu, &mut renderer, &uploaded, &[(7, at(0.0))])[0], cyan));
    // After two changes of a scene, the second after a frame of the other scene, the previous transforms are unknown.
    renderer.move_instances(&mut uploaded, &[(0, pixels(-16.0, 0.0))]).unwrap();
    assert!(is(shown(gpu, &mut other, &uploaded, &[(7, at(0.0))])[0], cyan));
    renderer.move_instances(&mut uploaded, &[(0, pixels(-24.0, 0.0))]).unwrap();
    assert_eq!(shown(gpu, &mut renderer, &uploaded, &[(7, at(0.0))]), [black]);
    // Preparation frames have no successor.
    let camera = at(30.0);
    renderer.ready(&uploaded, &[ViewRequest::of_camera(7, &camera, SIZE, Target::Own)]).unwrap();
    assert_eq!(shown(gpu, &mut renderer, &uploaded, &[(7, at(0.0))]), [black]);
}

#[gpu_test]
fn gpu_no_motion_buffers_without_a_request(gpu: &Gpu) {
    for (debug_view, kept) in [(None, 0), (Some(DebugView::Normal), 0), (Some(DebugView::Motion), 2)] {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings(debug_view)).unwrap();
        let mut scene = wall();
        let mut uploaded = renderer.upload(&scene).unwrap();
        let mut frame = |i: usize| {
            scene.meshes[0].primitives[0].positions[0].x += 0.1;
            renderer.update(&mut uploaded, &scene).unwrap();
            renderer.move_instances(&mut uploaded, &[(0, pixels(i as f32, 0.0))]).unwrap();
            renderer.render(&uploaded, &camera(0.0, 0.0), SIZE).unwrap();
            uploaded.kept_buffers()
        };
        assert!(frame(0).is_empty(), "no earlier frame requests motion");
        let buffers = frame(1);
        assert_eq!(buffers.len(), kept, "{debug_view:?}");
        assert!((2..6).all(|i| frame(i) == buffers), "{debug_view:?}: buffers are made again");
    }
}
