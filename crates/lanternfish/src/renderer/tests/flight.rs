//! Frames in the caller's commands: they equal rendered images, and no call waits for the device.

mod answers;
mod slices;

use glam::{Affine3A, Vec3, Vec4};
use half::f16;
use lanternfish_gpu::{AdapterChoice, Gpu, GpuError, Made, checked, made, read_texture, storage_buffer, testing};
use lanternfish_scene::{
    Camera, Light, Material, Projection, Scene,
    generate::{demo, light_rain},
};

use crate::{
    FrameId, FrameReport, GpuScene, RenderError, Renderer, Settings, SurfaceSource, Target, ViewRequest,
    settings::{DebugView, Exposure, Materials, Samples, Shadows, ToneMap},
    techniques::{Sampled, Tiled},
};

const SIZE: [u32; 2] = [48, 32];

fn bvh(settings: Settings) -> Settings {
    settings.with_shadows(Shadows::BVH)
}

/// Indirect light without state between frames, unlike the radiance cache: each frame is independent.
fn one_bounce() -> Settings {
    bvh(Settings::default().with_indirect(Sampled::default().one_bounce()))
}

fn lit() -> Scene {
    let mut scene = demo("cornell").unwrap();
    scene.lights.extend(light_rain(&scene.bounds(), 3000, Some(0.4), 1, 0.0));
    scene
}

/// A moving camera.
fn camera(scene: &Scene, step: usize) -> Camera {
    let camera = &scene.cameras[0];
    let moved = Affine3A::from_translation(0.03 * step as f32 * Vec3::new(1.0, 0.5, -1.0));
    Camera { world_from_camera: camera.world_from_camera * moved, ..camera.clone() }
}

