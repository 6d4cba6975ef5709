//! Direct light from a fixed number of rays: its mean over frames against a ray to every light, and against the path
//! tracer.

#[path = "sampled_lights/robust.rs"]
mod robust;

use std::collections::BTreeMap;

use glam::Vec3;
use lanternfish::{
    Engine, RenderedImage, Renderer, Settings, Target, ViewRequest,
    settings::{Attenuation, Direct, History, Indirect, Samples},
    techniques::{Denoise, LightSamples, SampledLights},
};
use lanternfish_gpu::{Gpu, read_texture, testing};
use lanternfish_metrics::RgbImage;
use lanternfish_reference::{
    Film, Settings as TracerSettings, Tracer as PathTracer,
    settings::{Integrator, LightChoice},
};
use lanternfish_scene::{
    AlphaMode, Bounds, Camera, Light, LightKind, Material, Scene,
    generate::{self, Rain},
};

use crate::support::{bits, counter, linear, quad, render};

/// Width and height of images, pixels: not a multiple of a tile.
const EDGE: u32 = 36;
const SIZE: (u32, u32) = (EDGE, EDGE);

/// Sampled direct light without a filter, and a history: random numbers of a view at rest go on.
fn sampled() -> Settings {
    let direct = SampledLights { denoise: Denoise::Off, ..SampledLights::default() };
    Settings::direct_light().with_direct(direct).with_history(History::On)
}

/// The same number at every call, 0..1.
fn fraction(i: usize, step: f32) -> f32 {
    (step * (i + 1) as f32).fract()
}

/// The Cornell box without its lamp; its light is that of `light`, at points inside the box.
fn cornell(count: usize, light: impl Fn(usize, Vec3) -> Light) -> Scene {
    let mut scene = generate::demo("cornell").unwrap();
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    let place = |i| {
        Vec3::new(1.6 * fraction(i, 0.8192) - 0.8, 0.3 + 1.5 * fraction(i, 0.6711), 1.6 * fraction(i, 0.5498) - 0.8)
    };
    scene.lights = (0..count).map(|i| light(i, place(i))).collect();
    scene
}

/// A coloured intensity; every seventh is much brighter.
fn color(i: usize) -> Vec3 {
    let bright = if i.is_multiple_of(7) { 1.0 } else { 0.08 };
    bright * Vec3::new(1.0 + (i % 3) as f32, 2.0, 1.0 + (i % 5) as f32)
}

fn point(i: usize, position: Vec3) -> Light {
    Light::point(position, color(i))
}

fn spot(i: usize, position: Vec3) -> Light {
    let direction = Vec3::new(fraction(i, 0.41) - 0.5, -0.7, fraction(i, 0.73) - 0.5).normalize();
    let kind = LightKind::Spot { inner_angle: 0.2, outer_angle: 0.5 + 0.1 * (i % 8) as f32 };
    Light { kind, direction, ..Light::point(position, 3.0 * color(i)) }
}

/// Suns, of which some come in by the open side, and points.
fn sun_or_point(i: usize, position: Vec3) -> Light {
    let direction = Vec3::new(0.4 * fraction(i, 0.37) - 0.2, -0.3, -1.0);
    if i < 9 { Light::directional(direction, 0.3 * color(i)) } else { point(i, position) }
}

/// Above the blocks: points on an area light that touches a surface are as noisy as they are near.
fn disk_or_rectangle(i: usize, place: Vec3) -> Light {
    let position = Vec3::new(0.8 * place.x, 1.3 + 0.3 * place.y, 0.8 * place.z);
    let direction = Vec3::new(fraction(i, 0.41) - 0.5, -0.7, fraction(i, 0.73) - 0.5).normalize();
    match i % 2 {
        0 => Light::disk(position, direction, 0.05 + 0.02 * (i % 5) as f32, 20.0 * color(i)),
        _ => Light::rectangle(position, direction, Vec3::X, [0.1, 0.05 * (1 + i % 6) as f32], 20.0 * color(i)),
    }
}

