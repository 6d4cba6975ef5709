//! Checks that frames with deferred readback show the images of frames with blocking readback, or the last complete image.

use lanternfish_gpu::{Gpu, Growth, testing};
use lanternfish_scene::{Camera, Scene, generate::light_rain};

use crate::{
    GpuScene, Renderer, Settings,
    context::FrameContext,
    settings::{Culling, Shadows},
};

/// Maximum number of frames in flight, as with a window.
const IN_FLIGHT: usize = 3;

/// The results of a frame in transfer to the host.
struct Sent {
    display: wgpu::Buffer,
    capacity_policy: wgpu::Buffer,
    submission: wgpu::SubmissionIndex,
}

/// The image of one frame.
struct Shown {
    display: Vec<[u8; 4]>,
    is_complete: bool,
}

/// A path through a scene: the camera and the number of lights for every frame.
#[allow(missing_debug_implementations)]
pub struct Path<'p> {
    /// The scene.
    pub scene: Scene,
    /// Range of the lights, m.
    pub range: f32,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// The camera, and the number of added lights.
    pub step: &'p dyn Fn(usize) -> (Camera, u32),
    /// Number of frames.
    pub frames: usize,
}

/// The outcome of a path.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Number of frames that were not shown.
    pub held: usize,
    /// Longest run of such frames.
    pub most_in_a_row: usize,
    /// Number of such frames with as many lights as each of the four frames before.
    pub held_in_steady_state: usize,
    /// Number of such frames whose image differs from the last complete one.
    pub hidden: usize,
    /// Number of waits within frames.
    pub waits: u64,
    /// Largest fraction of pixels that a frame lights.
    pub most_lit: f32,
}

fn copy_of(renderer: &Renderer, display: &wgpu::TextureView) -> Sent {
    let (device, queue) = (&renderer.device, &renderer.queue);
    let size = display.texture().size();
    let row = (4 * size.width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = |size| {
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    };
    let sent = (buffer(u64::from(row * size.height)), buffer(16));
    let mut encoder = device.create_command_encoder(&Default::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &sent.0, layout };
    encoder.copy_texture_to_buffer(display.texture().as_image_copy(), to, size);
    let words = renderer.pool.lock().unwrap().completeness_buffer().expect("frames use deferred readback");
    encoder.copy_buffer_to_buffer(&words, 0, &sent.1, 0, 16);
    let submission = queue.submit([encoder.finish()]);
    Sent { display: sent.0, capacity_policy: sent.1, submission }
}

fn mapped(device: &wgpu::Device, buffer: &wgpu::Buffer) -> Vec<u8> {
    buffer.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    buffer.get_mapped_range(..).unwrap().to_vec()
}

fn shown(device: &wgpu::Device, sent: &Sent, [width, height]: [u32; 2]) -> Shown {
    let bytes = mapped(device, &sent.display);
    let row = bytes.len() / height as usize;
    let display = bytes.chunks_exact(row).flat_map(|row| bytemuck::pod_collect_to_vec(&row[..4 * width as usize]));
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&mapped(device, &sent.capacity_policy));
    Shown { display: display.collect(), is_complete: words[1] == 1 }
}

/// Follows the path with deferred and with blocking readback. Every deferred frame must show the image of the blocking one, or the last
/// shown image.
pub fn walk(gpu: &Gpu, settings: &Settings, path: &Path<'_>) -> Outcome {
    let renderer = || Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
    let (mut later, mut waiting) = (renderer(), renderer());
    later.set_growth(Growth::Deferred).unwrap();
    let mut scene = path.scene.clone();
    let own_lights = scene.lights.clone();
    let mut uploaded: GpuScene = later.upload(&scene).unwrap();
    let (mut sent, mut expected): (Vec<Sent>, Vec<Vec<[u8; 4]>>) = Default::default();
    let mut counts = Vec::new();
    let [width, height] = path.size;
    for i in 0..path.frames {
        let (camera, lights) = (path.step)(i);
        if counts.last() != Some(&lights) {
            scene.lights.clone_from(&own_lights);
            scene.lights.extend(light_rain(&scene.bounds(), lights, Some(path.range), 1, 0.0));
            later.update(&mut uploaded, &scene).unwrap();
        }
        counts.push(lights);
        let views = later.views(&uploaded, &[(&camera, [width, height])]).unwrap();
        let context = FrameContext { scene: &uploaded, views: &views, is_averaged: false, requests: &[] };
        let result = later.frame(&context).unwrap().remove(0);
        sent.push(copy_of(&later, &result.display.expect("it is shown")));
        if i + 1 >= IN_FLIGHT {
            let submission_index = Some(sent[i + 1 - IN_FLIGHT].submission.clone());
            gpu.device.poll(wgpu::PollType::Wait { submission_index, timeout: None }).unwrap();
        }
    }
    for (i, count) in counts.iter().enumerate() {
        let (camera, lights) = (path.step)(i);
        if i == 0 || counts[i - 1] != *count {
            scene.lights.clone_from(&own_lights);
            scene.lights.extend(light_rain(&scene.bounds(), lights, Some(path.range), 1, 0.0));
            waiting.update(&mut uploaded, &scene).unwrap();
        }
        expected.push(waiting.render(&uploaded, &camera, [width, height]).unwrap().display);
    }

    let mut last = vec![[0; 4]; (width * height) as usize];
    let mut outcome = Outcome::default();
    let mut in_a_row = 0;
    for (i, (sent, expected)) in sent.iter().zip(expected).enumerate() {
        let Shown { display, is_complete } = shown(&gpu.device, sent, path.size);
        let is_constant = i >= 4 && counts[i - 4..=i].iter().all(|count| *count == counts[i]);
        let lit = expected.iter().filter(|texel| texel[..3].iter().any(|part| *part > 8)).count();
        outcome.most_lit = outcome.most_lit.max(lit as f32 / expected.len() as f32);
        if is_complete {
            last = expected;
            in_a_row = 0;
        } else {
            outcome.held += 1;
            outcome.hidden += usize::from(last != expected);
            outcome.held_in_steady_state += usize::from(is_constant);
            in_a_row += 1;
        }
        outcome.most_in_a_row = outcome.most_in_a_row.max(in_a_row);
        let wrong = display.iter().zip(&last).filter(|(actual, expected)| actual != expected).count();
        assert_eq!(wrong, 0, "frame {i}, {} lights, complete: {is_complete}", counts[i]);
    }
    outcome.waits = later.pool.get_mut().unwrap().waits();
    assert!(waiting.pool.get_mut().unwrap().waits() >= path.frames as u64, "blocking frames are not counted");
    outcome
}

/// Panics if a frame waited or was not shown without need, and if the path does not test this.
pub fn check(outcome: &Outcome) {
    assert_eq!((outcome.waits, outcome.held_in_steady_state), (0, 0), "{outcome:?}");
    assert!(outcome.most_in_a_row <= IN_FLIGHT, "{outcome:?}");
    // The test is only effective if some hidden frames differ from the shown image, and if the scene is lit.
    assert!(outcome.hidden > 0 && outcome.most_lit > 0.25, "{outcome:?}");
}

/// Direct light.
pub fn settings(culling: Culling) -> Settings {
    Settings::direct_light().with_shadows(Shadows::BVH).with_culling(culling)
}
