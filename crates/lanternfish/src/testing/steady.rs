//! A check that a repeated frame allocates nothing.

use glam::Affine3A;
use glam::Vec3;
use lanternfish_gpu::{Gpu, Growth, Made, made};
use lanternfish_scene::{Camera, Scene};

use crate::{GpuScene, Renderer, Settings, context::FrameContext};

/// A camera that moves along a small circle with a period of eight frames.
pub fn camera(scene: &Scene, frame: u32) -> Camera {
    let camera = &scene.cameras[0];
    let (sin, cos) = (std::f32::consts::TAU * (frame % 8) as f32 / 8.0).sin_cos();
    let step = Affine3A::from_translation(0.01 * Vec3::new(sin, cos, 0.0));
    Camera { world_from_camera: camera.world_from_camera * step, ..camera.clone() }
}

/// The resources that a frame creates.
fn made_by_frame(renderer: &mut Renderer, scene: &GpuScene, camera: &Camera, is_averaged: bool) -> Made {
    let views = renderer.views(scene, &[(camera, [32, 24])]).unwrap();
    let before = made();
    renderer.frame(&FrameContext { scene, views: &views, is_averaged, requests: &[] }).unwrap();
    let made = made() - before;
    // The counts of the frame arrive before the next one begins.
    renderer.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    made
}

/// Frames of these settings.
#[derive(Clone, Debug)]
pub struct Frames {
    /// The name in messages.
    pub name: &'static str,
    /// True if they are of one mean.
    pub is_averaged: bool,
    /// True if they wait for the room of their lists.
    pub growth: Growth,
    /// The settings.
    pub settings: Settings,
}

/// Panics if a frame creates a buffer, texture, bind group or pipeline although it repeats the frames before.
pub fn check_steady(gpu: &Gpu, scene: &Scene, frames: Frames) {
    let Frames { name, is_averaged, growth, settings } = frames;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
    renderer.set_growth(growth).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    let mut frame = |i| made_by_frame(&mut renderer, &uploaded, &camera(scene, i), is_averaged);
    let first = frame(0);
    println!("{name}: the first frame makes {first:?}");
    assert!(first.buffers > 2 && first.textures > 2 && first.bind_groups > 10 && first.pipelines > 0, "{first:?}");
    for i in 1..10 {
        frame(i);
    }
    for i in 10..18 {
        assert_eq!(frame(i), Made::default(), "{name}, frame {i}");
    }
    // Check that the test can fail: a frame of another size creates resources (not all need buffers of that size).
    let views = renderer.views(&uploaded, &[(&scene.cameras[0], [80, 60])]).unwrap();
    let before = made();
    renderer.frame(&FrameContext { scene: &uploaded, views: &views, is_averaged, requests: &[] }).unwrap();
    let other = made() - before;
    assert!(other.textures > 0 && other.bind_groups > 0, "{name}: {other:?}");
}