/// A texture of the caller.
fn texture(gpu: &Gpu, format: wgpu::TextureFormat, size: [u32; 2]) -> wgpu::TextureView {
    let [width, height] = size;
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("the caller's"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// Records a frame in its own command encoder and submits it.
fn frame(
    gpu: &Gpu,
    renderer: &mut Renderer,
    scene: &GpuScene,
    views: &[ViewRequest<'_>],
) -> Result<FrameId, RenderError> {
    let mut commands = gpu.device.create_command_encoder(&Default::default());
    let frame = renderer.record(&mut commands, scene, views)?;
    gpu.queue.submit([commands.finish()]);
    let frame = renderer.submitted(frame);
    Ok(frame)
}

/// Waits for a frame, as a test may and a window must not.
fn report(gpu: &Gpu, renderer: &mut Renderer, frame: FrameId) -> FrameReport {
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    std::iter::from_fn(|| renderer.poll()).find(|report| report.frame == frame).expect("the device is done with it")
}

fn halves(gpu: &Gpu, view: &wgpu::TextureView) -> Vec<[f32; 4]> {
    let texels: Vec<[u16; 4]> = read_texture(&gpu.device, &gpu.queue, view.texture()).unwrap();
    texels.into_iter().map(|texel| texel.map(|bits| f16::from_bits(bits).to_f32())).collect()
}

fn bytes(gpu: &Gpu, view: &wgpu::TextureView) -> Vec<[u8; 4]> {
    read_texture(&gpu.device, &gpu.queue, view.texture()).unwrap()
}

#[gpu_test]
fn gpu_a_frame_in_the_callers_commands_is_the_image_to_the_bit(gpu: &Gpu) {
    use wgpu::TextureFormat::{Bgra8Unorm, Rgba8Unorm, Rgba8UnormSrgb, Rgba16Float, Rgba32Float};
    let scene = lit();
    let plain = bvh(Settings::direct_light());
    let cases = [
        ("indirect light", one_bounce()),
        ("direct light", plain.clone()),
        ("four samples", plain.clone().with_samples(Samples::Four).with_tone_map(ToneMap::Aces)),
        ("normals", plain.with_debug_view(Some(DebugView::Normal)).with_exposure(Exposure::Ev(0.0))),
    ];
    for (name, settings) in cases.into_iter().take(if testing::is_full() { 4 } else { 1 }) {
        let mut waiting = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
        let uploaded = waiting.upload(&scene).unwrap();
        let mut renderer = Renderer::with_engine(waiting.engine(), waiting.settings().clone()).unwrap();
        let formats = [Rgba8Unorm, Rgba8UnormSrgb, Bgra8Unorm, Rgba16Float];
        let shown = formats.map(|format| texture(gpu, format, SIZE));
        let radiance = [Rgba16Float, Rgba32Float].map(|format| texture(gpu, format, SIZE));
        // One view per target, because automatic exposure is shared by all views of a frame.
        let targets = || {
            let shown = formats.iter().zip(&shown).map(|(format, view)| Target::Display(view, *format));
            shown.chain(radiance.iter().map(Target::Radiance)).chain([Target::Own])
        };
        for step in 0..2 {
            let camera = camera(&scene, step);
            let expected = waiting.render(&uploaded, &camera, SIZE).unwrap();
            for (key, target) in targets().enumerate() {
                let request = [ViewRequest::of_camera(key as u64, &camera, SIZE, target)];
                renderer.ready(&uploaded, &request).unwrap();
                let id = frame(gpu, &mut renderer, &uploaded, &request).unwrap();
                let report = report(gpu, &mut renderer, id);
                assert!(report.is_complete && !report.is_lost, "{name}: {report:?}");
                if key == formats.len() + radiance.len() {
                    let read = renderer.read(id).unwrap().remove(0);
                    assert!(read.radiance == expected.radiance && read.display == expected.display, "{name}");
                    assert_eq!(read.exposure, expected.exposure);
                }
            }
            assert!(bytes(gpu, &shown[0]) == expected.display, "{name}: another display");
            assert!(bytes(gpu, &shown[1]) == expected.display, "{name}: encoded otherwise by the device");
            let swapped: Vec<_> = bytes(gpu, &shown[2]).iter().map(|[b, g, r, a]| [*r, *g, *b, *a]).collect();
            assert!(swapped == expected.display, "{name}: another order");
            let fine = halves(gpu, &shown[3]);
            let off = fine.iter().flatten().zip(expected.display.iter().flatten());
            // Half floats from 1/2 to 1 are 2^-11 apart.
            let off = off.map(|(fine, byte)| (fine - f32::from(*byte) / 255.0).abs()).fold(0.0, f32::max);
            assert!(off <= 1.0 / 2048.0, "{name}: off by {off}");
            assert!(halves(gpu, &radiance[0]) == expected.radiance, "{name}: another radiance");
            let wide: Vec<[f32; 4]> = read_texture(&gpu.device, &gpu.queue, radiance[1].texture()).unwrap();
            assert!(wide == expected.radiance, "{name}: another radiance");
            assert!(expected.radiance.iter().any(|texel| texel[1] > 0.0));
        }
        // Check that the test can fail: another camera gives another image.
        let other = waiting.render(&uploaded, &camera(&scene, 7), SIZE).unwrap();
        assert!(bytes(gpu, &shown[0]) != other.display);
        assert_eq!(renderer.engine().compilations(), waiting.engine().compilations());
    }
}

#[gpu_test]
fn gpu_two_views_of_a_frame_show_what_they_show_in_an_image(gpu: &Gpu) {
    let scene = lit();
    let mut waiting = Renderer::new(&gpu.device, &gpu.queue, bvh(Settings::direct_light())).unwrap();
    let uploaded = waiting.upload(&scene).unwrap();
    let cameras = [camera(&scene, 0), camera(&scene, 3)];
    let views = [(&cameras[0], [48, 32]), (&cameras[1], [20, 30])];
    let expected = waiting.render_views(&uploaded, &views).unwrap();
    let textures = views.map(|(_, size)| texture(gpu, wgpu::TextureFormat::Rgba8Unorm, size));
    let requests = [0, 1].map(|i| {
        let (camera, [width, height]) = views[i];
        let target = Target::Display(&textures[i], wgpu::TextureFormat::Rgba8Unorm);
        ViewRequest::of_camera(i as u64, camera, [width, height], target)
    });
    let mut renderer = Renderer::with_engine(waiting.engine(), bvh(Settings::direct_light())).unwrap();
    renderer.ready(&uploaded, &requests).unwrap();
    frame(gpu, &mut renderer, &uploaded, &requests).unwrap();
    for (texture, rendering) in textures.iter().zip(expected) {
        assert!(bytes(gpu, texture) == rendering.display);
    }
}

/// Keeps the device busy for a while with work of the caller.
fn busy(gpu: &Gpu, commands: &mut wgpu::CommandEncoder) {
    let text = "@group(0) @binding(0) var<storage, read_write> numbers: array<u32, 64>;\n\
        @compute @workgroup_size(64) fn busy(@builtin(global_invocation_id) id: vec3u) {\n\
          var x = id.x;\n\
          for (var i = 0u; i < 30000u; i++) { x = x * 747796405u + numbers[x % 64u]; }\n\
          numbers[id.x % 64u] = x;\n\
        }";
    let source = wgpu::ShaderSource::Wgsl(text.into());
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("busy"), source });
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("busy"),
        layout: None,
        module: &module,
        entry_point: Some("busy"),
        compilation_options: Default::default(),
        cache: None,
    });
    let numbers = storage_buffer(&gpu.device, "numbers", 256).unwrap();
    let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("busy"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: numbers.as_entire_binding() }],
    });
    let mut pass = commands.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bind_group, &[]);
    pass.dispatch_workgroups(128, 1, 1);
}

