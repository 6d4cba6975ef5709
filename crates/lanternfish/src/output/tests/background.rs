//! Images without the environment behind their surfaces.

use std::f32::consts::{PI, SQRT_2};

use glam::{UVec2, Vec3};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{AlphaMode, Camera, Light, Material, Scene, generate::demo};

use crate::{
    RenderedImage, Renderer, Settings,
    settings::{Background, Exposure, Samples, Tracer},
    testing::{
        light::{looking, matt, sampled},
        quad, scene_of,
    },
};

const SIZE: UVec2 = UVec2::new(102, 72);

/// Under a white sky two rows of spheres of glass, thick and thin, more and less rough, one with dispersion, and below them an opaque sheet, a
/// leaf that covers a quarter, a smooth green pane and a hair.
fn scene() -> (Scene, Camera) {
    let glass = |i: usize| Material {
        metallic: 0.0,
        perceptual_roughness: (i % 3) as f32 / 5.0,
        transmission: 1.0,
        thickness: if i < 6 { 1.0 } else { 0.0 },
        dispersion: if i == 1 { 5.0 } else { 0.0 },
        alpha_mode: AlphaMode::Blend,
        ..Material::default()
    };
    let mut scene = demo("furnace").unwrap();
    scene.materials.iter_mut().enumerate().for_each(|(i, slot)| *slot = glass(i));
    let mut leaf = Material { alpha_mode: AlphaMode::Blend, ..matt(0.5) };
    leaf.base_color.w = 0.25;
    let pane = Material { base_color: Vec3::new(0.3, 0.9, 0.6).extend(1.0), perceptual_roughness: 0.0, ..glass(6) };
    let first = scene.materials.len();
    let sheet = |i: usize, width: f32| {
        quad(first + i, Vec3::new(i as f32 - 1.5, -1.6, 0.0), 0.5 * width * Vec3::X, 0.3 * Vec3::Y)
    };
    scene.materials.extend([matt(0.5), leaf, pane, matt(0.1)]);
    let mut sheets = scene_of(vec![sheet(0, 0.8), sheet(1, 0.8), sheet(2, 0.8), sheet(3, 0.01)], Vec::new());
    sheets.instances[0].mesh = scene.meshes.len();
    scene.meshes.append(&mut sheets.meshes);
    scene.instances.append(&mut sheets.instances);
    (scene.lights, scene.sky) = (Vec::new(), Vec3::ONE);
    (scene, looking([0.0, -0.5, 5.0], [0.0, -0.5, 0.0]))
}

fn drawn(gpu: &Gpu, samples: Samples, background: Background) -> RenderedImage {
    let settings = Settings::direct_light().with_indirect(sampled(Tracer::BVH)).with_exposure(Exposure::Ev(0.0));
    let settings = settings.with_samples(samples).with_accumulate(2).with_background(background);
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let (scene, camera) = scene();
    let uploaded = renderer.upload(&scene).unwrap();
    renderer.render(&uploaded, &camera, SIZE.into()).unwrap()
}

fn at(image: &RenderedImage, [x, y]: [u32; 2]) -> ([f32; 4], [u8; 4]) {
    let index = (y * SIZE.x + x) as usize;
    (image.radiance[index], image.display[index])
}

/// Over its background an image is what the environment behind it shows, as alpha is one number, in the mean of the channels.
#[gpu_test]
fn gpu_opacity_is_what_hides_the_background(gpu: &Gpu) {
    for samples in [Samples::One, Samples::Four] {
        let [shown, hidden] = [Background::Environment, Background::Transparent].map(|b| drawn(gpu, samples, b));
        let mean = |[r, g, b, _]: &[f32; 4]| (r + g + b) / 3.0;
        let (mut most, mut clear, mut between) = (0.0f32, 0, 0);
        for (i, (shown, hidden)) in shown.radiance.iter().zip(&hidden.radiance).enumerate() {
            let off = mean(hidden) + (1.0 - hidden[3]) - mean(shown);
            most = most.max(off.abs());
            assert!(off.abs() < 0.01, "{samples:?}, pixel {} {}: {off}", i as u32 % SIZE.x, i as u32 / SIZE.x);
            clear += u32::from(hidden[3] == 0.0);
            between += u32::from(hidden[3] > 0.01 && hidden[3] < 0.99);
        }
        println!("{samples:?}: differs by at most {most}; {clear} pixels clear, {between} in part");
        assert!(clear > 1000 && between > 1000);
        let opacity = |x| at(&hidden, [x, 54]).0[3];
        let [sheet, leaf, pane] = [24, 42, 60].map(opacity);
        assert!(sheet == 1.0 && (leaf - 0.25).abs() < 2e-3, "{sheet}, {leaf}");
        // 1 - (1 - 0.04) × (0.3 + 0.9 + 0.6) / 3, and the part that the far side of the pane mirrors.
        assert!((pane - 0.42).abs() < 0.05, "{pane}");
        // Eight samples of a hair of 0.17 pixels.
        let hair: f32 = (70..86).map(opacity).sum();
        assert!(samples == Samples::One || (hair > 0.03 && hair < 0.4), "{hair} pixels");
    }
}

