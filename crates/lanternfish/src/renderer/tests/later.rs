//! Frames that never wait show what frames that wait show, or what they showed last.

use glam::{Affine3A, Vec3};
use lanternfish_gpu::{Gpu, Growth, faulty_software, testing};
use lanternfish_scene::{
    Camera, Light, Material, Projection, Scene,
    generate::{demo, light_rain},
};

use crate::{
    GpuScene, Picture, RenderError, Renderer, Settings,
    context::FrameContext,
    indirect::virtual_lights::{MapSize, VirtualLights},
    settings::{Culling, Exposure, Indirect, Occlusion, Shadows},
    techniques::{ACROSS_TEXELS, Deep, DeepBuilder, DeepImageSettings, DeepStore, DirectionSet, Sampled, WITHIN_TEXEL},
    testing::{quad, scene_of},
};

/// Frames that the device has in hand at most, as with a window.
const IN_FLIGHT: usize = 3;

/// What a frame has left, on its way to the host.
struct Sent {
    display: wgpu::Buffer,
    ledger: wgpu::Buffer,
    submission: wgpu::SubmissionIndex,
}

/// What one frame showed.
struct Shown {
    display: Vec<[u8; 4]>,
    is_whole: bool,
}

/// A path through a scene: for every frame the camera and the number of lights.
struct Path<'p> {
    scene: Scene,
    /// Metres that lights reach.
    range: f32,
    size: [u32; 2],
    step: &'p dyn Fn(usize) -> (Camera, u32),
    frames: usize,
}

/// What became of a path.
#[derive(Debug, Default)]
struct Outcome {
    /// Frames that were not shown.
    held: usize,
    /// The most of them in a row.
    most_in_a_row: usize,
    /// Those that were held although they have as many lights as each of the four before.
    held_in_steady_state: usize,
    /// Frames that were held and would have shown another picture than the last one that was whole.
    hidden: usize,
    /// Waits inside frames.
    waits: u64,
    /// The largest share of pixels that a frame lights.
    most_lit: f32,
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
    let words = renderer.pool.lock().unwrap().whole().expect("frames do not wait");
    encoder.copy_buffer_to_buffer(&words, 0, &sent.1, 0, 16);
    let submission = queue.submit([encoder.finish()]);
    Sent { display: sent.0, ledger: sent.1, submission }
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
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&mapped(device, &sent.ledger));
    Shown { display: display.collect(), is_whole: words[1] == 1 }
}

/// Walks the path with frames that do not wait and with frames that do. Every frame must show what the one that waits shows, or what
/// was shown last.
fn walk(gpu: &Gpu, settings: &Settings, path: &Path<'_>) -> Outcome {
    let renderer = || Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
    let (mut later, mut waiting) = (renderer(), renderer());
    later.set_growth(Growth::Later).unwrap();
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
        let views = later.views(&uploaded, &[(&camera, width, height)]).unwrap();
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
        expected.push(waiting.render(&uploaded, &camera, width, height).unwrap().display);
    }

    let mut last = vec![[0; 4]; (width * height) as usize];
    let mut outcome = Outcome::default();
    let mut in_a_row = 0;
    for (i, (sent, expected)) in sent.iter().zip(expected).enumerate() {
        let Shown { display, is_whole } = shown(&gpu.device, sent, path.size);
        let is_steady = i >= 4 && counts[i - 4..=i].iter().all(|count| *count == counts[i]);
        let lit = expected.iter().filter(|texel| texel[..3].iter().any(|part| *part > 8)).count();
        outcome.most_lit = outcome.most_lit.max(lit as f32 / expected.len() as f32);
        if is_whole {
            last = expected;
            in_a_row = 0;
        } else {
            outcome.held += 1;
            outcome.hidden += usize::from(last != expected);
            outcome.held_in_steady_state += usize::from(is_steady);
            in_a_row += 1;
        }
        outcome.most_in_a_row = outcome.most_in_a_row.max(in_a_row);
        let wrong = display.iter().zip(&last).filter(|(found, expected)| found != expected).count();
        assert_eq!(wrong, 0, "frame {i}, {} lights, whole: {is_whole}", counts[i]);
    }
    outcome.waits = later.pool.get_mut().unwrap().waits();
    assert!(waiting.pool.get_mut().unwrap().waits() >= path.frames as u64, "blind: frames that wait are not counted");
    outcome
}

