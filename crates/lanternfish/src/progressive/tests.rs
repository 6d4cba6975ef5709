mod sharpness;

use std::{f32::consts::FRAC_PI_6, ops::ControlFlow};

use glam::{Mat3, Vec2, Vec3};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{
    Camera, Image, Material, Projection, Sampler, Scene, StereoRig, Texture, TextureRef, generate,
};

use super::*;
use crate::{
    RenderError, RenderedImage, Renderer, Settings,
    context::FrameContext,
    settings::{DebugView, Samples},
    testing::{quad, scene_of},
    view::jitter_of_frame,
};

const SIZE: (u32, u32) = (60, 44);

fn cornell() -> Scene {
    let mut scene = generate::demo("cornell").unwrap();
    scene.lights.extend(generate::light_rain(&scene.bounds(), 40, Some(0.8), 1, 0.0));
    scene
}

fn renderer(gpu: &Gpu, accumulate: u32) -> Renderer {
    renderer_of(gpu, &Settings::direct_light(), accumulate)
}

fn renderer_of(gpu: &Gpu, settings: &Settings, accumulate: u32) -> Renderer {
    Renderer::with_engine(&testing::engine(gpu), settings.clone().with_accumulate(accumulate)).unwrap()
}

fn view(camera: &Camera) -> [(&Camera, [u32; 2]); 1] {
    [(camera, SIZE.into())]
}

fn frames(rendering: &RenderedImage) -> Option<u64> {
    let counters = &rendering.report.counters;
    counters.iter().find(|(name, _)| name == "progressive/frames").map(|(_, count)| *count)
}

fn bits(rendering: &RenderedImage) -> Vec<u32> {
    rendering.radiance.as_flattened().iter().map(|value| value.to_bits()).collect()
}

#[track_caller]
fn assert_same(a: &RenderedImage, b: &RenderedImage) {
    assert!(bits(a) == bits(b) && a.display == b.display);
}

/// Largest difference from the mean of some images, in units of the rounding error. Each frame rounds its difference, its increment and
/// their sum by half a unit in the last place (2⁻²⁴) of the largest value, and the division by twice that; the errors of early frames
/// shrink with their weight.
fn off_by(rendering: &RenderedImage, singles: &[RenderedImage]) -> f64 {
    let count = singles.len() as f64;
    let values = rendering.radiance.as_flattened().iter().enumerate();
    let off = values.map(|(i, value)| {
        let of = || singles.iter().map(|single| f64::from(single.radiance.as_flattened()[i]));
        let (mean, most) = (of().sum::<f64>() / count, of().fold(1e-30, f64::max));
        (f64::from(*value) - mean).abs() / (2.0 * count * most * 2f64.powi(-24))
    });
    off.fold(0.0, f64::max)
}

#[gpu_test]
fn gpu_the_mean_is_that_of_its_frames(gpu: &Gpu) {
    const COUNT: u32 = 9;
    let scene = cornell();
    let views = view(&scene.cameras[0]);
    let mut plain = renderer(gpu, 1);
    let uploaded = plain.upload(&scene).unwrap();
    let still = plain.views(&uploaded, &views).unwrap();
    let mut single = |index: u32| {
        let moved = [still[0].of_frame(index)];
        let results =
            plain.frame(&FrameContext { scene: &uploaded, views: &moved, is_averaged: false, requests: &[] }).unwrap();
        plain.renderings(&uploaded, &moved, &results).unwrap().remove(0)
    };
    let singles: Vec<RenderedImage> = (0..=COUNT).map(&mut single).collect();

    let mut averaging = renderer(gpu, COUNT);
    let mut told = Vec::new();
    let mut tell = |count| {
        told.push(count);
        ControlFlow::Continue(())
    };
    let mean = averaging.render_frames(&uploaded, &views, &mut tell).unwrap().remove(0);
    assert_eq!((told, frames(&mean)), ((1..=COUNT).collect(), Some(u64::from(COUNT))));
    let of_its_own = off_by(&mean, &singles[..COUNT as usize]);
    assert!(of_its_own < 1.0, "{of_its_own}");
    // Check that the test can fail: one frame fewer, one more, or another first frame.
    for others in [&singles[..8], &singles[..], &singles[1..]] {
        assert!(off_by(&mean, others) > 1e3);
    }

    let ended = averaging.render_frames(&uploaded, &views, |_| ControlFlow::Break(()));
    assert!(matches!(ended, Err(RenderError::Interrupted)), "{ended:?}");

    // Single frames give the same mean, are reproducible, and continue it.
    let mut refining = renderer(gpu, 1);
    for count in 1..=COUNT {
        let refined = refining.refine(&uploaded, &views).unwrap().remove(0);
        assert_eq!(frames(&refined), Some(u64::from(count)));
        match count {
            1 => assert_same(&refined, &singles[0]),
            COUNT => assert_same(&refined, &mean),
            _ => (),
        }
    }
    assert_same(&averaging.render_views(&uploaded, &views).unwrap()[0], &mean);
    let next = averaging.refine(&uploaded, &views).unwrap().remove(0);
    assert_same(&next, &refining.refine(&uploaded, &views).unwrap()[0]);
    assert_eq!(frames(&next), Some(10));

    // One frame equals the image without averaging.
    let one = renderer(gpu, 1).render_views(&uploaded, &views).unwrap().remove(0);
    assert_same(&one, &singles[0]);
    assert_eq!(frames(&one), None);
}

