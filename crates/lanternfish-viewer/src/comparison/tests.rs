use std::time::{Duration, Instant};

use lanternfish::settings::{DebugView, Shadows, ToneMap};
use lanternfish_gpu::{Gpu, read_texture, testing};
use lanternfish_metrics::{PIXELS_PER_DEGREE, RgbImage, flip_ldr};
use lanternfish_scene::generate::demo;

use super::*;

const SIZE: UVec2 = UVec2::new(48, 32);

/// The state of a window without a window: A at rest, and B.
struct Both {
    first: Viewport,
    comparison: Comparison,
    wipe: Wipe,
    camera: Camera,
    probe_result: Option<ProbeResult>,
}

impl Both {
    fn new(gpu: &Gpu, settings: &Settings) -> Self {
        let gpu = Gpu { device: gpu.device.clone(), queue: gpu.queue.clone(), description: gpu.description.clone() };
        let scene = demo("cornell").unwrap();
        let camera = scene.default_camera(1.5);
        let mut first = Viewport::new(gpu, scene, settings).unwrap();
        first.resize(SIZE);
        let wipe = Wipe::new(settings);
        Self { first, comparison: Comparison::default(), wipe, camera, probe_result: None }
    }

    /// Draws as the window does, until `done`. A averages at most `frames` frames.
    fn until(&mut self, frames: u32, done: impl Fn(&Self) -> bool) {
        let started = Instant::now();
        while !done(self) {
            assert!(started.elapsed() < Duration::from_secs(300), "timeout");
            self.first.gpu.device.poll(wgpu::PollType::Poll).unwrap();
            self.first.poll();
            let news = self.comparison.poll(&self.first);
            assert_eq!(news.failed, None);
            self.probe_result = news.probe_result.or(self.probe_result.take());
            if self.first.is_busy() || self.comparison.is_busy() {
                continue;
            }
            let rests = self.first.averaged() > 0;
            self.comparison.draw(&self.first, &self.wipe, &self.camera, rests).unwrap();
            if self.first.has_more(&self.camera) && self.first.averaged() < frames {
                self.first.draw(&self.camera).unwrap();
            }
        }
    }

    fn pixels_of_b(&self) -> Vec<[u8; 4]> {
        let gpu = &self.first.gpu;
        read_texture(&gpu.device, &gpu.queue, self.comparison.rendering().unwrap().texture()).unwrap()
    }
}

/// B is rendered with its own settings, its difference equals ꟻLIP, and it follows changes of settings and scene.
#[gpu_test]
fn gpu_side_b_is_rendered_and_compared(gpu: &Gpu) {
    let settings = Settings::direct_light().with_shadows(Shadows::BVH);
    let mut both = Both::new(gpu, &settings);
    assert!(!both.comparison.has_more(&both.first, &both.wipe, &both.camera) && both.comparison.rendering().is_none());
    both.wipe.other = Other::Settings;
    assert!(both.comparison.has_more(&both.first, &both.wipe, &both.camera));
    // Equal settings give equal images.
    let at_rest = |both: &Both| !both.comparison.has_more(&both.first, &both.wipe, &both.camera);
    let is_compared = |both: &Both| {
        let is_complete = both.first.averaged() == 64 && !both.first.is_busy() && !both.comparison.is_busy();
        is_complete && at_rest(both) && both.comparison.mean().is_some() && !both.comparison.is_working()
    };
    both.until(64, is_compared);
    assert_eq!((both.comparison.progress(), both.comparison.mean()), (64, Some(0.0)));
    assert!(both.pixels_of_b() == both.first.pixels().unwrap());

    both.wipe.settings.shadows.technique = Shadows::None;
    both.until(64, |both| is_compared(both) && both.comparison.mean() != Some(0.0));
    let (a, b) = (both.first.pixels().unwrap(), both.pixels_of_b());
    let image = |texels: &[[u8; 4]]| {
        let pixels = texels.iter().map(|texel| [0, 1, 2].map(|channel| f32::from(texel[channel]) / 255.0)).collect();
        RgbImage::new(48, 32, pixels).unwrap()
    };
    let expected = flip_ldr(&image(&b), &image(&a), PIXELS_PER_DEGREE).unwrap();
    assert!(expected.mean() > 0.01 && both.comparison.mean() == Some(expected.mean()));
    let gpu = &both.first.gpu;
    let map = read_texture::<[u8; 4]>(&gpu.device, &gpu.queue, both.comparison.map().unwrap().texture()).unwrap();
    assert!(map.iter().flat_map(|texel| &texel[..3]).eq(&expected.magma()));

    // The scene changes.
    let mut lights = both.first.scene.lights.clone();
    lights[0].position.x += 0.3;
    both.comparison.release_scene();
    both.first.set_lights(lights).unwrap();
    both.until(64, is_compared);
    assert!(Arc::ptr_eq(&both.first.scene, &both.comparison.rendered.as_ref().unwrap().scene));
    assert!(both.pixels_of_b() != b && both.first.pixels().unwrap() != a);
    assert!(both.first.exposure().unwrap().unwrap().is_finite());
    both.wipe.settings.shadows.technique = Shadows::BVH;
    both.until(64, |both| is_compared(both) && both.comparison.mean() == Some(0.0));
    assert!(both.pixels_of_b() == both.first.pixels().unwrap(), "B has followed the scene");
    // Debug views are not averaged.
    both.wipe.settings.image.debug_view = Some(DebugView::Normal);
    both.until(64, |both| is_compared(both) && both.comparison.progress() == 1);
    both.wipe.other = Other::Nothing;
    both.until(64, at_rest);
    assert!(both.comparison.rendering().is_none() && both.comparison.mean().is_none());
}

