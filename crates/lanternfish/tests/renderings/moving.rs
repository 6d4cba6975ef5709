//! Frames of a view with a history: after a change of light, and on smooth meshes of few triangles.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use lanternfish::{
    Renderer, Settings,
    settings::{History, Preset},
};
use lanternfish_gpu::testing;
use lanternfish_metrics::{HdrFlip, Pair, RgbImage};
use lanternfish_scene::{Camera, Environment, Light, Material, Primitive, Projection, Scene, generate::demo};

use crate::support::{linear, scene_of};

/// Mean of images.
fn mean_of(images: &[RgbImage]) -> RgbImage {
    let mut mean = images[0].clone();
    for (i, pixel) in mean.pixels.iter_mut().enumerate() {
        let sum: Vec3 = images.iter().map(|image| Vec3::from(image.pixels[i])).sum();
        *pixel = (sum / images.len() as f32).to_array();
    }
    mean
}

/// A lamp that goes out leaves no light behind: the frames after it differ little from their later mean, hardly more than the first ones
/// of a scene in which it never shone.
#[gpu_test(full)]
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
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
        let mut scene = renderer.upload(&lit).unwrap();
        let frames = |renderer: &mut Renderer, scene: &_, count| -> Vec<RgbImage> {
            (0..count).map(|_| linear(&renderer.render(scene, &camera, [64, 48]).unwrap())).collect()
        };
        frames(&mut renderer, &scene, 12);
        renderer.update(&mut scene, &dark).unwrap();
        let after = frames(&mut renderer, &scene, 40);
        let later = mean_of(&after[24..]);
        let flip = |frame: &RgbImage| {
            let pair = Pair::new(frame.clone(), later.clone()).unwrap();
            pair.mean_of(&pair.flip_hdr(&HdrFlip::default()).unwrap().map)
        };
        let both = [0, 3].map(|i| &after[i]);
        let flips = both.map(flip);
        let mut fresh = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let scene = fresh.upload(&dark).unwrap();
        let without = flip(&frames(&mut fresh, &scene, 4)[3]);
        let energies = both.map(|frame| energy(frame) / energy(&later));
        println!("{preset}: frames 1 and 4: FLIP {flips:.3?}, without the lamp {without:.3}, energy {energies:.3?}");
        assert!(flips[1] < without + 0.02, "{preset}: {flips:?}, {without}");
        assert!(flips.iter().zip(most).all(|(flip, most)| *flip < most), "{preset}: {flips:?}");
        assert!(energies.iter().all(|energy| (energy - 1.0).abs() < 0.04), "{preset}: {energies:?}");
    }
}

/// A ball with smooth normals, of radius 1 m around the origin, in light that changes evenly from below to above.
fn ball(columns: u32, rows: u32) -> Scene {
    let point = |i: u32, j: u32| {
        let (theta, phi) = (PI * j as f32 / rows as f32, TAU * i as f32 / columns as f32);
        Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    let positions: Vec<Vec3> = (0..=rows).flat_map(|j| (0..=columns).map(move |i| point(i, j))).collect();
    let corners = (0..rows).flat_map(|j| (0..columns).map(move |i| j * (columns + 1) + i));
    let indices = corners.flat_map(|a| [a, a + 1, a + columns + 1, a + 1, a + columns + 2, a + columns + 1]).collect();
    let (normals, uv0) = (positions.clone(), vec![Vec2::ZERO; positions.len()]);
    let ball = Primitive { positions, normals, uv0, indices, ..Primitive::default() };
    let matt = Material { metallic: 0.0, specular: 0.0, perceptual_roughness: 1.0, ..Material::default() };
    let radiance = |j: usize| Vec3::splat(1.0 + 0.8 * (PI * (j as f32 + 0.5) / 16.0).cos());
    let pixels = (0..16).flat_map(|j| [radiance(j); 32]).collect();
    let environment = Some(Environment { width: 32, height: 16, pixels, rotation: 0.0 });
    Scene { environment, ..scene_of(vec![ball], vec![matt]) }
}

/// Light from screen probes follows shading normals: it has no steps at the edges of a smooth mesh's triangles.
#[gpu_test]
fn gpu_smooth_meshes_show_no_triangles(gpu: &Gpu) {
    const EDGE: usize = 96;
    let scene = ball(12, 8);
    let projection = Projection::Orthographic { half_height: 0.9, near: 0.0, far: 20.0 };
    let camera = Camera::look_at(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, projection);
    let settings = Settings::of_preset(Preset::Draft).with_history(History::On);
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let scene = renderer.upload(&scene).unwrap();
    let mut frame = || linear(&renderer.render(&scene, &camera, [EDGE as u32; 2]).unwrap());
    let frames: Vec<_> = (0..16).map(|_| frame()).collect();
    let mean = mean_of(&frames[8..]);
    // Rows in the middle of the ball, over what a ball without triangles would show.
    let row = |y: usize| {
        let height = 0.9 * (1.0 - (2 * y + 1) as f64 / EDGE as f64);
        let sum: f64 = (EDGE / 4..3 * EDGE / 4).map(|x| f64::from(mean.pixels[y * EDGE + x][1])).sum();
        sum / (1.0 + 0.8 * 2.0 / 3.0 * height)
    };
    let steps = (EDGE / 6..5 * EDGE / 6).map(|y| (row(y + 1) / row(y) - 1.0).abs());
    let largest = steps.fold(0.0, f64::max);
    println!("largest step from row to row: {largest:.4}");
    assert!(largest < 0.012, "{largest}");
}
