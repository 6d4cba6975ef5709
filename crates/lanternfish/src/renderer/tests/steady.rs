//! A frame like the one before it makes nothing, and frames of all kinds take no more and more memory.

use glam::{Affine3A, Vec3};
use lanternfish_gpu::{Gpu, Growth, Made, made, testing};
use lanternfish_scene::{
    Camera, Scene,
    generate::{demo, light_rain},
};

use crate::{
    GpuScene, RenderError, Renderer, Settings,
    context::FrameContext,
    indirect::{Indirect, virtual_lights::VirtualLights},
    settings::{Culling, Exposure, Samples, Shadows},
    techniques::{ACROSS_TEXELS, DeepImageSettings, RasterGrid, Sampled, Tiled},
};

/// The same on every adapter.
fn bvh(settings: Settings) -> Settings {
    Settings { shadows: Shadows::BVH, ..settings }
}

/// A camera on its way along a small circle, which takes eight frames.
fn camera(scene: &Scene, frame: u32) -> Camera {
    let camera = &scene.cameras[0];
    let (sin, cos) = (std::f32::consts::TAU * frame as f32 / 8.0).sin_cos();
    let step = Affine3A::from_translation(0.01 * Vec3::new(sin, cos, 0.0));
    Camera { world_from_camera: camera.world_from_camera * step, ..camera.clone() }
}

/// What a frame makes.
fn made_by_frame(renderer: &mut Renderer, scene: &GpuScene, camera: &Camera, is_averaged: bool) -> Made {
    let views = renderer.views(scene, &[(camera, 32, 24)]).unwrap();
    let before = made();
    renderer.frame(&FrameContext { scene, views: &views, is_averaged, requests: &[] }).unwrap();
    let made = made() - before;
    // What the frame has counted has arrived when the next one begins.
    renderer.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    made
}

/// Few rays, and few samples of each cell of the radiance cache.
fn rays() -> Settings {
    let few = Sampled { diffuse_rays: 2, glossy_rays: 1, cache_samples: 4, ..Sampled::default() };
    Settings { indirect: Indirect::from(few), ..Settings::direct_light() }
}

fn virtual_lights() -> Settings {
    let few = VirtualLights { count: 500, ..VirtualLights::default() };
    Settings { indirect: Indirect::from(few), ..Settings::direct_light() }
}

#[test]
fn gpu_a_steady_frame_makes_nothing() {
    let Some(gpu) = testing::gpu("gpu_a_steady_frame_makes_nothing") else { return };
    // Cells of the radiance cache are many in the atrium, and all get samples in frames that wait.
    let [large, small] = ["atrium", "cornell"].map(|name| demo(name).unwrap());
    let tiled = Culling::from(Tiled::default());
    for (name, is_averaged, growth, settings) in [
        ("direct light", false, Growth::Wait, bvh(Settings::direct_light())),
        (
            "tiled, four samples",
            false,
            Growth::Wait,
            Settings { culling: tiled, samples: Samples::Four, ..bvh(Settings::direct_light()) },
        ),
        (
            "a raster grid that does not wait",
            false,
            Growth::Later,
            Settings { culling: Culling::from(RasterGrid::default()), ..bvh(Settings::direct_light()) },
        ),
        ("indirect light", false, Growth::Wait, bvh(rays())),
        ("indirect light, a mean of frames", true, Growth::Wait, bvh(rays())),
        ("virtual lights", false, Growth::Wait, bvh(virtual_lights())),
        ("virtual lights that do not wait", false, Growth::Later, bvh(virtual_lights())),
        ("a mean of frames that do not wait", true, Growth::Later, bvh(Settings::direct_light())),
    ] {
        let scene = if settings.indirect.is::<Sampled>() { &small } else { &large };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
        renderer.set_growth(growth).unwrap();
        let uploaded = renderer.upload(scene).unwrap();
        let mut frame = |i| made_by_frame(&mut renderer, &uploaded, &camera(scene, i), is_averaged);
        let first = frame(0);
        println!("{name}: the first frame makes {first:?}");
        assert!(first.buffers > 10 && first.textures > 2 && first.bind_groups > 10 && first.pipelines > 0, "{first:?}");
        for i in 1..10 {
            frame(i);
        }
        for i in 10..18 {
            assert_eq!(frame(i), Made::default(), "{name}, frame {i}");
        }
        // It can fail: a frame of another size makes what it needs.
        let views = renderer.views(&uploaded, &[(&scene.cameras[0], 80, 60)]).unwrap();
        let before = made();
        renderer.frame(&FrameContext { scene: &uploaded, views: &views, is_averaged, requests: &[] }).unwrap();
        let other = made() - before;
        assert!(other.buffers > 0 && other.textures > 0 && other.bind_groups > 0, "{name}: {other:?}");
    }
}