/// Polls until this number of reports has arrived. Also returns the number of empty polls before the first report.
fn reports(renderer: &mut Renderer, count: usize) -> (Vec<FrameReport>, u32) {
    let (mut collected, mut answers) = (Vec::new(), 0);
    while collected.len() < count {
        match renderer.poll() {
            Some(report) => collected.push(report),
            None => answers += u32::from(collected.is_empty()),
        }
        std::thread::yield_now();
    }
    (collected, answers)
}

/// The device has about one second of work queued, and a frame behind it. A call that waited would find the frame finished.
#[gpu_test]
fn gpu_no_call_waits_for_a_busy_device(gpu: &Gpu) {
    let scene = lit();
    for settings in [bvh(Settings::direct_light()), bvh(Settings::default())] {
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let view = |step| [ViewRequest::of_camera(1, &camera(&scene, step), SIZE, Target::Own)];
        renderer.ready(&uploaded, &view(0)).unwrap();
        let waits = renderer.pool.get_mut().unwrap().waits();
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        busy(gpu, &mut commands);
        let first = renderer.record(&mut commands, &uploaded, &view(0)).unwrap();
        let begin = std::time::Instant::now();
        gpu.queue.submit([commands.finish()]);
        let submitted = begin.elapsed();
        let first = renderer.submitted(first);
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        let second = renderer.record(&mut commands, &uploaded, &view(1)).unwrap();
        let recorded = begin.elapsed() - submitted;
        let (actual, answers) = reports(&mut renderer, 1);
        println!(
            "submitted in {submitted:?}, the next recorded in {recorded:?}; none yet {answers} times; done in {:?}",
            begin.elapsed()
        );
        assert!(answers >= 10, "{answers} empty polls: a call waited for the device");
        assert!(actual[0].frame == first && actual[0].is_complete, "{actual:?}");
        assert_eq!(renderer.pool.get_mut().unwrap().waits(), waits);
        gpu.queue.submit([commands.finish()]);
        let second = renderer.submitted(second);
        assert!(report(gpu, &mut renderer, second).is_complete);
    }
}

/// An operation that waits for the device while another view is prepared drops no report of earlier frames.
#[gpu_test]
fn gpu_every_frame_is_reported_while_other_views_are_prepared(gpu: &Gpu) {
    let scene = lit();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, bvh(Settings::direct_light())).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let view = |step, size| [ViewRequest::of_camera(1, &camera(&scene, step), size, Target::Own)];
    renderer.ready(&uploaded, &view(0, SIZE)).unwrap();
    let mut frames: Vec<_> =
        (0..3).map(|step| frame(gpu, &mut renderer, &uploaded, &view(step, SIZE)).unwrap()).collect();
    renderer.ready(&uploaded, &view(0, [20, 12])).unwrap();
    renderer.ready(&uploaded, &view(0, [12, 20])).unwrap();
    frames.push(frame(gpu, &mut renderer, &uploaded, &view(3, SIZE)).unwrap());
    let (actual, _) = reports(&mut renderer, frames.len());
    assert_eq!(actual.iter().map(|report| report.frame).collect::<Vec<_>>(), frames);
    assert!(renderer.poll().is_none(), "each frame is reported once");
}

