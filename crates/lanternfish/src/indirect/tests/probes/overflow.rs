//! The list of further probes at its capacity, and the same bytes in every run.

use lanternfish_gpu::Growth;

use crate::{Target, ViewRequest, indirect::sampled::probes::FIRST_FURTHER_IN_TESTS};

use super::*;

const VIEW: ([f32; 3], [f32; 3]) = ([0.0, 0.0, 0.98], [0.1, 0.1, -1.0]);

/// Images of two frames, of a renderer of its own, with this first capacity.
fn frames(gpu: &Gpu, scene: &Scene, history: History, first: Option<u64>) -> Vec<Vec<[f32; 4]>> {
    FIRST_FURTHER_IN_TESTS.set(first);
    let mut renderer = walks::renderer(gpu, with(probes_of(4, 8), history));
    let uploaded = renderer.upload(scene).unwrap();
    let camera = looking(VIEW.0, VIEW.1);
    let images = (0..2).map(|_| renderer.render(&uploaded, &camera, SIZE.into()).unwrap().radiance).collect();
    FIRST_FURTHER_IN_TESTS.set(None);
    images
}

/// Each image is the same in every run, and whatever the first capacity: with blocking readback the list grows within the frame.
#[gpu_test]
fn gpu_images_of_probes_are_reproducible_whatever_the_capacity(gpu: &Gpu) {
    let scene = clutter(150, 0.06);
    let is_full = testing::is_full();
    for history in if is_full { vec![History::Off, History::On] } else { vec![History::On] } {
        let expected = frames(gpu, &scene, history, Some(4096));
        assert!(expected[0].iter().any(|pixel| pixel[1] > 0.0), "nothing is lit");
        assert_eq!(expected[0] != expected[1], history == History::On, "{history:?}: later frames");
        for first in if is_full { vec![Some(4096), Some(0), Some(1)] } else { vec![Some(0)] } {
            let actual = frames(gpu, &scene, history, first);
            for (i, (actual, expected)) in actual.iter().zip(&expected).enumerate() {
                let apart = actual.iter().zip(expected).filter(|(a, b)| a != b).count();
                assert_eq!(apart, 0, "{history:?}, frame {i}, first capacity {first:?}");
            }
        }
    }
}

/// With deferred readback a frame whose further probes exceed the capacity is held; a later one is complete, and has the image of blocking readback.
#[gpu_test(full)]
fn gpu_frames_with_too_many_further_probes_are_held(gpu: &Gpu) {
    // More than 4,096 further probes, the least capacity with deferred readback.
    let (size, camera) = ([400, 260], looking(VIEW.0, VIEW.1));
    let scene = clutter(8000, 0.01);
    let rays = probes_of(4, 4);
    let (engine, settings) = (testing::engine(gpu), with(rays, History::Off));
    let mut waiting = Renderer::with_engine(&engine, settings.clone()).unwrap();
    let uploaded = waiting.upload(&scene).unwrap();
    let expected = waiting.render(&uploaded, &camera, size).unwrap();
    let shown = |first| {
        FIRST_FURTHER_IN_TESTS.set(first);
        let mut renderer = Renderer::with_engine(&engine, settings.clone()).unwrap();
        renderer.set_growth(Growth::Deferred).unwrap();
        let views = [ViewRequest::of_camera(0, &camera, size, Target::Own)];
        let mut frames = Vec::new();
        for _ in 0..3 {
            let mut commands = gpu.device.create_command_encoder(&Default::default());
            let frame = renderer.record(&mut commands, &uploaded, &views).unwrap();
            gpu.queue.submit([commands.finish()]);
            let frame = renderer.submitted(frame);
            gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
            let report = std::iter::from_fn(|| renderer.poll()).find(|report| report.frame == frame).unwrap();
            frames.push((report.is_complete, renderer.read(frame).unwrap().remove(0)));
        }
        FIRST_FURTHER_IN_TESTS.set(None);
        frames
    };
    // Only the list of probes overflows: with a large capacity the first frame is complete.
    let enough = shown(Some(1 << 20));
    assert!(enough.iter().all(|(is_complete, _)| *is_complete), "with a large capacity");
    // With blocking readback alone, an image's first frame explores: the same light with other noise.
    let (first, expected) = (pixels(&enough[0].1), pixels(&expected));
    assert!(off(&first, &expected) < 0.1 && (mean(&first) / mean(&expected) - 1.0).abs() < 0.01);
    let grown = shown(Some(0));
    println!("complete: {:?}", grown.iter().map(|(is_complete, _)| is_complete).collect::<Vec<_>>());
    assert!(!grown[0].0 && grown[0].1.display.iter().all(|texel| texel[..3] == [0; 3]), "the first frame is shown");
    assert!(grown[2].0, "a later frame is incomplete");
    // Deferred frames continue the radiance cache: the same light with other noise.
    let [grown, enough] = [&grown[2].1, &enough[2].1].map(pixels);
    println!("off by {:.4}, energy {:.4}", off(&grown, &enough), mean(&grown) / mean(&enough));
    assert!(off(&grown, &enough) < 0.1 && (mean(&grown) / mean(&enough) - 1.0).abs() < 0.01);
}