/// Every pass of a jittered frame matches a camera with a shifted window.
#[gpu_test]
fn gpu_a_jittered_frame_is_that_of_a_shifted_window(gpu: &Gpu) {
    let scene = cornell();
    let mut renderer = renderer(gpu, 1);
    let uploaded = renderer.upload(&scene).unwrap();
    let Projection::Perspective { fov_y, near } = scene.cameras[0].projection else { panic!("the demo's is") };
    let top = (0.5 * fov_y).tan();
    let pixel = 2.0 * top / SIZE.1 as f32;
    let right = 0.5 * pixel * SIZE.0 as f32;
    let mut window = |jitter: Vec2| {
        let (x, y) = (pixel * jitter.x, pixel * jitter.y);
        let projection =
            Projection::Frustum { left: -right - x, right: right - x, bottom: y - top, top: y + top, near };
        let camera = Camera { projection, ..scene.cameras[0].clone() };
        renderer.render_views(&uploaded, &view(&camera)).unwrap().remove(0)
    };
    let (moved, still) = (window(jitter_of_frame(5)), window(Vec2::ZERO));
    let views = [renderer.views(&uploaded, &view(&scene.cameras[0])).unwrap()[0].of_frame(5)];
    let results =
        renderer.frame(&FrameContext { scene: &uploaded, views: &views, is_averaged: false, requests: &[] }).unwrap();
    let frame = renderer.renderings(&uploaded, &views, &results).unwrap().remove(0);
    let different = |other: &RenderedImage| {
        let pairs = frame.radiance.iter().zip(&other.radiance);
        pairs.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > 0.01 * a.max(*b) + 1e-4)).count()
    };
    // Rounding may assign an edge pixel to another surface or shadow.
    let counts = (different(&moved), different(&still));
    assert!(counts.0 < 15 && counts.1 > 300, "of {} pixels: {counts:?}", frame.radiance.len());
}

#[gpu_test]
fn gpu_a_mean_starts_again_when_anything_changes(gpu: &Gpu) {
    let mut scene = cornell();
    let camera = scene.cameras[0].clone();
    let mut renderer = renderer(gpu, 1);
    let mut uploaded = renderer.upload(&scene).unwrap();
    let again = renderer.upload(&scene).unwrap();
    let other = Camera { projection: Projection::Perspective { fov_y: 0.5, near: 0.1 }, ..camera.clone() };
    let count = |renderer: &mut Renderer, scene: &GpuScene, views: &[(&Camera, [u32; 2])]| {
        let renderings = renderer.refine(scene, views).unwrap();
        let count = frames(&renderings[0]).unwrap();
        if count == 1 {
            // No state of the previous mean remains.
            assert_same(&renderings[0], &renderer.render_views(scene, views).unwrap()[0]);
        }
        count
    };
    let (here, there) = (view(&camera), view(&other));
    assert_eq!([(); 3].map(|()| count(&mut renderer, &uploaded, &here)), [1, 2, 3]);
    assert_eq!([(); 2].map(|()| count(&mut renderer, &uploaded, &there)), [1, 2]);
    assert_eq!(count(&mut renderer, &uploaded, &here), 1);
    assert_eq!(count(&mut renderer, &uploaded, &[(&camera, [44, 60])]), 1);
    assert_eq!(count(&mut renderer, &uploaded, &[here[0], there[0]]), 1);
    assert_eq!([(); 2].map(|()| count(&mut renderer, &uploaded, &here)), [1, 2]);
    assert_eq!([(); 2].map(|()| count(&mut renderer, &again, &here)), [1, 2]);
    assert_eq!([(); 2].map(|()| count(&mut renderer, &uploaded, &here)), [1, 2]);
    scene.lights[0].intensity *= 0.5;
    renderer.update(&mut uploaded, &scene).unwrap();
    assert_eq!([(); 2].map(|()| count(&mut renderer, &uploaded, &here)), [1, 2]);
    renderer.reset();
    assert_eq!([(); 2].map(|()| count(&mut renderer, &uploaded, &here)), [1, 2]);
    // A failed frame leaves no mean.
    let apart = renderer.refine(&uploaded, &[(&camera, [0, 1])]).unwrap_err().to_string();
    assert!(apart.contains("each side must be from 1"), "{apart}");
    assert_eq!(count(&mut renderer, &uploaded, &here), 3, "rejected before the mean was changed");
}