#[gpu_test]
fn gpu_ten_frames_are_in_flight(gpu: &Gpu) {
    const FRAMES: usize = 10;
    let scene = lit();
    let settings = one_bounce();
    let mut waiting = Renderer::new(&gpu.device, &gpu.queue, settings.clone()).unwrap();
    let uploaded = waiting.upload(&scene).unwrap();
    let cameras: Vec<_> = (0..FRAMES).map(|step| camera(&scene, step)).collect();
    let mut rendering = |camera| waiting.render(&uploaded, camera, SIZE).unwrap().display;
    let expected: Vec<_> = cameras.iter().map(&mut rendering).collect();
    let textures: Vec<_> = (0..FRAMES).map(|_| texture(gpu, wgpu::TextureFormat::Rgba8Unorm, SIZE)).collect();
    let request = |i: usize| {
        let target = Target::Display(&textures[i], wgpu::TextureFormat::Rgba8Unorm);
        [ViewRequest::of_camera(1, &cameras[i], SIZE, target)]
    };
    let mut renderer = Renderer::with_engine(waiting.engine(), settings).unwrap();
    renderer.ready(&uploaded, &request(0)).unwrap();
    let ids: Vec<_> = (0..FRAMES).map(|i| frame(gpu, &mut renderer, &uploaded, &request(i)).unwrap()).collect();
    let (actual, _) = reports(&mut renderer, FRAMES);
    assert_eq!(actual.iter().map(|report| report.frame).collect::<Vec<_>>(), ids);
    let has_timestamps = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    for (i, report) in actual.iter().enumerate() {
        assert!(report.is_complete && !report.is_lost, "frame {i}: {report:?}");
        let listed = report.counters.iter().find(|(name, _)| name == "light_culling/indices");
        assert!(listed.is_some_and(|(_, count)| *count > 1000), "{:?}", report.counters);
        assert_eq!(report.passes.iter().any(|pass| pass.name == "prepass"), has_timestamps, "frame {i}");
        assert!(bytes(gpu, &textures[i]) == expected[i], "frame {i} shows another image");
    }
    assert!(expected[0] != expected[9]);
    assert!(renderer.poll().is_none());
}

#[gpu_test]
fn gpu_a_repeated_frame_in_the_callers_commands_allocates_nothing(gpu: &Gpu) {
    let scene = lit();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, bvh(Settings::direct_light())).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let shown = texture(gpu, wgpu::TextureFormat::Bgra8Unorm, SIZE);
    let irradiance = [0, 1].map(|_| texture(gpu, wgpu::TextureFormat::Rgba16Float, SIZE));
    let mut made_by_frame = |step: usize| {
        let camera = camera(&scene, step % 3);
        let views = [
            ViewRequest::of_camera(1, &camera, SIZE, Target::Display(&shown, wgpu::TextureFormat::Bgra8Unorm)),
            ViewRequest::of_camera(
                2,
                &camera,
                SIZE,
                Target::Demodulated { direct: &irradiance[0], indirect: &irradiance[1] },
            ),
        ];
        if step == 0 {
            renderer.ready(&uploaded, &views).unwrap();
        }
        let before = made();
        let id = frame(gpu, &mut renderer, &uploaded, &views).unwrap();
        let made = made() - before;
        report(gpu, &mut renderer, id);
        made
    };
    let compiled = (0..12).map(|step| made_by_frame(step).pipelines).sum::<u64>();
    assert_eq!(compiled, 0, "something was left to compile");
    for step in 12..18 {
        assert_eq!(made_by_frame(step), Made::default(), "frame {step}");
    }
}