/// The path tracer's image uses A's exposure and tone map, and includes indirect light that A leaves out. A camera move
/// cancels it.
#[gpu_test]
fn gpu_the_path_tracer_works_while_the_camera_rests(gpu: &Gpu) {
    let settings = Settings::direct_light().with_tone_map(ToneMap::Reinhard);
    let mut both = Both::new(gpu, &settings);
    both.wipe.other = Other::PathTracer;
    both.until(3, |both| both.first.averaged() == 3 && !both.first.is_busy() && both.comparison.progress() > 20);
    let ev = both.first.exposure().unwrap().unwrap();
    both.until(3, |both| both.comparison.look.is_some_and(|(look, _)| look.ev == ev));
    let (_, traced) = both.comparison.traced.as_ref().unwrap();
    assert!(both.pixels_of_b().as_flattened() == traced.bytes, "the texture is the image");
    let light = |bytes: &[u8]| bytes.iter().map(|byte| f64::from(*byte)).sum::<f64>();
    let (all, direct) = (light(&traced.bytes), light(both.first.pixels().unwrap().as_flattened()));
    assert!(all > 1.05 * direct, "indirect light is missing: {all} and {direct}");
    let (first, camera) = (&both.first, both.camera.clone());
    both.comparison.draw(first, &both.wipe, &camera, false).unwrap();
    assert!(
        both.comparison.rendering().is_none() && !both.comparison.background.as_ref().unwrap().is_working(),
        "it moves"
    );
    both.camera.world_from_camera.translation.x += 0.1;
    both.until(3, |both| both.first.averaged() == 3 && both.comparison.progress() > 0);
}

#[gpu_test]
fn gpu_a_pixel_is_probed_while_images_are_drawn(gpu: &Gpu) {
    let settings = Settings::direct_light().with_shadows(Shadows::BVH);
    let mut both = Both::new(gpu, &settings);
    both.comparison.probe(&both.first, &both.camera, [0.5, 0.97]);
    both.until(1, |both| both.probe_result.is_some());
    let probe_result = both.probe_result.take().unwrap();
    assert!(
        probe_result.place.is_some_and(|place| place.normal.y > 0.9) && probe_result.light_count > 0,
        "{probe_result:?}"
    );
    // Outside the box the pixel shows the environment.
    both.camera.world_from_camera.translation.x += 1e4;
    both.comparison.probe(&both.first, &both.camera, [0.5, 0.97]);
    both.until(1, |both| both.probe_result.is_some());
    assert_eq!(both.probe_result.unwrap().place, None);
}