/// Sums over all pixels, for each channel.
fn energies(image: &RgbImage) -> [f64; 3] {
    [0, 1, 2].map(|channel| image.pixels.iter().map(|pixel| f64::from(pixel[channel])).sum())
}

/// The ratio of the channel that is farthest off.
fn farthest(actual: [f64; 3], expected: [f64; 3]) -> f64 {
    let ratios = actual.iter().zip(&expected).map(|(a, b)| a / b);
    ratios.fold(1.0, |worst: f64, ratio| if (ratio - 1.0).abs() > (worst - 1.0).abs() { ratio } else { worst })
}

/// Energy of an image over that of another.
fn energy(image: &RgbImage, reference: &RgbImage) -> f64 {
    farthest(energies(image), energies(reference))
}

/// Frames of a view at rest.
fn frames(renderer: &mut Renderer, scene: &Scene, camera: &Camera, count: usize) -> Vec<RenderedImage> {
    let uploaded = renderer.upload(scene).unwrap();
    (0..count).map(|_| renderer.render(&uploaded, camera, SIZE.into()).unwrap()).collect()
}

/// The mean of many frames in one image.
fn many(settings: Settings) -> Settings {
    settings.with_accumulate(64).with_history(History::Off)
}

/// Sampled direct light of these settings has the energy of a ray to every light.
fn expect_energy_of_all(gpu: &Gpu, name: &str, scene: &Scene, settings: Settings) {
    let of = |settings| linear(&render(gpu, scene, &scene.cameras[0], SIZE, settings));
    let all = of(settings.clone().with_direct(Direct::NONE).with_shadow_rays(32));
    let ratio = energy(&of(settings), &all);
    println!("{name}: energy {ratio:.4}");
    // The noise of both, and the rounding of normals to 16 bits.
    assert!((ratio - 1.0).abs() < 0.01, "{name}: {ratio}");
}

/// Behind a pane, too, which has its own layers.
#[gpu_test]
fn gpu_sampled_light_has_the_energy_of_all_lights(gpu: &Gpu) {
    let scene = cornell(30, point);
    expect_energy_of_all(gpu, "points", &scene, many(sampled()));
    if testing::is_full() {
        expect_energy_of_all(gpu, "behind a pane", &behind_a_pane(scene.clone()), many(sampled()));
    }
    // Check that the test can fail: probabilities that are 5 % too high. An engine of its own: its shaders are edited.
    let mut renderer = Renderer::with_engine(&Engine::new(&gpu.device, &gpu.queue), many(sampled())).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let view = [ViewRequest::of_camera(0, &scene.cameras[0], [EDGE, EDGE], Target::Own)];
    let right = linear(&renderer.render(&uploaded, &scene.cameras[0], [EDGE, EDGE]).unwrap());
    let [text, by] = ["chance * candidate.chance", "1.05 * chance * candidate.chance"];
    let source = include_str!("../../src/direct_light/sampled/choice.wesl");
    assert!(source.contains(text));
    let texts = BTreeMap::from([("direct_light/sampled/choice".to_owned(), source.replace(text, by))]);
    renderer.edit_shaders(texts, &uploaded, &view).unwrap();
    let edited = linear(&renderer.render(&uploaded, &scene.cameras[0], [EDGE, EDGE]).unwrap());
    assert!((energy(&edited, &right) - 1.0).abs() > 0.03, "{}", energy(&edited, &right));
}

