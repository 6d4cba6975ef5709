//! Frames of a view with a history after a change of light.

use glam::Vec3;
use lanternfish::{
    Renderer, Settings,
    settings::{History, Preset},
};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_metrics::{HdrFlip, Pair, RgbImage};
use lanternfish_scene::{Camera, Light, Projection, generate::demo};

use crate::support::linear;

/// Mean of images.
fn mean_of(images: &[RgbImage]) -> RgbImage {
    let mut mean = images[0].clone();
    for (i, pixel) in mean.pixels.iter_mut().enumerate() {
        let sum: Vec3 = images.iter().map(|image| Vec3::from(image.pixels[i])).sum();
        *pixel = (sum / images.len() as f32).to_array();
    }
    mean
}

/// A lamp that goes out leaves no light behind, and the frames after it differ little from their later mean.
#[gpu_test]
fn gpu_light_of_a_lamp_goes_out_with_it(gpu: &Gpu) {
    let lamp = |x: f32, intensity: Vec3| Light::point(Vec3::new(x, 1.7, 0.0), intensity);
    let mut dark = demo("cornell").unwrap();
    dark.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    dark.lights = vec![lamp(0.5, Vec3::new(0.5, 0.7, 1.0)), lamp(-0.5, Vec3::ZERO)];
    let mut lit = dark.clone();
    lit.lights[1].intensity = Vec3::new(60.0, 50.0, 30.0);
    let projection = Projection::Perspective { fov_y: 0.8, near: 0.02 };
    let camera = Camera::look_at(Vec3::new(0.0, 1.0, 2.6), Vec3::Y, projection);
    let energy = |image: &RgbImage| image.pixels.iter().map(|pixel| f64::from(pixel.iter().sum::<f32>())).sum::<f64>();
    // Mean HDR-FLIP of frames 1 and 4 to the later mean, about a quarter above what was measured.
    for (preset, most) in
        [(Preset::Good, [0.15, 0.094]), (Preset::Draft, [0.225, 0.105]), (Preset::Realtime, [0.25, 0.134])]
    {
        let settings = Settings::of_preset(preset).with_history(History::On);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let mut scene = renderer.upload(&lit).unwrap();
        let frames = |renderer: &mut Renderer, scene: &_, count| -> Vec<RgbImage> {
            (0..count).map(|_| linear(&renderer.render(scene, &camera, [64, 48]).unwrap())).collect()
        };
        frames(&mut renderer, &scene, 12);
        renderer.update(&mut scene, &dark).unwrap();
        let frames = frames(&mut renderer, &scene, 40);
        let later = mean_of(&frames[24..]);
        let both = [0, 3].map(|i| &frames[i]);
        let flips = both.map(|frame| {
            let pair = Pair::new(frame.clone(), later.clone()).unwrap();
            pair.mean_of(&pair.flip_hdr(&HdrFlip::default()).unwrap().map)
        });
        let energies = both.map(|frame| energy(frame) / energy(&later));
        println!("{preset}: frames 1 and 4: FLIP {flips:.3?}, energy {energies:.3?}");
        assert!(flips.iter().zip(most).all(|(flip, most)| *flip < most), "{preset}: {flips:?}");
        assert!(energies.iter().all(|energy| (energy - 1.0).abs() < 0.04), "{preset}: {energies:?}");
    }
}