fn check(outcome: &Outcome) {
    assert_eq!((outcome.waits, outcome.held_in_steady_state), (0, 0), "{outcome:?}");
    assert!(outcome.most_in_a_row <= IN_FLIGHT, "{outcome:?}");
    // Blind where nothing is held, where what is held looks like what is shown, or where all is dark.
    assert!(outcome.hidden > 0 && outcome.most_lit > 0.25, "{outcome:?}");
}

fn settings(culling: Culling) -> Settings {
    Settings { shadows: Shadows::BVH, culling, ..Settings::direct_light() }
}

#[test]
fn gpu_frames_that_do_not_wait_show_whole_pictures_alone() {
    let Some(gpu) = testing::gpu("gpu_frames_that_do_not_wait_show_whole_pictures_alone") else { return };
    let scene = demo("atrium").unwrap();
    let camera = scene.cameras[0].clone();
    let step = |i: usize| {
        let towards = Affine3A::from_translation(0.02 * i as f32 * Vec3::NEG_Z);
        let camera = Camera { world_from_camera: camera.world_from_camera * towards, ..camera.clone() };
        (camera, [10, 3000, 10, 6000][i / 6 % 4])
    };
    let path = Path { scene: scene.clone(), range: 3.0, size: [32, 24], step: &step, frames: 24 };
    for culling in Culling::all() {
        let name = culling.name();
        let outcome = walk(gpu, &settings(culling), &path);
        println!("{name}: {outcome:?}");
        check(&outcome);
    }
}

#[test]
fn gpu_a_mean_is_of_whole_frames_alone() {
    let Some(gpu) = testing::gpu("gpu_a_mean_is_of_whole_frames_alone") else { return };
    let mut scene = demo("cornell").unwrap();
    scene.lights.extend(light_rain(&scene.bounds(), 3000, Some(2.0), 1, 0.0));
    let mean_after = |growth: Growth, frames: u32| {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings(Culling::default())).unwrap();
        renderer.set_growth(growth).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let refine = |renderer: &mut Renderer| {
            let picture: Picture = renderer.refine(&uploaded, &[(&scene.cameras[0], 24, 16)]).unwrap().remove(0);
            picture.radiance
        };
        let mut last = Vec::new();
        // `refine` reads the picture, and so waits between frames: room that is lacking is there for the next.
        let lacking = if growth == Growth::Later { 1 } else { 0 };
        for i in 0..frames + lacking {
            last = refine(&mut renderer);
            if i == 0 && growth == Growth::Later {
                assert!(last.iter().all(|texel| texel[..3] == [0.0; 3]), "the first frame had room");
                // The same frames again, with the room that is there now.
                renderer.reset();
            }
        }
        let pool = renderer.pool.get_mut().unwrap();
        (last, pool.waits(), pool.arrived().held)
    };
    let (expected, waits, _) = mean_after(Growth::Wait, 4);
    let (found, none, held) = mean_after(Growth::Later, 4);
    assert_eq!((none, held), (0, 1));
    assert!(waits >= 8 && found == expected, "not the mean of the same frames");
    // It can fail: a frame more is another mean.
    assert!(found != mean_after(Growth::Later, 5).0);
}

/// Panes behind each other: more fragments a texel than there is room for at first.
fn panes() -> Scene {
    let pane = |i: usize| quad(0, Vec3::new(0.0, 0.0, -0.02 * i as f32), Vec3::X, Vec3::Y);
    let mut scene = scene_of((0..90).map(pane).collect(), vec![Material { double_sided: true, ..Material::default() }]);
    scene.lights.push(Light::point(Vec3::new(0.3, 0.4, 2.0), Vec3::splat(9.0)));
    scene.sky = Vec3::splat(0.4);
    scene
}