/// Lights of every kind, with and without an area and a filter, and at edges with several samples.
#[gpu_test(full)]
fn gpu_sampled_light_of_every_kind_has_the_energy_of_all_lights(gpu: &Gpu) {
    let points = || cornell(30, point);
    let filtered = many(sampled()).with_direct(SampledLights::default());
    let with_history = filtered.clone().with_history(History::On);
    // Many rays to each light: fewer frames.
    let area = || many(sampled()).with_accumulate(24);
    let wide = area().with_light_radius(0.1);
    let mut before = points();
    before.lights = vec![Light::point(Vec3::new(0.0, 1.0, 1.2), Vec3::splat(4.0))];
    // Leaves with masks, normal maps, glass.
    let mut atrium = generate::demo("atrium").unwrap();
    atrium.lights.extend(generate::light_rain(&atrium.bounds(), 300, None, 1, 0.0));
    for (name, scene, settings) in [
        ("six points", cornell(6, point), many(sampled())),
        ("spots", cornell(30, spot), many(sampled())),
        ("suns", cornell(30, sun_or_point), many(sampled())),
        // Of 300 lights each frame is noisier.
        ("atrium", atrium, many(sampled()).with_accumulate(160)),
        ("disks and rectangles", cornell(30, disk_or_rectangle), area()),
        ("points with a radius", points(), wide.clone()),
        ("spots with a radius", cornell(30, spot), wide),
        ("wide suns", cornell(4, sun_or_point), area().with_sun_diameter(20.0)),
        ("with a filter", points(), filtered),
        ("with a filter and a history", points(), with_history),
        ("four samples", points(), many(sampled()).with_samples(Samples::Four)),
        ("before a pane", behind_a_pane(before), many(sampled())),
    ] {
        expect_energy_of_all(gpu, name, &scene, settings);
    }
}

/// Each frame of lights that fall has the light of a ray to every light: neither clamp nor history takes any.
#[gpu_test]
fn gpu_frames_of_moving_sampled_light_have_its_energy(gpu: &Gpu) {
    let mut scene = cornell(0, point);
    let rain = Rain::add(&mut scene, 200, Some(0.8), 3);
    let settings = Settings::direct_light().with_history(History::On);
    let mut images = [Direct::NONE, SampledLights::default().into()].map(|direct| {
        let settings = settings.clone().with_direct(direct);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let mut uploaded = renderer.upload(&scene).unwrap();
        let mut moving = scene.clone();
        let frame = |i: u32| {
            rain.fall(&mut moving.lights, i as f32 / 60.0);
            renderer.update(&mut uploaded, &moving).unwrap();
            linear(&renderer.render(&uploaded, &scene.cameras[0], SIZE.into()).unwrap())
        };
        (0..10).map(frame).collect::<Vec<_>>().into_iter()
    });
    let [all, sampled] = &mut images;
    let sum = |image: &RgbImage| energies(image).iter().sum::<f64>();
    let ratios: Vec<f64> = sampled.zip(all).map(|(sampled, all)| sum(&sampled) / sum(&all)).collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!("{ratios:.3?}, mean {mean:.3}");
    // The noise of a frame, and of ten.
    assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.05) && (mean - 1.0).abs() < 0.02, "{ratios:.3?}, {mean}");
}

/// Squared differences of the relative errors of neighbouring pixels where the reference is smooth: mean of those
/// across edges of tiles of 8 × 8 over that within tiles.
fn squares(image: &RgbImage, reference: &RgbImage) -> f64 {
    let brightness =
        |image: &RgbImage| -> Vec<f64> { image.pixels.iter().map(|p| p.iter().sum::<f32>().into()).collect() };
    let [image, reference] = [image, reference].map(brightness);
    let mean = reference.iter().sum::<f64>() / reference.len() as f64;
    let error: Vec<f64> = image.iter().zip(&reference).map(|(a, b)| (a - b) / (b + 0.1 * mean)).collect();
    let width = error.len().isqrt();
    let mut sums = [[0.0; 2]; 2];
    for (line, at) in (0..width).flat_map(|line| (1..width).map(move |at| (line, at))) {
        for (a, b) in [(line * width + at, line * width + at - 1), (at * width + line, (at - 1) * width + line)] {
            let step = (reference[a] - reference[b]).abs();
            if step <= 0.1 * (reference[a] + reference[b] + 0.02 * mean) {
                let [sum, count] = &mut sums[usize::from(at % 8 != 0)];
                *sum += (error[a] - error[b]).powi(2);
                *count += 1.0;
            }
        }
    }
    let [across, within] = sums.map(|[sum, count]| sum / count);
    across / within
}

