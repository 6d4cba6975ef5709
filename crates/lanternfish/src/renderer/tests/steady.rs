//! A repeated frame allocates nothing, and memory does not grow over frames of any kind.

use lanternfish_gpu::{Gpu, Growth, testing};
use lanternfish_scene::generate::{demo, light_rain};

use crate::{
    Renderer, Settings,
    context::FrameContext,
    settings::{Antialiasing, Exposure, History, Samples, Shadows},
    techniques::{Sampled, SampledLights, Tiled},
    testing::steady::{Frames, camera, check_steady},
};

/// The same tracer on every adapter.
fn bvh(settings: Settings) -> Settings {
    settings.with_shadows(Shadows::BVH)
}

/// Sampled direct light with a history.
fn sampled() -> Settings {
    let direct = SampledLights::default();
    bvh(Settings::direct_light()).with_direct(direct).with_history(History::On)
}

/// Few rays, and few samples per entry of the radiance cache.
fn rays() -> Settings {
    let few = Sampled { diffuse_rays: 2, glossy_rays: 1, cache_samples: 4, ..Sampled::default() };
    Settings::direct_light().with_indirect(few)
}

type Repeated = (&'static str, bool, Growth, Settings);

fn check_repeated(gpu: &Gpu, frames: Vec<Repeated>) {
    // One scene with many draws is enough.
    let [large, small] = ["atrium", "cornell"].map(|name| demo(name).unwrap());
    for (name, is_averaged, growth, settings) in frames {
        let scene = if name == "direct light" { &large } else { &small };
        check_steady(gpu, scene, Frames { name, is_averaged, growth, settings });
    }
}

#[gpu_test]
fn gpu_a_repeated_frame_allocates_nothing(gpu: &Gpu) {
    let direct = bvh(Settings::direct_light());
    let frames = vec![
        ("direct light", false, Growth::Blocking, direct.clone()),
        ("a mean of frames that do not wait", true, Growth::Deferred, direct),
        ("indirect light", false, Growth::Blocking, bvh(rays())),
    ];
    check_repeated(gpu, frames);
}

#[gpu_test(full)]
fn gpu_a_repeated_frame_of_other_settings_allocates_nothing(gpu: &Gpu) {
    let tiled = bvh(Settings::direct_light()).with_culling(Tiled::default()).with_samples(Samples::Four);
    let temporal = sampled().with_antialiasing(Antialiasing::Temporal);
    let frames = vec![
        ("tiled, four samples", false, Growth::Blocking, tiled),
        ("sampled direct light", false, Growth::Blocking, sampled()),
        ("sampled direct light that does not wait", true, Growth::Deferred, sampled()),
        ("temporal antialiasing that does not wait", false, Growth::Deferred, temporal),
        ("indirect light, a mean of frames", true, Growth::Blocking, bvh(rays())),
    ];
    check_repeated(gpu, frames);
}

/// Size of the pool, bytes, after the first and the second number of frames. Sizes, lights, exposure and the number of views change each
/// frame, with a period of twenty frames.
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
        let views: Vec<_> =
            cameras.iter().take(1 + (i / 10 % 2) as usize).map(|camera| (camera, [size, size])).collect();
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

#[gpu_test(full)]
fn gpu_memory_does_not_grow_over_frames_of_all_kinds(gpu: &Gpu) {
    let [early, late] = bytes_after(gpu, bvh(Settings::direct_light()), 40, 160);
    assert!(early > 0 && early == late, "{early} {late}");
    let [early, late] = bytes_after(gpu, sampled(), 40, 160);
    assert!(early > 0 && early == late, "sampled: {early} {late}");
    // Check that the test can fail: another number of frames gives another size.
    let [small, large] = bytes_after(gpu, bvh(Settings::direct_light()), 2, 40);
    assert!(small != large, "{small} {large}");
}

#[gpu_test(full)]
fn gpu_two_hundred_frames_use_as_much_memory_as_a_hundred(gpu: &Gpu) {
    for settings in [bvh(Settings::direct_light()), bvh(Settings::default())] {
        let [early, late] = bytes_after(gpu, settings, 100, 200);
        assert!(early > 0 && early == late, "{early} {late}");
    }
}