#[gpu_test]
fn gpu_a_frame_that_overflows_shows_what_was_there_before(gpu: &Gpu) {
    let (few, many) = (demo("cornell").unwrap(), lit());
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, bvh(Settings::direct_light())).unwrap();
    let mut waiting = Renderer::with_engine(renderer.engine(), renderer.settings().clone()).unwrap();
    let scenes = [renderer.upload(&few).unwrap(), renderer.upload(&many).unwrap()];
    let view = camera(&few, 0);
    let [before, after] = [0, 1].map(|i: usize| waiting.render(&scenes[i], &view, SIZE).unwrap());
    assert!(before.display != after.display);
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let (shown, radiance) = (texture(gpu, format, SIZE), texture(gpu, wgpu::TextureFormat::Rgba16Float, SIZE));
    let requests = [
        ViewRequest::of_camera(1, &view, SIZE, Target::Display(&shown, format)),
        ViewRequest::of_camera(2, &view, SIZE, Target::Radiance(&radiance)),
    ];
    renderer.ready(&scenes[0], &requests).unwrap();
    let mut next = |scene: &GpuScene| {
        // The display is drawn again each time, whatever the texture contained.
        let clear = texture(gpu, format, SIZE);
        let shown = [ViewRequest { target: Target::Display(&clear, format), ..requests[0] }, requests[1]];
        let id = frame(gpu, &mut renderer, scene, &shown).unwrap();
        (report(gpu, &mut renderer, id), bytes(gpu, &clear), halves(gpu, &radiance))
    };
    let (first, display, light) = next(&scenes[0]);
    assert!(first.is_complete && display == before.display && light == before.radiance, "{first:?}");
    let (held, display, light) = next(&scenes[1]);
    assert!(!held.is_complete && display == before.display && light == before.radiance, "{held:?}");
    assert!(held.resized.contains(&"light_culling/indices"), "{held:?}");
    let (third, display, light) = next(&scenes[1]);
    assert!(third.is_complete && display == after.display && light == after.radiance, "{third:?}");
    // Images can still be rendered, also between frames.
    assert!(renderer.render(&scenes[0], &view, SIZE).unwrap().display == before.display);
}

/// Updates between frames in flight: each frame shows the scene at its submission.
#[gpu_test]
fn gpu_frames_show_a_scene_as_it_was_when_they_were_submitted(gpu: &Gpu) {
    let mut scene = demo("cornell").unwrap();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, one_bounce()).unwrap();
    let mut waiting = Renderer::with_engine(renderer.engine(), renderer.settings().clone()).unwrap();
    let mut uploaded = renderer.upload(&scene).unwrap();
    let view = camera(&scene, 0);
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let textures: Vec<_> = (0..4).map(|_| texture(gpu, format, SIZE)).collect();
    let request = |i: usize| [ViewRequest::of_camera(1, &view, SIZE, Target::Display(&textures[i], format))];
    renderer.ready(&uploaded, &request(0)).unwrap();
    let mut expected = Vec::new();
    for i in 0..textures.len() {
        let last = scene.instances.last_mut().expect("the box has things in it");
        last.world_from_object = Affine3A::from_translation(0.05 * Vec3::Y) * last.world_from_object;
        scene.lights[0].intensity *= 0.9;
        renderer.update(&mut uploaded, &scene).unwrap();
        frame(gpu, &mut renderer, &uploaded, &request(i)).unwrap();
        expected.push(scene.clone());
    }
    // Only this part waits for the device.
    let mut own = waiting.upload(&demo("cornell").unwrap()).unwrap();
    for (i, scene) in expected.iter().enumerate() {
        waiting.update(&mut own, scene).unwrap();
        let rendering = waiting.render(&own, &view, SIZE).unwrap();
        assert!(bytes(gpu, &textures[i]) == rendering.display, "frame {i}");
        assert!(i == 0 || bytes(gpu, &textures[i - 1]) != rendering.display, "the image did not change");
    }
}

#[gpu_test]
fn gpu_a_mean_continues_over_frames(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let settings = bvh(Settings::direct_light()).with_accumulate(3);
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let view = camera(&scene, 0);
    let expected = renderer.render(&uploaded, &view, SIZE).unwrap().radiance;
    let radiance = texture(gpu, wgpu::TextureFormat::Rgba32Float, SIZE);
    let requests = [ViewRequest::of_camera(1, &view, SIZE, Target::Radiance(&radiance))];
    renderer.ready(&uploaded, &requests).unwrap();
    renderer.reset();
    let mut means = Vec::new();
    for _ in 0..4 {
        frame(gpu, &mut renderer, &uploaded, &requests).unwrap();
        means.push(read_texture::<[f32; 4]>(&gpu.device, &gpu.queue, radiance.texture()).unwrap());
    }
    assert!(means[2] == expected && means[1] != expected && means[3] != expected);
}