/// After an error nothing that a frame kept is used: the device may have refused to make it, or never have run what fills it.
#[test]
fn gpu_after_an_error_frames_begin_anew() {
    let Some(gpu) = testing::gpu("gpu_after_an_error_frames_begin_anew") else { return };
    let scene = demo("cornell").unwrap();
    let deep_images = DeepImageSettings { resolution: 16, ..DeepImageSettings::default() };
    let settings =
        Settings { shadows: Shadows::Traced(ACROSS_TEXELS), structure: deep_images.into(), ..Settings::direct_light() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let render = |renderer: &mut Renderer| {
        let picture = renderer.render(&uploaded, &scene.cameras[0], 32, 24).unwrap();
        let builds = renderer.passes.structure.as_ref().map(|structure| structure.builds());
        (picture.radiance, builds, renderer.pool.get_mut().unwrap().bytes())
    };
    let (radiance, builds, bytes) = render(&mut renderer);
    assert_eq!(render(&mut renderer), (radiance.clone(), builds, bytes), "what a frame kept is used again");
    let failed = renderer.checked_work::<()>(|_| Err(RenderError::NoFrames));
    assert!(matches!(failed, Err(RenderError::NoFrames)));
    assert!(renderer.pool.get_mut().unwrap().bytes() < bytes, "nothing was dropped");
    assert_eq!(render(&mut renderer), (radiance, builds.map(|builds| builds + 1), bytes));
}

/// Bytes of the pool after the first and after the second number of frames. Sizes, lights, exposure and the number of views change from
/// frame to frame, and are the same again after twenty.
fn bytes_after(gpu: &Gpu, settings: Settings, first: u32, second: u32) -> [u64; 2] {
    let mut scene = demo("cornell").unwrap();
    let few = scene.lights.clone();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
    let mut uploaded = renderer.upload(&scene).unwrap();
    let mut bytes = Vec::new();
    for i in 1..=second {
        if i % 5 == 0 {
            scene.lights.clone_from(&few);
            let more = [0, 1000, 30, 200][(i / 5 % 4) as usize];
            scene.lights.extend(light_rain(&scene.bounds(), more, Some(0.2), 1, 0.0));
            renderer.update(&mut uploaded, &scene).unwrap();
            renderer.set_exposure(if i % 2 == 0 { Exposure::Auto } else { Exposure::Ev(1.0) }).unwrap();
        }
        let size = [8, 24, 16, 40, 32][(i / 2 % 5) as usize];
        let cameras = [camera(&scene, i % 20), camera(&scene, i % 20 + 3)];
        let views: Vec<_> = cameras.iter().take(1 + (i / 10 % 2) as usize).map(|camera| (camera, size, size)).collect();
        let views = renderer.views(&uploaded, &views).unwrap();
        let is_averaged = i % 20 < 10;
        renderer.frame(&FrameContext { scene: &uploaded, views: &views, is_averaged, requests: &[] }).unwrap();
        if [first, second].contains(&i) {
            bytes.push(renderer.pool.get_mut().unwrap().bytes());
        }
    }
    println!("{bytes:?} bytes after {first} and {second} frames");
    bytes.try_into().unwrap()
}

#[test]
fn gpu_frames_of_all_kinds_take_no_more_and_more_memory() {
    let Some(gpu) = testing::gpu("gpu_frames_of_all_kinds_take_no_more_and_more_memory") else { return };
    let [early, late] = bytes_after(gpu, bvh(Settings::direct_light()), 40, 160);
    assert!(early > 0 && early == late, "{early} {late}");
    // It can fail: in another frame it is another number.
    let [small, large] = bytes_after(gpu, bvh(Settings::direct_light()), 2, 40);
    assert!(small != large, "{small} {large}");
}

#[test]
#[ignore = "takes minutes on a software adapter"]
fn gpu_a_thousand_frames_take_as_much_memory_as_a_hundred() {
    let Some(gpu) = testing::gpu("gpu_a_thousand_frames_take_as_much_memory_as_a_hundred") else { return };
    for settings in [bvh(Settings::direct_light()), bvh(Settings::default())] {
        let [early, late] = bytes_after(gpu, settings, 100, 1000);
        assert!(early > 0 && early == late, "{early} {late}");
    }
}
