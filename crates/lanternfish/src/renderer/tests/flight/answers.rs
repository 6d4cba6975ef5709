//! Invalid requests and a lost device are errors; further views and targets: parallel rays, demodulated light.

use super::*;

#[gpu_test]
fn gpu_an_invalid_request_is_an_error_and_the_next_frame_renders(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, bvh(Settings::direct_light())).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let expected = renderer.render(&uploaded, &camera(&scene, 0), SIZE).unwrap();
    let sound = ViewRequest::of_camera(1, &camera(&scene, 0), SIZE, Target::Own);
    let small = texture(gpu, wgpu::TextureFormat::Rgba8Unorm, [8, 8]);
    let whole_numbers = texture(gpu, wgpu::TextureFormat::Rgba8Uint, SIZE);
    let size = |size| ViewRequest { size, ..sound };
    let to = |target| ViewRequest { target, ..sound };
    let stretched = [[2.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    for (name, request) in [
        ("a minimised window", size([0, 0])),
        ("no rows", size([48, 0])),
        ("too many columns", size([1 << 20, 1])),
        ("a matrix that stretches", ViewRequest { world_from_view: stretched, ..sound }),
        ("no numbers", ViewRequest { clip_from_view: [[f32::NAN; 4]; 4], ..sound }),
        ("a smaller texture", to(Target::Radiance(&small))),
        ("whole numbers", to(Target::Display(&whole_numbers, wgpu::TextureFormat::Rgba8Uint))),
    ] {
        let error = frame(gpu, &mut renderer, &uploaded, &[request]).unwrap_err();
        println!("{name}: {error}");
        let is_expected =
            matches!(error, RenderError::Size { .. } | RenderError::Camera { .. } | RenderError::Target { .. });
        assert!(is_expected, "{name}: {error:?}");
        assert!(renderer.ready(&uploaded, &[request]).is_err());
        let id = frame(gpu, &mut renderer, &uploaded, &[sound]).unwrap();
        assert!(renderer.read(id).unwrap()[0].radiance == expected.radiance, "{name}");
    }
    // A frame without views is valid.
    let nothing = frame(gpu, &mut renderer, &uploaded, &[]).unwrap();
    assert!(renderer.read(nothing).unwrap().is_empty() && report(gpu, &mut renderer, nothing).is_complete);

    // Only one frame at a time may be between recording and submission.
    let mut commands = gpu.device.create_command_encoder(&Default::default());
    let first = renderer.record(&mut commands, &uploaded, &[sound]).unwrap();
    assert!(matches!(renderer.record(&mut commands, &uploaded, &[sound]), Err(RenderError::NotSubmitted)));
    assert!(matches!(renderer.render(&uploaded, &camera(&scene, 0), [8, 8]), Err(RenderError::NotSubmitted)));
    let dropped = first.id();
    drop((first, commands));
    assert!(matches!(renderer.read(dropped), Err(RenderError::Gone)));
    let second = frame(gpu, &mut renderer, &uploaded, &[sound]).unwrap();
    assert!(renderer.read(second).unwrap()[0].radiance == expected.radiance);
    let third = frame(gpu, &mut renderer, &uploaded, &[sound]).unwrap();
    assert!(matches!(renderer.read(second), Err(RenderError::Gone)) && renderer.read(third).is_ok());
    let reported: Vec<_> = std::iter::from_fn(|| renderer.poll()).map(|report| report.frame).collect();
    assert!(reported.ends_with(&[second, third]) && !reported.contains(&dropped), "{reported:?}");
}

#[gpu_test]
fn gpu_a_lost_device_is_an_error(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let own = Gpu::open(&AdapterChoice::Name(gpu.description.name.clone())).unwrap();
    let mut renderer = Renderer::new(&own.device, &own.queue, bvh(Settings::direct_light())).unwrap();
    let mut uploaded = renderer.upload(&scene).unwrap();
    let view = [ViewRequest::of_camera(1, &camera(&scene, 0), SIZE, Target::Own)];
    renderer.ready(&uploaded, &view).unwrap();
    let mut commands = own.device.create_command_encoder(&Default::default());
    busy(&own, &mut commands);
    let on_its_way = renderer.record(&mut commands, &uploaded, &view).unwrap();
    own.queue.submit([commands.finish()]);
    let on_its_way = renderer.submitted(on_its_way);
    own.device.destroy();
    let is_lost = |error: &RenderError| matches!(error, RenderError::Gpu(GpuError::Lost));
    assert!(is_lost(&frame(&own, &mut renderer, &uploaded, &view).unwrap_err()));
    assert!(is_lost(&renderer.ready(&uploaded, &view).unwrap_err()));
    assert!(is_lost(&renderer.read(on_its_way).unwrap_err()));
    assert!(is_lost(&renderer.render(&uploaded, &camera(&scene, 0), [8, 8]).unwrap_err()));
    assert!(is_lost(&renderer.upload(&scene).unwrap_err()));
    assert!(is_lost(&renderer.update(&mut uploaded, &scene).unwrap_err()));
    assert!(is_lost(&renderer.set(Settings::default()).unwrap_err()));
    assert!(is_lost(&Renderer::new(&own.device, &own.queue, Settings::default()).unwrap_err()));
    // Frames in flight are reported as finished or lost.
    let mut reports = Vec::new();
    for _ in 0..1000 {
        reports.extend(renderer.poll());
        std::thread::sleep(std::time::Duration::from_millis(u64::from(reports.is_empty())));
    }
    println!("{reports:?}");
    assert!(reports.iter().all(|report| report.frame == on_its_way) && reports.len() <= 1);
    // Another device is not affected.
    checked::<_, GpuError>(&gpu.device, "test", || Ok(())).unwrap();
    let mut other = Renderer::new(&gpu.device, &gpu.queue, bvh(Settings::direct_light())).unwrap();
    let uploaded = other.upload(&scene).unwrap();
    assert!(frame(gpu, &mut other, &uploaded, &view).is_ok());
}

/// A process that ends while the device works may crash, after its tests have passed.
#[gpu_test]
fn gpu_a_test_ends_with_an_idle_device(gpu: &Gpu) {
    let idle = gpu.idle_at_end();
    let mut commands = gpu.device.create_command_encoder(&Default::default());
    busy(gpu, &mut commands);
    gpu.queue.submit([commands.finish()]);
    drop(idle);
    assert!(gpu.device.poll(wgpu::PollType::Poll).unwrap().is_queue_empty());
}

/// A view with an orthographic projection, given as matrices.
#[gpu_test]
fn gpu_an_orthographic_view_can_be_requested(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, bvh(Settings::direct_light())).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let projection = Projection::Orthographic { half_height: 1.0, near: 0.0, far: 20.0 };
    let camera = Camera { projection, ..scene.cameras[0].clone() };
    let expected = renderer.render(&uploaded, &camera, SIZE).unwrap();
    let view = [ViewRequest::of_camera(1, &camera, SIZE, Target::Own)];
    renderer.ready(&uploaded, &view).unwrap();
    let id = frame(gpu, &mut renderer, &uploaded, &view).unwrap();
    let actual = renderer.read(id).unwrap().remove(0);
    // The near and far planes are not fitted to the scene, so depth is rounded differently and shadow edges may move.
    let pairs = actual.display.iter().zip(&expected.display);
    let same = pairs.filter(|(a, b)| a.iter().zip(b.iter()).all(|(a, b)| a.abs_diff(*b) <= 2)).count();
    assert!(same * 100 >= expected.display.len() * 98, "{same} of {}", expected.display.len());
}