/// No tile lacks a lamp beside a wall that its neighbours have: filtered noise does not show tiles.
#[gpu_test]
fn gpu_lamps_beside_walls_show_no_tiles(gpu: &Gpu) {
    let mut scene = cornell(0, point);
    let bounds = Bounds { min: Vec3::new(-0.9, 0.1, -0.9), max: Vec3::new(0.9, 1.9, 0.9) };
    scene.lights = generate::random_lights(&bounds, 200, 1.0, 7);
    let of = |direct: Direct| {
        let settings = Settings::direct_light().with_direct(direct);
        linear(&render(gpu, &scene, &scene.cameras[0], (96, 96), settings))
    };
    let [all, sampled] = [Direct::NONE, SampledLights::default().into()].map(of);
    let visible = squares(&sampled, &all);
    println!("differences across edges of tiles {visible:.2} of those within");
    assert!(visible < 1.5, "{visible}");
    // Check that the test can fail: every second tile is a tenth darker.
    let mut tiled = sampled;
    for (i, pixel) in tiled.pixels.iter_mut().enumerate() {
        let is_dark = (i % 96 / 8 + i / 96 / 8).is_multiple_of(2);
        *pixel = pixel.map(|value| if is_dark { 0.9 * value } else { value });
    }
    assert!(squares(&tiled, &all) > 2.0, "{}", squares(&tiled, &all));
}

/// A view that moves: some tiles keep light and others its ratio, and no line shows where these meet.
#[gpu_test]
fn gpu_light_and_its_ratios_do_not_mix_in_motion(gpu: &Gpu) {
    let mut scene = generate::demo("cornell").unwrap();
    let bounds = Bounds { min: Vec3::new(-0.9, 0.1, -0.9), max: Vec3::new(0.9, 1.9, 0.9) };
    scene.lights = generate::random_lights(&bounds, 200, 1.0, 7);
    let history = Settings::direct_light().with_direct(SampledLights::default()).with_history(History::On);
    let mean = sampled().with_history(History::Off).with_accumulate(32);
    let [truth, after] = [(mean, 1), (history, 12)].map(|(settings, frames): (Settings, u8)| {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let mut frame = |left: u8| {
            let eye = Vec3::new(0.012 * f32::from(left), 1.0, 3.2);
            let camera = Camera::look_at(eye, Vec3::Y, scene.cameras[0].projection);
            renderer.render(&uploaded, &camera, [96, 96]).unwrap()
        };
        linear(&(0..frames).rev().map(&mut frame).last().unwrap()).pixels
    });
    let shines = |(after, truth): &(&[f32; 3], &[f32; 3])| after[1] > 2.0 * truth[1] + 2.0;
    let shining = after.iter().zip(&truth).filter(shines).count();
    // With the mixture 51, without 11: highlights that the view's motion blurs.
    assert!(shining < 25, "{shining} pixels");
}

/// Lamps that a box hides outweigh the panel that lights its front: noise is filtered, and no pixel stands apart.
#[gpu_test]
fn gpu_light_of_a_panel_among_hidden_lamps_has_no_dots(gpu: &Gpu) {
    let mut scene = generate::demo("cornell").unwrap();
    let bounds = Bounds { min: Vec3::new(-0.98, 0.05, -0.98), max: Vec3::new(-0.85, 1.9, 0.9) };
    scene.lights = generate::random_lights(&bounds, 40, 1.0, 7);
    let [filtered, noisy] = [Denoise::On, Denoise::Off].map(|denoise| {
        let settings = Settings::direct_light().with_direct(SampledLights { denoise, ..SampledLights::default() });
        let image = linear(&render(gpu, &scene, &scene.cameras[0], (96, 96), settings)).pixels;
        let around = |at: &usize| [at - 1, at + 1, at - 96, at + 96];
        let inside = (44..76).flat_map(|y| (33..47).map(move |x| 96 * y + x));
        inside.filter(|at| around(at).iter().all(|next| image[*at][1] < 0.6 * image[*next][1])).count()
    });
    assert!(filtered == 0 && noisy > 0, "{filtered} dots, {noisy} without a filter");
}