/// Under a sun a shadow catcher is clear, and black in the shadow of a sheet; with its environment an image shows it as it is.
#[gpu_test]
fn gpu_shadow_catchers_show_only_shadows(gpu: &Gpu) {
    let catcher = Material { alpha_mode: AlphaMode::ShadowCatcher { unshadowed: 0.5 }, ..matt(0.5) };
    let floor = quad(0, Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y);
    let sheet = quad(1, Vec3::new(0.5, 0.5, 0.5), 0.5 * Vec3::X, 0.5 * Vec3::Y);
    let sun = Light::directional(Vec3::new(-1.0, 0.0, -1.0), Vec3::splat(PI * SQRT_2));
    let scene = Scene { lights: vec![sun], ..scene_of(vec![floor, sheet], vec![catcher, matt(0.5)]) };
    let camera = looking([0.0, 0.0, 5.0], [0.0, 0.0, 0.0]);
    for (samples, accumulate) in [(Samples::One, 1), (Samples::Four, 2)] {
        let of = |background| {
            let settings = Settings::direct_light().with_exposure(Exposure::Ev(0.0)).with_samples(samples);
            let settings = settings.with_accumulate(accumulate).with_background(background);
            let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
            let uploaded = renderer.upload(&scene).unwrap();
            renderer.render(&uploaded, &camera, SIZE.into()).unwrap()
        };
        let [shown, hidden, white] =
            [Background::Environment, Background::Transparent, Background::Color([255; 3])].map(of);
        // Beside the sheet, left of it in its shadow, and the sheet itself.
        let [lit, shadow, sheet] = [[51, 60], [47, 27], [60, 26]];
        let near = |(a, _): ([f32; 4], _), b: [f32; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3);
        assert!(near(at(&shown, lit), [0.5, 0.5, 0.5, 1.0]), "{:?}", at(&shown, lit));
        assert!(near(at(&shown, shadow), [0.0, 0.0, 0.0, 1.0]), "{:?}", at(&shown, shadow));
        assert!(near(at(&hidden, lit), [0.0; 4]), "{:?}", at(&hidden, lit));
        assert!(near(at(&hidden, shadow), [0.0, 0.0, 0.0, 1.0]), "{:?}", at(&hidden, shadow));
        assert!(near(at(&hidden, sheet), [0.5, 0.5, 0.5, 1.0]), "{:?}", at(&hidden, sheet));
        assert_eq!((at(&white, lit).1, at(&white, shadow).1), ([255; 4], [0, 0, 0, 255]));
    }
}

#[gpu_test]
fn gpu_display_images_have_a_colour_or_alpha_behind_them(gpu: &Gpu) {
    let color = [255, 128, 1];
    let of = |background| drawn(gpu, Samples::Four, background);
    let [shown, clear, colored, white] =
        [Background::Environment, Background::Transparent, Background::Color(color), Background::Color([255; 3])]
            .map(of);
    let (nothing, sheet) = ([2, 2], [24, 54]);
    assert_eq!(at(&clear, nothing), ([0.0; 4], [0; 4]));
    assert_eq!(at(&colored, nothing).1, [255, 128, 1, 255]);
    assert_eq!(at(&white, nothing).1, [255; 4]);
    let opaque = at(&shown, sheet).1;
    assert!([&clear, &colored, &white].iter().all(|image| at(image, sheet).1 == opaque) && opaque[3] == 255);
    // The leaf shows the light that it has where it covers.
    let ([r, .., alpha], [byte, .., opacity]) = at(&clear, [42, 54]);
    assert!((i32::from(opacity) - 64).abs() <= 1 && (alpha - 0.25).abs() < 2e-3, "{opacity}, {alpha}");
    let expected = super::super::display::encoded(&[[r / alpha; 3]], 0.0, crate::settings::ToneMap::Neutral)[0];
    assert!((i32::from(byte) - i32::from(expected)).abs() <= 1, "{byte}, {expected}");
}
