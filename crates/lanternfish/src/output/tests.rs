mod background;

use glam::Vec3;
use lanternfish_gpu::{Gpu, Pool, Profiler, testing};

use lanternfish_scene::{Camera, generate};

use super::*;
use crate::{Renderer, Settings, shaders::constant, testing::Random, texture::target};

/// An image of `count` surface pixels of one luminance.
fn surfaces(luminance: f32, count: usize) -> Vec<[f32; 4]> {
    vec![[luminance, luminance, luminance, 1.0]; count]
}

fn with(mut pixels: Vec<[f32; 4]>, more: Vec<[f32; 4]>) -> Vec<[f32; 4]> {
    pixels.extend(more);
    pixels
}

/// An interior: luminances over eight stops around `middle`, some of them environment.
fn interior(middle: f32, seed: u64) -> Vec<[f32; 4]> {
    let mut random = Random::new(seed);
    let mut pixel = || {
        let colour = [(); 3].map(|()| middle * random.between(-4.0, 4.0).exp2());
        let alpha = if random.unit() < 0.7 { 1.0 } else { random.unit() };
        [colour[0], colour[1], colour[2], alpha]
    };
    (0..5000).map(|_| pixel()).collect()
}

fn scaled(pixels: &[[f32; 4]], scale: f32) -> Vec<[f32; 4]> {
    pixels.iter().map(|[r, g, b, a]| [r * scale, g * scale, b * scale, *a]).collect()
}

#[test]
fn a_scale_of_the_light_is_undone_by_the_exposure() {
    let interior = interior(0.2, 1);
    let ev = metered_exposure(interior.iter().copied());
    // From 1 cd to 100,000 lx there are 17 doublings.
    for doublings in -20..=20 {
        let other = metered_exposure(scaled(&interior, (doublings as f32).exp2()));
        assert_eq!(other, ev - doublings as f32);
    }
    // Middle grey changes by at most one step.
    assert!(metered_exposure(surfaces(0.25, 100)).abs() <= 0.125);
}

#[test]
fn lamps_and_skies_change_the_exposure_little() {
    let plain = surfaces(0.25, 1000);
    let ev = metered_exposure(plain.iter().copied());
    let moved_by = |more: Vec<[f32; 4]>| metered_exposure(with(plain.clone(), more)) - ev;
    let environment_light = |luminance: f32, count| vec![[luminance, luminance, luminance, 0.0]; count];
    // Black: nothing at all, however much there is.
    assert_eq!(moved_by(surfaces(0.0, 9000)), 0.0);
    assert_eq!(moved_by(environment_light(0.0, 9000)), 0.0);
    // A lamp of less than the highlights' share, however bright.
    for bright in [1e3, 1e9, 1e30] {
        assert!(moved_by(surfaces(bright, 40)).abs() <= 0.125, "{bright}");
        assert!(moved_by(environment_light(bright, 400)).abs() <= 0.125, "{bright}");
    }
    // Check that the test can fail: a wall of the same size and brightness changes the exposure.
    assert!(moved_by(surfaces(1e3, 400)) < -8.0);
    // A sky eight times as bright, over a half of the image, takes less than a stop; a surface takes more than two.
    let (sky, wall) = (moved_by(environment_light(2.0, 1000)), moved_by(surfaces(2.0, 1000)));
    assert!((-1.125..0.0).contains(&sky) && wall <= -2.0, "{sky} {wall}");
}

#[test]
fn non_finite_pixels_are_skipped_and_every_exposure_is_finite() {
    let broken = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0];
    let broken: Vec<[f32; 4]> = broken.into_iter().flat_map(|value| surfaces(value, 100)).collect();
    assert_eq!(metered_exposure(with(surfaces(8.0, 100), broken.clone())), metered_exposure(surfaces(8.0, 100)));
    assert_eq!(metered_exposure(broken), 0.0);
    assert_eq!(metered_exposure([]), 0.0);
    assert_eq!(metered_exposure(surfaces(0.0, 10)), 0.0);
    for luminance in [f32::MIN_POSITIVE, 1e-12, 1e-9, 1.0, 65504.0, 1e12, f32::MAX] {
        let ev = metered_exposure(surfaces(luminance, 10));
        assert!((-34.0..=30.0).contains(&ev), "{luminance}: {ev}");
    }
}

#[test]
fn constants_are_the_shaders() {
    assert_eq!(constant("output/meter", "BIN_COUNT"), meter::BIN_COUNT as f64);
    for (name, value) in cpu_reference::CONSTANTS {
        assert_eq!(constant("output/meter", name) as f32, value as f32, "{name}");
    }
}

/// The exposure that the device computes for some images together.
fn metered(gpu: &Gpu, renderings: &[(UVec2, Vec<[f32; 4]>)]) -> f32 {
    let mut output = Output::new(&gpu.device, &ImageSettings::default()).unwrap();
    let texture = |(size, pixels): &(UVec2, Vec<[f32; 4]>)| {
        let format = wgpu::TextureFormat::Rgba32Float;
        let view = target(&gpu.device, "rendering", *size, format, wgpu::TextureUsages::COPY_DST);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16 * size.x), rows_per_image: None };
        let texels = bytemuck::cast_slice(pixels);
        gpu.queue.write_texture(view.texture().as_image_copy(), texels, layout, view.texture().size());
        view
    };
    let views: Vec<_> = renderings.iter().map(texture).collect();
    let (mut profiler, mut pool) = (Profiler::new(&gpu.device, &gpu.queue), Pool::new(&gpu.device));
    // Twice: no state of the first run remains.
    for _ in 0..2 {
        let mut frame = Frame::pooled(&gpu.device, &gpu.queue, &mut profiler, &mut pool);
        output.meter(&mut frame, &views.iter().collect::<Vec<_>>(), 1.0).unwrap();
        frame.submit();
    }
    output.exposure(&gpu.device, &gpu.queue).unwrap()
}