/// The scene behind transparent glass.
fn behind_a_pane(mut scene: Scene) -> Scene {
    scene.materials.push(Material {
        base_color: Vec3::new(0.8, 0.9, 0.7).extend(0.6),
        alpha_mode: AlphaMode::Blend,
        metallic: 0.0,
        double_sided: true,
        ..Material::default()
    });
    let pane = quad(scene.materials.len() - 1, Vec3::new(0.0, 1.0, 0.9), 0.8 * Vec3::X, 0.8 * Vec3::Y);
    scene.meshes[0].primitives.push(pane);
    scene
}

/// A lamp lights the second pane, and the first one hardly: each takes its own light.
#[gpu_test]
fn gpu_a_pane_behind_another_has_its_own_light(gpu: &Gpu) {
    let lamp = |_, _| Light::point(Vec3::new(0.2, 1.0, 0.3), Vec3::splat(2.0));
    let mut scene = behind_a_pane(cornell(1, lamp));
    let curtain = quad(scene.materials.len() - 1, Vec3::new(0.0, 1.0, 0.0), 0.6 * Vec3::X, 0.6 * Vec3::Y);
    scene.meshes[0].primitives.push(curtain);
    let settings = Settings::direct_light().with_direct(SampledLights::default());
    let mut renderer = Renderer::with_engine(&Engine::new(&gpu.device, &gpu.queue), settings.clone()).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let view = [ViewRequest::of_camera(0, &scene.cameras[0], [EDGE, EDGE], Target::Own)];
    let first = linear(&renderer.render(&uploaded, &scene.cameras[0], [EDGE, EDGE]).unwrap());
    let all = linear(&render(gpu, &scene, &scene.cameras[0], SIZE, settings.with_direct(Direct::NONE)));
    let off = |image: &RgbImage| {
        let sum = |of: &dyn Fn(usize) -> f32| -> f32 { (0..(EDGE * EDGE) as usize).map(of).sum() };
        sum(&|at| (image.pixels[at][1] - all.pixels[at][1]).abs()) / sum(&|at| all.pixels[at][1])
    };
    let own = off(&first);
    let [text, by] = [">= abs(depth", ">= 0.0 * abs(depth"];
    let source = include_str!("../../src/direct_light/layers.wesl");
    assert!(source.contains(text));
    let texts = BTreeMap::from([("direct_light/layers".to_owned(), source.replace(text, by))]);
    renderer.edit_shaders(texts, &uploaded, &view).unwrap();
    let nearest = off(&linear(&renderer.render(&uploaded, &scene.cameras[0], [EDGE, EDGE]).unwrap()));
    assert!(own < 0.03 && nearest > 0.1, "{own} of the light is off, with that of the nearest pane {nearest}");
}

/// Emissive triangles without indirect light: the path tracer's direct light.
#[gpu_test]
fn gpu_emissive_triangles_are_the_path_tracers(gpu: &Gpu) {
    let mut scene = generate::demo("cornell").unwrap();
    scene.lights = Vec::new();
    let shine = |max_depth| {
        let settings = TracerSettings {
            integrator: Integrator::Path,
            max_depth,
            attenuation: Attenuation::Physical,
            light_choice: LightChoice::Uniform,
            ..TracerSettings::default()
        };
        let mut film = Film::new([EDGE, EDGE]).unwrap();
        PathTracer::new(&scene, settings).unwrap().render(&scene.cameras[0], &mut film, 256);
        RgbImage::new(EDGE as usize, EDGE as usize, film.mean()).unwrap()
    };
    let ours = |direct: Direct| {
        let settings = many(sampled()).with_direct(direct).with_indirect(Indirect::NONE);
        linear(&render(gpu, &scene, &scene.cameras[0], SIZE, settings))
    };
    // The lamp itself is brighter than what it lights.
    let without = |all: RgbImage, lamp: RgbImage| {
        let pixels = all.pixels.iter().zip(&lamp.pixels).map(|(a, b)| [0, 1, 2].map(|i| a[i] - b[i])).collect();
        RgbImage::new(EDGE as usize, EDGE as usize, pixels).unwrap()
    };
    let expected = without(shine(2), shine(1));
    let actual = without(ours(sampled().direct), ours(Direct::NONE));
    let ratio = energy(&actual, &expected);
    println!("energy {ratio:.4}");
    // The noise of both.
    assert!((ratio - 1.0).abs() < 0.015, "{ratio}");
}