/// Radiance of a white surface is the sum of direct and indirect light; the surfaces are the scene's.
#[gpu_test]
fn gpu_demodulated_light_of_white_surfaces_is_the_image(gpu: &Gpu) {
    let mut scene = lit();
    for material in &mut scene.materials {
        *material = Material { base_color: Vec4::ONE, double_sided: material.double_sided, ..Material::default() };
    }
    scene.sky = Vec3::splat(0.2);
    let plain = bvh(Settings::direct_light()).with_materials(Materials::Lambert);
    let few = Sampled { diffuse_rays: 1, glossy_rays: 0, ..Sampled::default().one_bounce() };
    let disk = Light::disk(Vec3::new(0.0, 1.6, 0.0), Vec3::NEG_Y, 0.2, Vec3::splat(4.0));
    let with_area = Scene { lights: scene.lights.iter().cloned().chain([disk]).collect(), ..scene.clone() };
    for (name, scene, settings) in [
        ("direct light", &scene, plain.clone()),
        ("no shadows, tiles", &scene, plain.clone().with_culling(Tiled::default()).with_shadows(Shadows::None)),
        ("soft shadows", &scene, plain.clone().with_light_radius(0.05).with_shadow_rays(4)),
        ("a disk", &with_area, plain.clone().with_shadow_rays(4)),
        ("indirect light", &scene, plain.clone().with_indirect(few)),
    ] {
        let mut waiting = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
        let uploaded = waiting.upload(scene).unwrap();
        let camera = camera(scene, 0);
        let expected = waiting.render(&uploaded, &camera, SIZE).unwrap().radiance;
        let [direct, indirect] = [0, 1].map(|_| texture(gpu, wgpu::TextureFormat::Rgba16Float, SIZE));
        let target = Target::Demodulated { direct: &direct, indirect: &indirect };
        let view = [ViewRequest::of_camera(1, &camera, SIZE, target)];
        let mut renderer = Renderer::with_engine(waiting.engine(), waiting.settings().clone()).unwrap();
        renderer.ready(&uploaded, &view).unwrap();
        let id = frame(gpu, &mut renderer, &uploaded, &view).unwrap();
        assert!(report(gpu, &mut renderer, id).is_complete, "{name}");
        let (direct, indirect) = (halves(gpu, &direct), halves(gpu, &indirect));
        let finds_indirect = name == "indirect light";
        assert_eq!(indirect.iter().any(|texel| texel[..3].iter().any(|c| *c > 0.01)), finds_indirect, "{name}");
        // Half floats are rounded by 2^-11. Normals and positions are not identical, less so on a card that snaps vertices to a grid: at
        // shadow edges a ray may hit another surface, and close to a light the distance matters.
        let (mut off, mut covered) = (0, 0);
        for (i, expected) in expected.iter().enumerate().filter(|(_, texel)| texel[3] == 1.0) {
            let sum: Vec<f32> = (0..3).map(|c| direct[i][c] + indirect[i][c]).collect();
            assert_eq!((direct[i][3], indirect[i][3]), (1.0, 1.0));
            covered += 1;
            off += usize::from(sum.iter().zip(expected).any(|(sum, e)| (sum - e).abs() > 0.004 * e + 1e-4));
        }
        println!("{name}: {off} of {covered} pixels differ");
        assert!(covered > 500 && off * 25 < covered, "{name}: {off} of {covered} pixels differ");
    }
    // Settings that do not support demodulated light.
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, plain.clone().with_samples(Samples::Four)).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let (sum, depth) =
        (texture(gpu, wgpu::TextureFormat::Rgba16Float, SIZE), texture(gpu, wgpu::TextureFormat::Depth32Float, SIZE));
    let irradiance =
        ViewRequest::of_camera(1, &camera(&scene, 0), SIZE, Target::Demodulated { direct: &sum, indirect: &sum });
    assert!(matches!(frame(gpu, &mut renderer, &uploaded, &[irradiance]), Err(RenderError::Together { .. })));
    renderer.set(plain).unwrap();
    for surface in [
        // Shaders may bind neither, and the second is not a depth format.
        SurfaceSource::Given { depth: &depth, normal_roughness: &sum },
        SurfaceSource::Given { depth: &sum, normal_roughness: &sum },
    ] {
        let given = ViewRequest { surface, ..irradiance };
        assert!(matches!(frame(gpu, &mut renderer, &uploaded, &[given]), Err(RenderError::Target { .. })));
        let shaded = ViewRequest { target: Target::Own, ..given };
        assert!(matches!(frame(gpu, &mut renderer, &uploaded, &[shaded]), Err(RenderError::Target { .. })));
    }
}