#[gpu_test]
fn gpu_the_meter_is_its_cpu_reference(gpu: &Gpu) {
    let rendering = |size: UVec2, middle: f32, seed| {
        let mut pixels = interior(middle, seed);
        pixels.resize((size.x * size.y) as usize, [f32::INFINITY, 0.0, 0.0, 1.0]);
        (size, pixels)
    };
    let mut seen = Vec::new();
    for (i, middle) in [1e-8, 1e-3, 0.2, 3.0, 700.0, 1e5, 1e9].into_iter().enumerate() {
        // Around multiples of a workgroup's block.
        let sizes = [(70, 100), (1, 6000), (64, 128), (65, 129), (300, 20)];
        for (width, height) in sizes {
            let one = rendering(UVec2::new(width, height), middle, i as u64);
            let ev = metered(gpu, std::slice::from_ref(&one));
            assert_eq!(ev, metered_exposure(one.1.iter().copied()), "{width} x {height}, {middle}");
            seen.push(ev);
        }
    }
    assert!(seen.iter().any(|ev| *ev > 20.0) && seen.iter().any(|ev| *ev < -25.0), "{seen:?}");
    assert_eq!(metered(gpu, &[(UVec2::ONE, surfaces(0.0, 1))]), 0.0);
    // Two images are metered like one image, in either order.
    let (left, right) = (rendering(UVec2::new(90, 90), 0.1, 8), rendering(UVec2::new(80, 70), 5.0, 9));
    let both = metered_exposure(left.1.iter().chain(&right.1).copied());
    assert_eq!([metered(gpu, &[left.clone(), right.clone()]), metered(gpu, &[right, left.clone()])], [both; 2]);
    assert_ne!(metered(gpu, &[left]), both);
}

#[gpu_test]
fn gpu_views_share_an_exposure_and_means_continue_at_another(gpu: &Gpu) {
    let scene = generate::demo("cornell").unwrap();
    let new = |exposure| {
        Renderer::with_engine(&testing::engine(gpu), Settings::direct_light().with_exposure(exposure)).unwrap()
    };
    let mut auto = new(Exposure::Auto);
    let uploaded = auto.upload(&scene).unwrap();
    // The box, and a close view of its lamp.
    let below = Camera::look_at(Vec3::new(0.0, 1.2, 0.4), Vec3::new(0.05, 2.0, 0.0), scene.cameras[0].projection);
    let views = [(&scene.cameras[0], [60, 44]), (&below, [50, 40])];
    let renderings = auto.render_views(&uploaded, &views).unwrap();
    let ev = renderings[0].exposure.unwrap();
    let alone = [0, 1].map(|eye| auto.render_views(&uploaded, &views[eye..=eye]).unwrap().remove(0).exposure.unwrap());
    assert!(alone[0] != alone[1], "both views have the same exposure: {alone:?}");
    assert_eq!(renderings[1].exposure, Some(ev));
    // The device's exposure equals the CPU reference. Set as a manual exposure it gives the same images; radiance does not depend on it.
    let all = renderings.iter().flat_map(|rendering| rendering.radiance.iter().copied());
    assert_eq!(Exposure::Auto.of(all), ev);
    let said = new(Exposure::Ev(ev)).render_views(&uploaded, &views).unwrap();
    let dark = new(Exposure::Ev(-20.0)).render_views(&uploaded, &views).unwrap();
    for ((rendering, said), dark) in renderings.iter().zip(&said).zip(&dark) {
        assert!(rendering.display == said.display && rendering.radiance == said.radiance);
        assert!(rendering.display != dark.display && rendering.radiance == dark.radiance);
    }

    // A viewer's exposure changes while the mean continues.
    let frames = |rendering: &crate::RenderedImage| {
        rendering.report.counters.iter().find(|(name, _)| name == "progressive/frames").map(|(_, count)| *count)
    };
    auto.refine(&uploaded, &views[..1]).unwrap();
    auto.set_exposure(Exposure::Ev(-6.0)).unwrap();
    let second = auto.refine(&uploaded, &views[..1]).unwrap().remove(0);
    assert_eq!((frames(&second), second.exposure), (Some(2), Some(-6.0)));
    auto.set_exposure(Exposure::Auto).unwrap();
    let third = auto.refine(&uploaded, &views[..1]).unwrap().remove(0);
    assert_eq!((frames(&third), third.exposure), (Some(3), Some(Exposure::Auto.of(third.radiance.iter().copied()))));
}

#[gpu_test]
fn gpu_a_non_finite_exposure_is_rejected(gpu: &Gpu) {
    let new = |exposure| Renderer::with_engine(&testing::engine(gpu), Settings::direct_light().with_exposure(exposure));
    let mut renderer = new(Exposure::Ev(1.0)).unwrap();
    for (ev, got) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (f32::NEG_INFINITY, "-inf")] {
        let message = format!("`exposure` {got}: expected a finite number of stops, or auto");
        assert_eq!(new(Exposure::Ev(ev)).unwrap_err().to_string(), message);
        assert_eq!(renderer.set_exposure(Exposure::Ev(ev)).unwrap_err().to_string(), message);
        assert_eq!(renderer.settings().image.exposure, Exposure::Ev(1.0));
    }
}