/// Through deep images too: for shadows, for indirect light, to find occlusion, and for ranges of virtual lights, whose lists grow as well.
#[test]
fn gpu_deep_images_get_their_room_in_later_frames() {
    let test = "gpu_deep_images_get_their_room_in_later_frames";
    let Some(gpu) = testing::gpu(test) else { return };
    if faulty_software(&gpu.device.adapter_info()) {
        return testing::left_out(test, "this driver crashes on shadows through deep images");
    }
    let scene = panes();
    let camera =
        Camera::look_at(Vec3::new(0.4, 0.2, 2.5), Vec3::ZERO, Projection::Perspective { fov_y: 0.9, near: 0.02 });
    let step = |i: usize| (camera.clone(), [0, 300][i / 6 % 2]);
    let path = Path { scene: scene.clone(), range: 3.0, size: [48, 32], step: &step, frames: 18 };
    let deep_images =
        DeepImageSettings { resolution: 96, directions: DirectionSet::Cube { k: 3 }, ..DeepImageSettings::default() };
    let direct =
        Settings { structure: deep_images.into(), exposure: Exposure::Ev(0.0), ..settings(Culling::default()) };
    let sampled =
        Sampled { tracer: WITHIN_TEXEL.into(), diffuse_rays: 1, glossy_rays: 0, ..Sampled::default().one_bounce() };
    let few = VirtualLights { count: 300, map: MapSize::Texels64, ..VirtualLights::default() };
    for (name, settings) in [
        ("shadows", Settings { shadows: Shadows::Traced(ACROSS_TEXELS), ..direct.clone() }),
        ("indirect", Settings { indirect: Indirect::from(sampled), ..direct.clone() }),
        ("occlusion", Settings { occlusion: Occlusion::from(Deep { max_distance: None }), ..direct.clone() }),
        ("virtual lights", Settings { indirect: Indirect::from(few), ..direct.clone() }),
    ] {
        let outcome = walk(gpu, &settings, &path);
        println!("{name}: {outcome:?}");
        check(&outcome);
    }
}

#[test]
fn gpu_deep_images_that_only_waiting_frames_can_build_are_refused_where_frames_do_not_wait() {
    let test = "gpu_deep_images_that_only_waiting_frames_can_build_are_refused_where_frames_do_not_wait";
    let Some(gpu) = testing::gpu(test) else { return };
    let coarse = DeepImageSettings { resolution: 8, ..DeepImageSettings::default() };
    for deep_images in [
        DeepImageSettings { builder: DeepBuilder::SinglePass, ..coarse },
        DeepImageSettings { builder: DeepBuilder::DepthPeeling, ..coarse },
        DeepImageSettings { store: DeepStore::LinkedList, ..coarse },
    ] {
        let settings = Settings {
            occlusion: Occlusion::from(Deep { max_distance: None }),
            structure: deep_images.into(),
            ..settings(Culling::default())
        };
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        assert!(matches!(renderer.set_growth(Growth::Later), Err(RenderError::Together { .. })));
        renderer.set_growth(Growth::Wait).unwrap();
    }
}

/// Ten lights become a hundred thousand and ten again, while the camera goes through Sponza.
#[test]
#[ignore = "takes minutes on a software adapter"]
fn gpu_a_path_through_sponza_never_waits() {
    let test = "gpu_a_path_through_sponza_never_waits";
    let Some(gpu) = testing::gpu(test) else { return };
    let Some(file) = testing::shared(test, "assets/sponza/Sponza.glb") else { return };
    let scene = lanternfish_scene::load(&file).unwrap();
    let camera = scene.default_camera(64.0 / 36.0);
    const FRAMES: usize = 300;
    let step = |i: usize| {
        let way = i as f32 / FRAMES as f32;
        let turn = Affine3A::from_rotation_y(0.5 * (std::f32::consts::TAU * way).sin());
        let towards = Affine3A::from_translation(way * 3.0 * Vec3::NEG_Z);
        let camera = Camera { world_from_camera: camera.world_from_camera * turn * towards, ..camera.clone() };
        // Ten times as many every twenty-five frames, and then a tenth.
        let decade = [1, 1, 2, 3, 4, 5, 5, 4, 3, 2, 1, 1][i / 25];
        (camera, 10u32.pow(decade))
    };
    let path = Path { scene: scene.clone(), range: 1.0, size: [64, 36], step: &step, frames: FRAMES };
    let outcome = walk(gpu, &settings(Culling::default()), &path);
    println!("{outcome:?}");
    check(&outcome);
}