/// A rotated white square on black, without axis-aligned edges.
fn square() -> (Scene, Camera) {
    let white = Material { emissive: Vec3::ONE, double_sided: true, ..Material::default() };
    let rotation = Mat3::from_rotation_z(0.5 * FRAC_PI_6);
    let scene = scene_of(vec![quad(0, Vec3::ZERO, rotation * Vec3::X, rotation * Vec3::Y)], vec![white]);
    let projection = Projection::Orthographic { half_height: 2.0, near: 0.0, far: 20.0 };
    (scene, Camera::look_at(Vec3::new(0.0, 0.0, 10.0), Vec3::ZERO, projection))
}

/// Red of each pixel of a square image: the mean of the pixels of an image of `scale` times the resolution.
fn covered(fine: &RenderedImage, scale: u32) -> Vec<f32> {
    let edge = fine.width / scale;
    let pixel = |x: u32, y: u32| {
        let row = |j: u32| (scale * x..scale * (x + 1)).map(move |i| (scale * y + j) * fine.width + i);
        let pixels = (0..scale).flat_map(row);
        pixels.map(|i| fine.radiance[i as usize][0]).sum::<f32>() / (scale * scale) as f32
    };
    (0..edge * edge).map(|i| pixel(i % edge, i / edge)).collect()
}

#[gpu_test]
fn gpu_edges_converge_to_the_coverage_of_the_pixel(gpu: &Gpu) {
    const EDGE: u32 = 48;
    const FINE: u32 = 16;
    let (scene, camera) = square();
    let rendering = |accumulate, samples, scale: u32| {
        let settings = Settings::direct_light().with_accumulate(accumulate).with_samples(samples);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        renderer.render(&uploaded, &camera, [scale * EDGE, scale * EDGE]).unwrap()
    };
    let fine = rendering(1, Samples::One, FINE);
    let ground_truth = covered(&fine, FINE);
    let edges = ground_truth.iter().filter(|fraction| (0.01..0.99).contains(*fraction)).count();
    // Root mean square error over the pixels at edges.
    let error = |rendering: &RenderedImage| {
        let squares =
            rendering.radiance.iter().zip(&ground_truth).map(|(texel, fraction)| (texel[0] - fraction).powi(2));
        (squares.sum::<f32>() / edges as f32).sqrt()
    };
    let errors = [1, 4, 16, 64].map(|count| error(&rendering(count, Samples::One, 1)));
    println!("{edges} pixels at edges, errors of 1, 4, 16, 64 frames: {errors:?}");
    assert!(edges > 80);
    // A binary value instead of the coverage has an error of up to 0.5. Evenly spread samples have an error of about n^(-3/4).
    for (i, error) in errors.into_iter().enumerate() {
        let count = 4f32.powi(i as i32);
        assert!(error < 0.5 * count.powf(-0.7), "{count} frames: {error}");
    }
    assert!(errors[0] > 0.2, "a single frame has an error");

    // Each of four samples stands for a part of the pixel: they are better than one for few frames, and hardly smear edges.
    let of_four = [1, 4, 16].map(|count| error(&rendering(count, Samples::Four, 1)));
    println!("with four samples in each, of 1, 4, 16 frames: {of_four:?}");
    assert!(of_four[0] < 0.5 * errors[0] && of_four[1] < 0.5 * errors[1], "{of_four:?}");
    assert!(of_four.is_sorted_by(|fewer, more| more < fewer), "{of_four:?}");
}

/// An emissive plane with a fine checkerboard, seen at 75 degrees: its texels are four times as dense in one direction, and each pixel
/// covers a few of them.
fn checks() -> (Scene, Camera) {
    const TEXELS: u32 = 128;
    let shine = Material { emissive: Vec3::ONE, emissive_texture: Some(TextureRef::new(0)), ..Material::default() };
    let mut plane = quad(0, Vec3::ZERO, Vec3::X, Vec3::Y);
    plane.uv0 = plane.positions.iter().map(|position| 0.5 * position.truncate() + 0.5).collect();
    let mut scene = scene_of(vec![plane], vec![Material { double_sided: true, ..shine }]);
    let texel = |i: u32| [255 * (((i % TEXELS) / 3 + (i / TEXELS) / 3) & 1) as u8; 4];
    let rgba = (0..TEXELS * TEXELS).flat_map(texel).collect();
    scene.images = vec![Image { name: String::new(), width: TEXELS, height: TEXELS, rgba }];
    scene.samplers = vec![Sampler::default()];
    scene.textures = vec![Texture { image: 0, sampler: 0 }];
    let projection = Projection::Orthographic { half_height: 0.7, near: 0.0, far: 20.0 };
    let aside = 10.0 * Vec3::new(0.0, 75f32.to_radians().sin(), 75f32.to_radians().cos());
    (scene, Camera::look_at(aside, Vec3::ZERO, projection))
}

