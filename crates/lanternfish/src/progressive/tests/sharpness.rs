//! Textures of means against the path tracer: a checkered floor and a brick wall at grazing angles.

use glam::{UVec2, Vec2, Vec3};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_reference::{Film, Settings as TracerSettings, Tracer as PathTracer};
use lanternfish_scene::{Camera, Image, Light, Material, Primitive, Sampler, Scene, Texture, TextureRef};

use super::renderer_of;
use crate::{
    Settings,
    settings::{Attenuation, Samples},
    testing::{
        light::{looking, matt},
        quad, scene_of,
    },
};

const SIZE: UVec2 = UVec2::new(160, 90);
/// Samples per pixel of each of two independent truths.
const TRUTH: u64 = 64;
const FRAMES: [u32; 4] = [1, 2, 4, 8];

/// An image of `columns` × `rows` blocks with joints between them: grey, in two tones.
fn blocks(columns: u32, rows: u32, is_staggered: bool) -> Image {
    const EDGE: u32 = 256;
    let (width, height) = (EDGE / columns, EDGE / rows);
    let texel = |i: u32| {
        let (y, row) = (i / EDGE, i / EDGE / height);
        let x = i % EDGE + if is_staggered { row % 2 * width / 2 } else { 0 };
        let is_joint = is_staggered && (x % width < 3 || y % height < 3);
        let tone = if is_joint { 60 } else { 140 + 80 * ((x / width + row) % 2) as u8 };
        [tone, tone, tone, 255]
    };
    Image { name: String::new(), width: EDGE, height: EDGE, rgba: (0..EDGE * EDGE).flat_map(texel).collect() }
}

/// A room of 2 m with a lamp: the floor is checkered, a wall is of bricks, the rest is plain.
fn room() -> (Scene, Camera) {
    let textured = |texture| Material { base_color_texture: Some(TextureRef::new(texture)), ..matt(1.0) };
    let side = |material, axis: Vec3| {
        let (right, up) = axis.any_orthonormal_pair();
        quad(material, -axis, right, up)
    };
    let repeated = |mut side: Primitive| {
        side.uv0.iter_mut().for_each(|uv: &mut Vec2| *uv *= 2.0);
        side
    };
    let plain = [-Vec3::Y, -Vec3::X, Vec3::Z, -Vec3::Z].map(|axis| side(2, axis));
    let mut sides = vec![repeated(side(0, Vec3::Y)), repeated(side(1, Vec3::X))];
    sides.extend(plain);
    let mut scene = scene_of(sides, vec![textured(0), textured(1), matt(0.6)]);
    scene.images = vec![blocks(16, 16, false), blocks(8, 16, true)];
    scene.samplers = vec![Sampler::default()];
    scene.textures = [0, 1].map(|image| Texture { image, sampler: 0 }).to_vec();
    scene.lights = vec![Light::point(Vec3::new(0.4, 0.4, 0.3), Vec3::splat(3.0))];
    (scene, looking([-0.3, -0.7, 0.98], [-0.35, -0.8, -1.0]))
}

/// Luminance of the pixels by the path tracer.
fn truth(scene: &Scene, camera: &Camera, max_depth: u32, seed: u64) -> Vec<f32> {
    let (attenuation, range_threshold) = (Attenuation::Physical, 1e-6);
    let settings = TracerSettings { max_depth, attenuation, range_threshold, seed, ..TracerSettings::default() };
    let mut film = Film::new(SIZE.into()).unwrap();
    PathTracer::new(scene, settings).unwrap().render(camera, &mut film, TRUTH);
    film.mean().iter().map(|pixel| pixel[1]).collect()
}

/// The logarithm of an image less its mean over 5 × 5 pixels, at pixels that are not at the border.
fn detail(image: &[f32]) -> Vec<f64> {
    let at = |x: u32, y: u32| f64::from(image[(y * SIZE.x + x) as usize].max(1e-6)).ln();
    let mut detail = Vec::new();
    for (x, y) in (2..SIZE.y - 2).flat_map(|y| (2..SIZE.x - 2).map(move |x| (x, y))) {
        let mean = (0..25).map(|i| at(x + i % 5 - 2, y + i / 5 - 2)).sum::<f64>() / 25.0;
        detail.push(at(x, y) - mean);
    }
    detail
}

/// Contrast of an image: the slope of its detail over that of the truth, which is 1 if both have the same. And its root mean square error over
/// the truth. Two independent truths, so that their noise is in neither.
fn compare(image: &[f32], truths: &[Vec<f32>; 2]) -> (f64, f64) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (fine, of) = (detail(image), truths.each_ref().map(|truth| detail(truth)));
    let slope = 0.5 * (dot(&fine, &of[0]) + dot(&fine, &of[1])) / dot(&of[0], &of[1]);
    let squares = image.iter().zip(&truths[0]).zip(&truths[1]).map(|((value, a), b)| {
        let scale = 0.5 * (a + b) + 1e-4;
        f64::from((value - a) * (value - b) / (scale * scale))
    });
    (slope, (squares.sum::<f64>() / image.len() as f64).max(0.0).sqrt())
}

fn check_sharpness(gpu: &Gpu, settings: Settings, max_depth: u32) {
    let (scene, camera) = room();
    let truths = [1, 2].map(|seed| truth(&scene, &camera, max_depth, seed));
    let settings = settings.with_attenuation(Attenuation::Physical).with_range_threshold(1e-6);
    for samples in [Samples::One, Samples::Four] {
        let settings = settings.clone().with_samples(samples);
        let mut renderer = renderer_of(gpu, &settings, *FRAMES.last().unwrap());
        let uploaded = renderer.upload(&scene).unwrap();
        let mut found = Vec::new();
        for frame in 1..=FRAMES[FRAMES.len() - 1] {
            let mean = renderer.refine(&uploaded, &[(&camera, SIZE.into())]).unwrap().remove(0);
            if FRAMES.contains(&frame) {
                let green: Vec<f32> = mean.radiance.iter().map(|texel| texel[1]).collect();
                found.push(compare(&green, &truths));
            }
        }
        println!("{samples} samples, {FRAMES:?} frames, (contrast, error): {found:.3?}");
        let is_sharp = |(contrast, _): &(f64, f64)| (0.94..1.06).contains(contrast);
        assert!(found.iter().all(is_sharp), "contrast, {samples} samples: {found:.3?}");
        // Four samples are shaded once, at the pixel's centre: their filter is not quite a box, and more frames do not mend that.
        let is_better =
            |pair: &[(f64, f64)]| pair[1].1 <= pair[0].1 + if samples == Samples::One { 0.0 } else { 0.006 };
        assert!(found.windows(2).all(is_better), "error, {samples} samples: {found:.3?}");
    }
}

#[gpu_test]
fn gpu_means_are_as_sharp_as_the_truth(gpu: &Gpu) {
    check_sharpness(gpu, Settings::direct_light(), 2);
}

#[gpu_test(full)]
fn gpu_means_of_all_light_are_as_sharp_as_the_truth(gpu: &Gpu) {
    check_sharpness(gpu, Settings::default(), TracerSettings::default().max_depth);
}