/// The same input gives the same bits, and no more rays than stated.
#[gpu_test]
fn gpu_sampled_light_is_reproducible_and_keeps_its_budget(gpu: &Gpu) {
    let scene = cornell(60, sun_or_point);
    let of = |engine: &Engine, settings: Settings| {
        let mut renderer = Renderer::with_engine(engine, settings).unwrap();
        frames(&mut renderer, &scene, &scene.cameras[0], 3)
    };
    let filtered = sampled().with_direct(SampledLights::default());
    let shown = [0, 1].map(|_| of(&Engine::new(&gpu.device, &gpu.queue), filtered.clone()));
    for (a, b) in shown[0].iter().zip(&shown[1]) {
        assert!(bits(a) == bits(b) && a.display == b.display && a.report.counters == b.report.counters);
    }
    assert!(bits(&shown[0][0]) != bits(&shown[0][1]), "frames have different noise");
    let mut before = 0;
    for rays in LightSamples::ALL {
        let direct = SampledLights { light_samples: *rays, denoise: Denoise::Off };
        let most = u64::from(rays.count()) * u64::from(EDGE * EDGE);
        for image in of(&testing::engine(gpu), sampled().with_direct(direct)) {
            let traced = counter(&image, "shadows/rays");
            assert!(traced <= most && traced > before, "{rays}: {traced} of {most}");
        }
        before = most / 3;
    }
}

/// Direct light of frames of demodulated targets, one after another.
fn demodulated(gpu: &Gpu, scene: &Scene, settings: Settings, count: usize) -> Vec<RgbImage> {
    const SIZE: [u32; 2] = [96, 96];
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    let [direct, indirect] = ["direct", "indirect"].map(|label| {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        texture.create_view(&Default::default())
    });
    let target = Target::Demodulated { direct: &direct, indirect: &indirect };
    let views = [ViewRequest::of_camera(0, &scene.cameras[0], SIZE, target)];
    renderer.ready(&uploaded, &views).unwrap();
    let frame = |_| {
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        let frame = renderer.record(&mut commands, &uploaded, &views).unwrap();
        gpu.queue.submit([commands.finish()]);
        renderer.submitted(frame);
        let texels: Vec<[f32; 4]> = read_texture(&gpu.device, &gpu.queue, direct.texture()).unwrap();
        let pixels = texels.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
        RgbImage::new(SIZE[0] as usize, SIZE[1] as usize, pixels).unwrap()
    };
    (0..count).map(frame).collect()
}

/// Demodulated light for a program that shades by itself. All frames of these targets have the same random numbers,
/// with a history too: a program cannot average their noise.
#[gpu_test]
fn gpu_demodulated_targets_have_sampled_light(gpu: &Gpu) {
    let scene = cornell(30, point);
    let direct = SampledLights { light_samples: LightSamples::Eight, denoise: Denoise::Off };
    let all = demodulated(gpu, &scene, sampled().with_direct(Direct::NONE).with_history(History::Off), 1);
    let images = demodulated(gpu, &scene, sampled().with_direct(direct), 2);
    let ratio = energy(&images[0], &all[0]);
    println!("energy {ratio:.4}");
    // The noise of the pixels of one frame.
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    assert!(images[0] == images[1], "frames of views without a history are the same");
}