/// Textures of a mean are not blurred over the pixel twice. The errors of means of 1, 4, 16 and 64 frames are 0.043, 0.027, 0.025 and
/// 0.0094 on Mesa's software adapter. With a mip level per frame and anisotropic filters of a pixel's length, the error after 64 frames was
/// 0.036, the same as after 16.
#[gpu_test]
fn gpu_textures_converge_to_what_the_pixel_covers(gpu: &Gpu) {
    const EDGE: u32 = 48;
    const FINE: u32 = 16;
    let (scene, camera) = checks();
    let rendering = |accumulate, scale: u32| {
        let mut renderer = renderer(gpu, accumulate);
        let uploaded = renderer.upload(&scene).unwrap();
        renderer.render(&uploaded, &camera, [scale * EDGE, scale * EDGE]).unwrap()
    };
    let ground_truth = covered(&rendering(1, FINE), FINE);
    let mean = ground_truth.iter().sum::<f32>() / ground_truth.len() as f32;
    let off = |value: &dyn Fn(usize) -> f32| {
        (ground_truth.iter().enumerate().map(|(i, fraction)| (value(i) - fraction).powi(2)).sum::<f32>()
            / ground_truth.len() as f32)
            .sqrt()
    };
    let errors = [1, 4, 16, 64].map(|count| {
        let rendering = rendering(count, 1);
        off(&|i| rendering.radiance[i][0])
    });
    println!("deviation {}, errors of 1, 4, 16, 64 frames: {errors:?}", off(&|_| mean));
    // 1.5 times the measured error.
    assert!(errors[3] < 0.011 && errors[3] < 0.5 * errors[2], "{errors:?}");
}

#[gpu_test]
fn gpu_views_and_samples_are_averaged_separately(gpu: &Gpu) {
    let scene = cornell();
    let eyes = StereoRig::parallel(&scene.cameras[0], 1.0, 0.1).unwrap().cameras(&scene.cameras[0], 0.05);
    for samples in [Samples::One, Samples::Four] {
        let settings = Settings::direct_light().with_accumulate(3).with_samples(samples);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let views = [(&eyes[0], SIZE.into()), (&eyes[1], [SIZE.1, SIZE.0])];
        let both = renderer.render_views(&uploaded, &views).unwrap();
        for (together, view) in both.iter().zip(views) {
            let alone = renderer.render_views(&uploaded, &[view]).unwrap().remove(0);
            let pairs = || together.radiance.as_flattened().iter().zip(alone.radiance.as_flattened());
            let apart = pairs().map(|(a, b)| (a - b).abs() / a.max(*b).max(1e-3)).fold(0.0, f32::max);
            let differing = pairs().filter(|(a, b)| a != b).count();
            println!("{samples}: {differing} values differ, by at most {apart}");
            // Views of a frame share the clusters of lights: faint light at the end of a light's range may be in one list and not in another.
            assert!(apart < 1e-3 && differing < pairs().count() / 100, "{samples}: {differing}, {apart}");
        }
        assert_eq!(
            both.iter().map(frames).collect::<Vec<_>>(),
            [Some(3), None],
            "shared counters are in the first report"
        );
    }
}

#[gpu_test]
fn gpu_settings_without_a_mean_are_rejected(gpu: &Gpu) {
    let refused = |accumulate, debug_view| {
        let settings = Settings::direct_light().with_accumulate(accumulate).with_debug_view(debug_view);
        Renderer::with_engine(&testing::engine(gpu), settings).map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(refused(0, None).unwrap_err(), "`accumulate 0`: an image is the mean of 1 frame or more");
    assert_eq!(refused(2, Some(DebugView::Depth)).unwrap_err(), "`debug-view` needs `accumulate 1`");
    assert_eq!((refused(1, Some(DebugView::Depth)), refused(2, Some(DebugView::BaseColor))), (Ok(()), Ok(())));
    let settings = Settings::direct_light().with_debug_view(Some(DebugView::Depth));
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let scene = cornell();
    let uploaded = renderer.upload(&scene).unwrap();
    let error = renderer.refine(&uploaded, &view(&scene.cameras[0])).unwrap_err();
    assert!(error.to_string().contains("`debug-view`"), "{error}");
}
