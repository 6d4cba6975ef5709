use glam::{UVec2, Vec3, Vec4};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_reference::{
    Film, Settings as TracerSettings, Tracer,
    settings::{Integrator, LightChoice},
};
use lanternfish_scene::{AlphaMode, Camera, Environment, Light, Material, Projection, Scene, generate::demo};

use crate::{
    RenderError, Renderer, Settings,
    settings::{
        Attenuation, DeepDepth, DeepImageSettings, DeepStore, Indirect, IndirectClamp, IndirectResolution,
        IndirectTracer, Sampled, Samples, Shadows,
    },
    testing::{Random, apart, ask_module, quad, scene_of},
};

/// Not a multiple of a workgroup.
const SIZE: UVec2 = UVec2::new(61, 45);

fn sampled(tracer: IndirectTracer) -> Sampled {
    let clamp = IndirectClamp::Off;
    Sampled { diffuse_rays: 64, glossy_rays: 32, tracer, filter_radius: 0, clamp, ..Sampled::default() }
}

fn settings(sampled: Sampled) -> Settings {
    Settings {
        indirect: Indirect::Sampled(sampled),
        attenuation: Attenuation::Physical,
        range_threshold: 1e-6,
        ..Settings::direct_light()
    }
}

fn picture(gpu: &Gpu, settings: Settings, scene: &Scene, camera: &Camera) -> Vec<Vec3> {
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    let picture = renderer.render(&uploaded, camera, SIZE.x, SIZE.y).unwrap();
    picture.radiance.iter().map(|pixel| Vec4::from(*pixel).truncate()).collect()
}

fn mean(pixels: &[Vec3]) -> f64 {
    pixels.iter().map(|pixel| f64::from(pixel.element_sum()) / 3.0).sum::<f64>() / pixels.len() as f64
}

/// Mean distance of pixels over the mean of the second.
fn off(found: &[Vec3], truth: &[Vec3]) -> f64 {
    let apart = found.iter().zip(truth).map(|(a, b)| f64::from((*a - *b).abs().element_sum()) / 3.0);
    apart.sum::<f64>() / truth.len() as f64 / mean(truth)
}

fn looking(eye: [f32; 3], target: [f32; 3]) -> Camera {
    Camera::look_at(eye.into(), target.into(), Projection::Perspective { fov_y: 0.8, near: 0.02 })
}

fn matt(albedo: f32) -> Material {
    Material {
        base_color: Vec3::splat(albedo).extend(1.0),
        metallic: 0.0,
        specular: 0.0,
        perceptual_roughness: 1.0,
        double_sided: true,
        ..Material::default()
    }
}

fn floor(material: Material) -> Scene {
    scene_of(vec![quad(0, Vec3::ZERO, 10.0 * Vec3::X, -10.0 * Vec3::Z)], vec![material])
}

/// A box of 2 m around the origin whose sides look inwards.
fn closed_box(material: Material) -> Scene {
    let side = |axis: Vec3| {
        let (right, up) = axis.any_orthonormal_pair();
        quad(0, -axis, right, up)
    };
    let axes = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    scene_of(axes.map(side).to_vec(), vec![material])
}

/// The Cornell box lit by a lamp in its middle: none of its surfaces is so near that few rays carry most of the light.
fn cornell() -> Scene {
    let mut scene = demo("cornell").unwrap();
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    scene.lights = vec![Light::point(Vec3::new(0.0, 1.2, 0.5), Vec3::new(3.0, 2.5, 2.0))];
    scene
}

/// Those that the device has.
fn tracers(gpu: &Gpu) -> impl Iterator<Item = &'static IndirectTracer> {
    let has_ray_query = gpu.description.ray_query;
    IndirectTracer::ALL.iter().filter(move |tracer| **tracer != IndirectTracer::RayQuery || has_ray_query)
}

fn is_exact(tracer: IndirectTracer) -> bool {
    matches!(tracer, IndirectTracer::Bvh | IndirectTracer::RayQuery)
}

#[test]
fn gpu_the_surroundings_light_an_open_floor() {
    let Some(gpu) = testing::gpu("gpu_the_surroundings_light_an_open_floor") else { return };
    let camera = looking([0.0, 2.0, 2.0], [0.0, 0.0, 0.0]);
    let sky = Vec3::new(1.0, 2.0, 4.0);
    let white = Environment { width: 4, height: 2, pixels: vec![sky; 8], rotation: 0.0 };
    for tracer in tracers(gpu) {
        for environment in [None, Some(white.clone())] {
            let is_image = environment.is_some();
            let scene = Scene { sky, environment, ..floor(matt(0.5)) };
            let found = picture(gpu, settings(sampled(*tracer)), &scene, &camera);
            // Albedo times the sky's radiance, whatever the rays.
            let worst = found.iter().map(|pixel| (*pixel / (0.5 * sky) - 1.0).abs().max_element()).fold(0.0, f32::max);
            // Of 64 rays three may run along the floor and, in an image, into it.
            let most = if is_exact(*tracer) { 2e-3 } else { 3.1 / 64.0 };
            assert!(worst < most, "{tracer}, image {is_image}: {worst}");
        }
    }
}

/// A small sun is neither missed nor found by all rays at once: each sees the mean of what it stands for.
#[test]
fn gpu_few_rays_find_a_small_sun() {
    let Some(gpu) = testing::gpu("gpu_few_rays_find_a_small_sun") else { return };
    let (width, height, row) = (64, 32, 8);
    let mut pixels = vec![Vec3::ZERO; width * height];
    pixels[row * width + 20] = Vec3::splat(1000.0);
    let scene = Scene { environment: Some(Environment { width, height, pixels, rotation: 0.0 }), ..floor(matt(0.5)) };
    // Bilinear between pixels: of twice their width across and down, and half as bright in the mean.
    let step = std::f64::consts::PI / height as f64;
    let colatitude = (row as f64 + 0.5) * step;
    let expected = 0.5 / std::f64::consts::PI * 1000.0 * step * step * colatitude.sin() * colatitude.cos();
    let camera = looking([0.0, 2.0, 2.0], [0.0, 0.0, 0.0]);
    for diffuse_rays in [4, 8, 32] {
        let few = Sampled { diffuse_rays, ..sampled(IndirectTracer::Bvh) };
        let found = picture(gpu, settings(few), &scene, &camera);
        let energy = mean(&found) / expected;
        println!("{diffuse_rays} rays: {energy:.3} of the light");
        assert!((energy - 1.0).abs() < 0.25, "{diffuse_rays} rays: {energy}");
    }
}

/// The radiance of a mirror is that of what it shows, but for what a grazing view reflects.
#[test]
fn gpu_a_mirror_shows_what_is_above_it() {
    let Some(gpu) = testing::gpu("gpu_a_mirror_shows_what_is_above_it") else { return };
    let mirror = Material { metallic: 1.0, perceptual_roughness: 0.0, ..matt(0.8) };
    let lamp = Material { emissive: Vec3::new(3.0, 2.0, 1.0), ..matt(0.0) };
    let floor = quad(0, Vec3::ZERO, 10.0 * Vec3::X, -10.0 * Vec3::Z);
    let ceiling = quad(1, 2.0 * Vec3::Y, 10.0 * Vec3::X, 10.0 * Vec3::Z);
    let scene = scene_of(vec![floor, ceiling], vec![mirror, lamp]);
    // Looking down: Fresnel's term stays at its least.
    let camera = looking([0.0, 1.5, 0.1], [0.0, 0.0, 0.0]);
    for tracer in tracers(gpu) {
        let deep_images = DeepImageSettings { supersampling: 2, ..DeepImageSettings::default() };
        let found = picture(gpu, Settings { deep_images, ..settings(sampled(*tracer)) }, &scene, &camera);
        let expected = 0.8 * Vec3::new(3.0, 2.0, 1.0);
        let mean = found.iter().copied().sum::<Vec3>() / found.len() as f32;
        // Deep images have holes.
        let most = if is_exact(*tracer) { 2e-3 } else { 0.02 };
        assert!((mean / expected - 1.0).abs().max_element() < most, "{tracer}: {mean}");
    }
}

/// A closed box that shines evenly: every surface receives the same from everywhere.
#[test]
fn gpu_a_closed_box_that_shines_sends_each_bounce() {
    let Some(gpu) = testing::gpu("gpu_a_closed_box_that_shines_sends_each_bounce") else { return };
    let scene = closed_box(Material { emissive: Vec3::ONE, ..matt(0.5) });
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    for tracer in tracers(gpu) {
        let deep_images = DeepImageSettings { resolution: 128, ..DeepImageSettings::default() };
        let found = picture(gpu, Settings { deep_images, ..settings(sampled(*tracer)) }, &scene, &camera);
        // Its own emission, half of it from everywhere, and half of that which was reflected once.
        let off = (mean(&found) / 1.75 - 1.0).abs();
        let most = if is_exact(*tracer) { 0.01 } else { 0.03 };
        assert!(off < most, "{tracer}: {}", mean(&found));
    }
}

/// By the path tracer.
fn traced(scene: &Scene, camera: &Camera, max_depth: u32, samples: u64) -> Vec<Vec3> {
    let settings = TracerSettings {
        integrator: Integrator::Path,
        max_depth,
        attenuation: Attenuation::Physical,
        range_threshold: 1e-6,
        light_choice: LightChoice::Uniform,
        ..TracerSettings::default()
    };
    let mut film = Film::new(SIZE.x as usize, SIZE.y as usize).unwrap();
    Tracer::new(scene, settings).unwrap().render(camera, &mut film, samples);
    film.mean().iter().map(|pixel| Vec3::from(*pixel)).collect()
}

/// Truth: paths of up to three segments through exact triangles. Bounds are about a quarter above what was measured.
#[test]
fn gpu_one_bounce_is_the_path_tracers() {
    let Some(gpu) = testing::gpu("gpu_one_bounce_is_the_path_tracers") else { return };
    let scene = cornell();
    let camera = scene.cameras[0].clone();
    let (direct, one_bounce) = (traced(&scene, &camera, 2, 192), traced(&scene, &camera, 3, 192));
    // Edges are drawn with one sample in one picture and many in the other, with or without the bounce: it is what is compared.
    let alone = picture(gpu, Settings { indirect: Indirect::None, ..settings(Sampled::default()) }, &scene, &camera);
    let bounce = |whole: &[Vec3], part: &[Vec3]| whole.iter().zip(part).map(|(a, b)| *a - *b).collect::<Vec<Vec3>>();
    let truth = bounce(&one_bounce, &direct);
    assert!(mean(&truth) > 0.1 * mean(&direct), "there is little to find");
    for (tracer, most_off, most_biased) in [
        (IndirectTracer::Bvh, 0.2, 0.03),
        (IndirectTracer::AcrossTexels, 0.25, 0.09),
        (IndirectTracer::WithinTexel, 0.25, 0.09),
    ] {
        let deep_images = DeepImageSettings { resolution: 128, ..DeepImageSettings::default() };
        let whole = picture(gpu, Settings { deep_images, ..settings(sampled(tracer)) }, &scene, &camera);
        let found = bounce(&whole, &alone);
        let (off, energy) = (off(&found, &truth), mean(&found) / mean(&truth));
        println!("{tracer}: off by {off:.4}, energy {energy:.4}");
        assert!(off < most_off && (energy - 1.0).abs() < most_biased, "{tracer}: off {off}, energy {energy}");
    }
    // It can fail: white walls send another bounce.
    let mut white = scene.clone();
    white.materials.iter_mut().for_each(|material| material.base_color = Vec4::ONE);
    let of = |indirect| picture(gpu, Settings { indirect, ..settings(Sampled::default()) }, &white, &camera);
    let found = bounce(&of(Indirect::Sampled(sampled(IndirectTracer::Bvh))), &of(Indirect::None));
    assert!(off(&found, &truth) > 0.5, "{}", off(&found, &truth));
}

/// A small lit wall and a dark floor: what arrives is in inverse proportion to the square of the distance.
#[test]
fn gpu_what_moves_sends_its_light_from_where_it_is() {
    let Some(gpu) = testing::gpu("gpu_what_moves_sends_its_light_from_where_it_is") else { return };
    let lamp = Material { emissive: Vec3::splat(50.0), ..matt(0.0) };
    let floor = quad(0, Vec3::ZERO, 4.0 * Vec3::X, -4.0 * Vec3::Z);
    let panel = quad(1, Vec3::Y, 0.5 * Vec3::X, 0.5 * Vec3::Z);
    let mut scene = apart(&scene_of(vec![floor, panel], vec![matt(0.5), lamp]));
    let camera = looking([0.0, 0.6, 0.6], [0.0, 0.0, 0.0]);
    let deep_images = DeepImageSettings { resolution: 128, ..DeepImageSettings::default() };
    for tracer in tracers(gpu) {
        let settings = Settings { deep_images, ..settings(sampled(*tracer)) };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings.clone()).unwrap();
        let mut uploaded = renderer.upload(&scene).unwrap();
        let mut render = |uploaded: &_| {
            let picture = renderer.render(uploaded, &camera, SIZE.x, SIZE.y).unwrap();
            picture.radiance.iter().map(|pixel| Vec4::from(*pixel).truncate()).collect::<Vec<_>>()
        };
        let before = render(&uploaded);
        let at = scene.instances[1].world_from_object;
        scene.instances[1].world_from_object.translation.y += 2.0;
        let other = Renderer::new(&gpu.device, &gpu.queue, settings.clone()).unwrap();
        other.update(&mut uploaded, &scene).unwrap();
        let after = render(&uploaded);
        assert!(mean(&after) < 0.4 * mean(&before), "{tracer}: {} to {}", mean(&before), mean(&after));
        let fresh = picture(gpu, settings, &scene, &camera);
        assert!(off(&after, &fresh) < 0.02, "{tracer}: {}", off(&after, &fresh));
        scene.instances[1].world_from_object = at;
    }
}

/// Errors of pixels that are four apart, where the squares of pixels that share their rays would repeat, are not alike.
#[test]
fn gpu_noise_repeats_nowhere() {
    let Some(gpu) = testing::gpu("gpu_noise_repeats_nowhere") else { return };
    let mut scene = floor(matt(0.5));
    let sky = Environment { width: 16, height: 8, pixels: vec![Vec3::ONE; 128], rotation: 0.0 };
    let card = Material { base_color: Vec4::new(0.0, 0.0, 0.0, 1.0), ..matt(0.0) };
    scene.materials.push(card);
    scene.meshes[0].primitives.push(quad(1, Vec3::new(0.0, 3.0, 0.0), 2.0 * Vec3::X, 2.0 * Vec3::Z));
    scene.environment = Some(sky);
    let camera = looking([0.0, 2.0, 2.0], [0.0, 0.0, 0.0]);
    let of = |diffuse_rays| {
        let sampled = Sampled { diffuse_rays, glossy_rays: 0, ..sampled(IndirectTracer::Bvh) };
        picture(gpu, settings(sampled), &scene, &camera)
    };
    let (few, truth) = (of(5), of(1024));
    let errors: Vec<f64> = few.iter().zip(&truth).map(|(few, truth)| f64::from(few.x / truth.x - 1.0)).collect();
    let (width, height) = (SIZE.x as usize, SIZE.y as usize);
    let power = errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64;
    assert!(power > 1e-4, "{power}: there is no noise");
    for lag in [4, 8, 4 * width, 8 * width] {
        let kept = (0..height - 8).flat_map(|y| (0..width - 8).map(move |x| y * width + x));
        let products: Vec<f64> = kept.map(|i| errors[i] * errors[i + lag]).collect();
        let alike = products.iter().sum::<f64>() / products.len() as f64 / power;
        println!("pixels {lag} apart: {alike:.3}");
        assert!(alike < 0.5, "errors of pixels {lag} apart are alike: {alike}");
    }
}

/// Every pixel traces its rays; those that leave the scene meet nothing, and what is met in the dark asks for no light.
#[test]
fn gpu_rays_are_counted() {
    let Some(gpu) = testing::gpu("gpu_rays_are_counted") else { return };
    let rays = Sampled { diffuse_rays: 3, glossy_rays: 0, ..sampled(IndirectTracer::Bvh) };
    let counted = |scene: &Scene, camera: &Camera| {
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings(rays)).unwrap();
        let uploaded = renderer.upload(scene).unwrap();
        let report = renderer.render(&uploaded, camera, SIZE.x, SIZE.y).unwrap().report;
        let count = |name: &str| report.counters.iter().find(|(known, _)| known == name).expect(name).1;
        ["indirect/rays", "indirect/hits", "indirect/shadow_rays", "indirect/emitter_rays"].map(count)
    };
    let pixels = u64::from(SIZE.x * SIZE.y);
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    let mut room = closed_box(matt(0.5));
    assert_eq!(counted(&room, &camera), [3 * pixels, 3 * pixels, 0, 0]);
    room.lights.push(Light::point(Vec3::ZERO, Vec3::ONE));
    let [rays, hits, shadow_rays, emitter_rays] = counted(&room, &camera);
    // Those to the light that would bring little are left out, some of them.
    assert_eq!([rays, hits, emitter_rays], [3 * pixels, 3 * pixels, 0]);
    assert!(shadow_rays > 3 * pixels / 2 && shadow_rays < 3 * pixels, "{shadow_rays} of {hits}");
    // From a pane before the eye as many again, and one a pixel about the mirror direction.
    let mut paned = room.clone();
    let pane = Material { alpha_mode: AlphaMode::Blend, base_color: Vec4::new(0.5, 0.5, 0.5, 0.5), ..matt(0.5) };
    paned.materials.push(pane);
    paned.meshes[0].primitives.push(quad(1, Vec3::new(0.0, 0.0, 0.5), Vec3::X, Vec3::Y));
    let [rays, hits, shadow_rays, emitter_rays] = counted(&paned, &camera);
    // Those about the mirror direction may start into the pane.
    assert!((6 * pixels..=7 * pixels).contains(&rays), "{rays} of {pixels} pixels");
    assert_eq!([hits, emitter_rays], [rays, 0]);
    assert!(shadow_rays > rays / 2 && shadow_rays < rays, "{shadow_rays} of {rays}");
    // One side shines, dimly beside the light: of three diffuse rays' pixels two look for it, and one of 16 of these rays is traced at least.
    let shining = Material { emissive: Vec3::ONE, ..matt(0.5) };
    room.materials.push(shining);
    room.meshes[0].primitives[2].material = 1;
    let behind = looking([0.0, 0.5, 0.0], [0.0, -1.0, 0.1]);
    let looked = counted(&room, &behind)[3];
    assert!(looked > pixels / 10 && looked <= 2 * pixels, "{looked} of {pixels} pixels");
    let down = looking([0.0, 2.0, 2.0], [0.0, 0.0, 0.0]);
    let [rays, hits, shadow_rays, _] = counted(&floor(matt(0.5)), &down);
    // Of rays over a floor those count that go up, all but a few that leave it at the very edge of the hemisphere.
    assert!(
        rays > 29 * pixels / 10 && rays <= 3 * pixels && (hits, shadow_rays) == (0, 0),
        "{rays} {hits} {shadow_rays}"
    );
}

/// Of segments that would bring little some are traced, and count for those that are not; of closed ones none counts.
#[test]
fn gpu_rays_left_out_change_no_mean() {
    let Some(gpu) = testing::gpu("gpu_rays_left_out_change_no_mean") else { return };
    let renderer = Renderer::new(&gpu.device, &gpu.queue, settings(sampled(IndirectTracer::Bvh))).unwrap();
    let uploaded = renderer.upload(&floor(matt(0.5))).unwrap();
    let mut random = Random::new(8);
    let mut queries = Vec::new();
    for i in 0..64 * 400 {
        // Every fourth passes through the floor; few would bring most.
        let start = Vec3::new(0.1, if i % 4 == 0 { -1.0 } else { 0.5 }, 0.2);
        queries.push(start.extend(random.unit().powi(6)));
        queries.push(Vec3::Y.extend(random.unit()));
    }
    let answers = ask_module(gpu, "testing/roulette", "shares", &uploaded.bindings(), &queries, 2);
    let (mut brought, mut of_all, mut traced, mut open) = (0.0, 0.0, 0, 0);
    for (group, answers) in queries.chunks(2 * 64).zip(answers.chunks(64)) {
        let mean = group.iter().step_by(2).map(|query| query.w).sum::<f32>() / 64.0;
        for (segment, answer) in group.chunks(2).zip(answers) {
            let (weight, is_open) = (segment[0].w, segment[0].y > 0.0);
            assert!(is_open || answer.x == 0.0, "a closed segment counts");
            assert!(!is_open || weight < 1.001 * mean || answer.x == 1.0, "{weight} beside {mean}: {}", answer.x);
            brought += f64::from(weight * answer.x);
            of_all += if is_open { f64::from(weight) } else { 0.0 };
            traced += usize::from(answer.x > 0.0);
            open += usize::from(is_open);
        }
    }
    println!("{traced} of {open} traced, which bring {:.4} of all", brought / of_all);
    assert!(traced < open / 2 && (brought / of_all - 1.0).abs() < 0.01, "{traced} of {open}: {brought} of {of_all}");
}

/// A square lamp of this half edge above the middle of a floor, facing it.
fn lamp_over_floor(half: f32, height: f32, radiance: f32, floor: Material) -> Scene {
    let lamp = Material { emissive: Vec3::splat(radiance), double_sided: false, ..matt(0.0) };
    let ground = quad(0, Vec3::ZERO, 4.0 * Vec3::X, -4.0 * Vec3::Z);
    scene_of(vec![ground, quad(1, height * Vec3::Y, half * Vec3::X, half * Vec3::Z)], vec![floor, lamp])
}

/// A lamp that not one of a thousand rays runs into lights every pixel as it should.
#[test]
fn gpu_a_small_lamp_lights_every_pixel() {
    let Some(gpu) = testing::gpu("gpu_a_small_lamp_lights_every_pixel") else { return };
    let (half, height, radiance) = (0.01f32, 1.0f32, 1000.0f32);
    let scene = lamp_over_floor(half, height, radiance, matt(0.5));
    let camera = looking([0.0, 0.9, 0.1], [0.0, 0.0, 0.0]);
    let few = Sampled { diffuse_rays: 2, glossy_rays: 0, ..sampled(IndirectTracer::Bvh) };
    let found = picture(gpu, settings(few), &scene, &camera);
    // Straight below: L A / d² lux on a surface of albedo 0.5.
    let below = 0.5 / std::f32::consts::PI * radiance * 4.0 * half * half / (height * height);
    let middle = found[SIZE.x as usize * (SIZE.y as usize / 2) + SIZE.x as usize / 2].x;
    assert!((middle / below - 1.0).abs() < 0.03, "{middle}, not {below}");
    assert!(found.iter().all(|pixel| pixel.x > 0.3 * below), "a pixel is dark");
}

/// What is looked for and what is run into is counted once together, on matt and on glossy floors, for large and for small lamps.
#[test]
fn gpu_emission_is_neither_lost_nor_counted_twice() {
    let Some(gpu) = testing::gpu("gpu_emission_is_neither_lost_nor_counted_twice") else { return };
    let camera = looking([0.0, 0.8, 1.6], [0.0, 0.0, 0.0]);
    let metal = Material { metallic: 1.0, perceptual_roughness: 0.35, ..matt(0.8) };
    for (name, floor) in [("matt", matt(0.5)), ("metal", metal)] {
        for (half, height) in [(0.5, 1.0), (0.05, 0.6), (1.0, 0.3)] {
            let scene = lamp_over_floor(half, height, 10.0, floor.clone());
            let truth = traced(&scene, &camera, 2, 256);
            for (diffuse_rays, glossy_rays) in [(16, 16), (32, 8)] {
                let rays = Sampled { diffuse_rays, glossy_rays, ..sampled(IndirectTracer::Bvh) };
                let energy = mean(&picture(gpu, settings(rays), &scene, &camera)) / mean(&truth);
                println!("{name}, lamp of {half} at {height}, {diffuse_rays} and {glossy_rays}: energy {energy:.4}");
                assert!((energy - 1.0).abs() < 0.03, "{name}, lamp of {half} at {height}: {energy}");
            }
        }
    }
}

/// Areas and emission that products of 32 bits do not hold.
#[test]
fn gpu_the_largest_and_brightest_lamps_leave_numbers() {
    let Some(gpu) = testing::gpu("gpu_the_largest_and_brightest_lamps_leave_numbers") else { return };
    let camera = looking([0.0, 0.8, 1.6], [0.0, 0.0, 0.0]);
    let few = Sampled { diffuse_rays: 4, glossy_rays: 2, ..sampled(IndirectTracer::Bvh) };
    for (half, radiance) in [(1e11, 1.0), (0.5, f32::MAX), (1e11, f32::MAX)] {
        let mut scene = lamp_over_floor(half, 1.0, radiance, matt(0.5));
        scene.meshes[0].primitives[1].normals = vec![Vec3::NEG_Y; 4];
        // Another lamp, that the tree has to choose from.
        scene.meshes[0].primitives.push(quad(1, Vec3::new(1.0, 0.5, 0.0), 0.1 * Vec3::X, 0.1 * Vec3::Z));
        let found = picture(gpu, settings(few), &scene, &camera);
        assert!(found.iter().all(|pixel| pixel.is_finite()), "lamp of {half} m and {radiance} nits");
        // Rays pass by a triangle of which a float does not hold a metre; the lamp beside it is not lost over it.
        assert!(mean(&found) > 1e-3, "lamp of {half} m and {radiance} nits: {}", mean(&found));
    }
}

/// What a lamp sends to the walls around is seen on the floor, too.
#[test]
fn gpu_emission_is_reflected_once() {
    let Some(gpu) = testing::gpu("gpu_emission_is_reflected_once") else { return };
    let mut scene = closed_box(matt(0.5));
    let lamp = Material { emissive: Vec3::new(30.0, 20.0, 10.0), double_sided: false, ..matt(0.0) };
    scene.materials.push(lamp);
    scene.meshes[0].primitives.push(quad(1, Vec3::new(0.2, 0.5, 0.0), 0.1 * Vec3::X, 0.1 * Vec3::Z));
    let camera = looking([0.0, -0.2, 0.9], [0.0, -0.9, -1.0]);
    let [direct, truth] = [2, 3].map(|depth| traced(&scene, &camera, depth, 256));
    assert!(mean(&truth) > 1.05 * mean(&direct), "{} of {} is reflected", mean(&truth), mean(&direct));
    for tracer in tracers(gpu) {
        let deep_images = DeepImageSettings { resolution: 128, ..DeepImageSettings::default() };
        let found = picture(gpu, Settings { deep_images, ..settings(sampled(*tracer)) }, &scene, &camera);
        let energy = mean(&found) / mean(&truth);
        println!("{tracer}: energy {energy:.4}");
        let most = if is_exact(*tracer) { 0.03 } else { 0.06 };
        assert!((energy - 1.0).abs() < most, "{tracer}: {energy}");
    }
}

/// Of thousands of lights few reach a hit: those are the ones that it asks.
#[test]
fn gpu_many_short_lights_are_as_right_as_few() {
    let Some(gpu) = testing::gpu("gpu_many_short_lights_are_as_right_as_few") else { return };
    let mut scene = closed_box(matt(0.6));
    let mut random = Random::new(4);
    for _ in 0..3000 {
        let light = Light::point(0.95 * random.point(), 0.01 * (random.point() + 1.5));
        scene.lights.push(Light { range: Some(0.25), ..light });
    }
    scene.lights.push(Light::directional(Vec3::new(0.0, -1.0, 0.1), Vec3::splat(0.5)));
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    let rays = Settings { attenuation: Attenuation::Gltf, ..settings(sampled(IndirectTracer::Bvh)) };
    let truth_settings = TracerSettings { max_depth: 3, ..TracerSettings::default() };
    let traced = |max_depth, samples| {
        let settings = TracerSettings { max_depth, ..truth_settings.clone() };
        let mut film = Film::new(SIZE.x as usize, SIZE.y as usize).unwrap();
        Tracer::new(&scene, settings).unwrap().render(&camera, &mut film, samples);
        film.mean().iter().map(|pixel| Vec3::from(*pixel)).collect::<Vec<_>>()
    };
    let truth = mean(&traced(3, 256)) - mean(&traced(2, 256));
    let alone = picture(gpu, Settings { indirect: Indirect::None, ..rays.clone() }, &scene, &camera);
    let bounce = |settings: Settings| {
        let whole = picture(gpu, settings, &scene, &camera);
        whole.iter().zip(&alone).map(|(a, b)| *a - *b).collect::<Vec<Vec3>>()
    };
    let found = bounce(rays.clone());
    let energy = mean(&found) / truth;
    println!("energy {energy:.4}");
    assert!((energy - 1.0).abs() < 0.03, "{energy}");
    // Noise of few rays: a quarter above what was measured.
    let few = bounce(Settings {
        indirect: Indirect::Sampled(Sampled { diffuse_rays: 4, glossy_rays: 0, ..sampled(IndirectTracer::Bvh) }),
        ..rays
    });
    println!("4 rays off by {:.4}", off(&few, &found));
    assert!(off(&few, &found) < 0.65, "{}", off(&few, &found));
}

/// A pixel that is far above all like it is cut off; none gets more than it had, and what is even stays as it is.
#[test]
fn gpu_the_clamp_takes_single_bright_pixels_alone() {
    let Some(gpu) = testing::gpu("gpu_the_clamp_takes_single_bright_pixels_alone") else { return };
    // A bright card that is unlit, and so found by chance alone.
    let mut scene = floor(matt(0.5));
    scene.materials.push(Material { base_color: Vec4::ONE, unlit: true, ..matt(0.0) });
    scene.meshes[0].primitives.push(quad(1, 2.0 * Vec3::Y, 0.1 * Vec3::X, 0.1 * Vec3::Z));
    scene.sky = Vec3::splat(5e-4);
    let camera = looking([0.0, 0.8, 1.6], [0.0, 0.0, 0.0]);
    let of = |clamp, diffuse_rays| {
        let rays = Sampled { clamp, diffuse_rays, glossy_rays: 0, ..sampled(IndirectTracer::Bvh) };
        picture(gpu, settings(rays), &scene, &camera)
    };
    let brightest = |pixels: &[Vec3]| pixels.iter().map(|pixel| pixel.x).fold(0.0, f32::max);
    let [on, off] = [IndirectClamp::On, IndirectClamp::Off].map(|clamp| of(clamp, 4));
    let kept = mean(&on) / mean(&off);
    println!("brightest {} of {}, energy kept {kept:.4}", brightest(&on), brightest(&off));
    // One ray of 300 finds the card: most of its light is what the clamp is there to take.
    assert!(brightest(&on) < 0.8 * brightest(&off) && kept > 0.25 && kept < 1.0);
    assert!(on.iter().zip(&off).all(|(on, off)| on.x <= off.x));
    // A mean of frames loses less, the more there are; also where the pixels around a bright one are black.
    for sky in [5e-4, 0.0] {
        scene.sky = Vec3::splat(sky);
        let kept = [1, 8, 16, 64].map(|accumulate| {
            let [on, off] = [IndirectClamp::On, IndirectClamp::Off].map(|clamp| {
                let rays = Sampled { clamp, diffuse_rays: 4, glossy_rays: 0, ..sampled(IndirectTracer::Bvh) };
                picture(gpu, Settings { accumulate, ..settings(rays) }, &scene, &camera)
            });
            mean(&on) / mean(&off)
        });
        println!("sky of {sky}: energy kept of 1, 8, 16 and 64 frames {kept:.4?}");
        assert!(kept.is_sorted() && kept[2] > kept[0] + 0.05 && kept[2] > 0.5 && kept[3] > 0.875, "{kept:?}");
    }
    let sky = Scene { sky: Vec3::ONE, ..floor(matt(0.5)) };
    let even = |clamp| picture(gpu, settings(Sampled { clamp, ..sampled(IndirectTracer::Bvh) }), &sky, &camera);
    assert!(self::off(&even(IndirectClamp::On), &even(IndirectClamp::Off)) < 1e-3);
}

/// Light that few pixels find is spread by the filter, and neither lost nor doubled.
#[test]
fn gpu_the_filter_keeps_the_light_of_lone_bright_pixels() {
    let Some(gpu) = testing::gpu("gpu_the_filter_keeps_the_light_of_lone_bright_pixels") else { return };
    // A bright card that is unlit, and so found by chance alone.
    let mut scene = floor(matt(0.5));
    scene.materials.push(Material { base_color: Vec4::ONE, unlit: true, ..matt(0.0) });
    scene.meshes[0].primitives.push(quad(1, 2.0 * Vec3::Y, 0.1 * Vec3::X, 0.1 * Vec3::Z));
    // All of the picture is floor.
    let camera = looking([0.0, 1.5, 0.4], [0.0, 0.0, 0.0]);
    for sky in [0.0, 1e-4, 1e-2] {
        scene.sky = Vec3::splat(sky);
        let [without, with] = [0, 8].map(|filter_radius| {
            let rays = Sampled { diffuse_rays: 4, glossy_rays: 0, filter_radius, ..sampled(IndirectTracer::Bvh) };
            picture(gpu, settings(rays), &scene, &camera)
        });
        let floor = 0.5 * f64::from(sky);
        let lone = without.iter().filter(|pixel| f64::from(pixel.x) > 2.0 * floor).count();
        let kept = (mean(&with) - floor) / (mean(&without) - floor);
        println!("sky of {sky}: {lone} lone bright pixels, of whose light {kept:.4} is kept");
        // What of it falls beyond the picture's edge, or stays this side of it, is known to a tenth.
        assert!(lone > 10 && (kept - 1.0).abs() < 0.1, "sky of {sky}: {kept} of {lone} pixels' light");
    }
}

/// Neither a filter nor coarser starts change what is the same everywhere, and both are nearer to many rays than few rays alone.
#[test]
fn gpu_filter_and_half_resolution_keep_what_is_there() {
    let Some(gpu) = testing::gpu("gpu_filter_and_half_resolution_keep_what_is_there") else { return };
    let camera = looking([0.0, 2.0, 2.0], [0.0, 0.0, 0.0]);
    let scene = Scene { sky: Vec3::ONE, ..floor(matt(0.5)) };
    for resolution in IndirectResolution::ALL.iter().copied() {
        let filtered = Sampled { resolution, filter_radius: 6, ..sampled(IndirectTracer::Bvh) };
        let found = picture(gpu, settings(filtered), &scene, &camera);
        assert!(found.iter().all(|pixel| (*pixel / 0.5 - 1.0).abs().max_element() < 2e-3), "{resolution}");
    }
    let cornell = cornell();
    let camera = &cornell.cameras[0];
    let few = Sampled { diffuse_rays: 4, glossy_rays: 4, filter_radius: 0, ..sampled(IndirectTracer::Bvh) };
    let truth = picture(gpu, settings(Sampled { diffuse_rays: 512, ..sampled(IndirectTracer::Bvh) }), &cornell, camera);
    let noisy = off(&picture(gpu, settings(few), &cornell, camera), &truth);
    for resolution in IndirectResolution::ALL.iter().copied() {
        let filtered = Sampled { resolution, filter_radius: 5, ..few };
        let smooth = off(&picture(gpu, settings(filtered), &cornell, camera), &truth);
        println!("{resolution}: {noisy:.4} unfiltered, {smooth:.4} filtered");
        assert!(smooth < 0.75 * noisy, "{resolution}: {smooth} of {noisy}");
    }
}

/// A mirror shows surfaces of which a few rays find few of the many lights: the filter takes most of that noise, and leaves edges
/// where they are.
#[test]
fn gpu_a_mirror_of_many_lights_is_not_speckled() {
    let Some(gpu) = testing::gpu("gpu_a_mirror_of_many_lights_is_not_speckled") else { return };
    let mut scene = closed_box(matt(0.6));
    scene.materials.push(Material { metallic: 1.0, perceptual_roughness: 0.0, ..matt(0.9) });
    scene.materials.push(matt(0.05));
    // The floor is a mirror; two walls are dark.
    scene.meshes[0].primitives[2].material = 1;
    scene.meshes[0].primitives[4].material = 2;
    scene.meshes[0].primitives[0].material = 2;
    // All of the picture is mirror.
    let camera = looking([0.0, -0.2, 0.1], [0.0, -1.0, 0.0]);
    let few = Sampled { diffuse_rays: 1, glossy_rays: 4, ..sampled(IndirectTracer::Bvh) };
    let many = Sampled { glossy_rays: 512, ..few };
    let mut off_by = |lights: usize| {
        let mut random = Random::new(4);
        scene.lights = (0..lights).map(|_| Light::point(0.8 * random.point(), 0.01 * (random.point() + 1.5))).collect();
        let of = |sampled| picture(gpu, settings(sampled), &scene, &camera);
        let truth = of(many);
        [0, 8].map(|filter_radius| off(&of(Sampled { filter_radius, ..few }), &truth))
    };
    let [noisy, smooth] = off_by(300);
    let [without, edges] = off_by(1);
    println!("300 lights: off by {noisy:.4}, filtered {smooth:.4}; one light: {without:.4}, {edges:.4}");
    assert!(smooth < 0.6 * noisy, "{smooth} of {noisy}");
    assert!(edges < 0.05, "{edges}");
}

/// The inside of a closed box is dark, however bright its outside: light leaks through walls that are thinner than what deep
/// images pass over.
#[test]
fn gpu_light_leaks_are_small() {
    let Some(gpu) = testing::gpu("gpu_light_leaks_are_small") else { return };
    let mut scene = closed_box(matt(0.5));
    // Outside, from above: 1000 lx on the roof.
    scene.lights.push(Light::directional(Vec3::new(0.1, -1.0, 0.2), Vec3::splat(1000.0)));
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    for tracer in tracers(gpu) {
        let found = picture(gpu, settings(sampled(*tracer)), &scene, &camera);
        // From radiance to irradiance of surfaces of albedo 0.5.
        let inside = mean(&found) * std::f64::consts::PI / 0.5;
        println!("{tracer}: {inside:.3} lx inside of 1000 outside");
        assert!(inside <= 10.0, "{tracer}: {inside}");
    }
    // It can fail: without its roof.
    scene.meshes[0].primitives.retain(|side| side.positions.iter().any(|corner| corner.y < 0.99));
    assert_eq!(scene.meshes[0].primitives.len(), 5);
    let found = picture(gpu, settings(sampled(IndirectTracer::Bvh)), &scene, &camera);
    let truth = traced(&scene, &camera, 3, 192);
    let inside = mean(&found) * std::f64::consts::PI / 0.5;
    println!("{inside:.2} lx without a roof, energy {:.3}", mean(&found) / mean(&truth));
    assert!(inside > 10.0 && (mean(&found) / mean(&truth) - 1.0).abs() < 0.05, "{inside}, {}", mean(&truth));
}

/// The adapter's own structure meets the triangles that the BVH does: pictures differ where rays graze an edge alone. Masked triangles
/// and solid ones, and each without the other.
#[test]
fn gpu_ray_query_meets_the_triangles_of_the_bvh() {
    let test = "gpu_ray_query_meets_the_triangles_of_the_bvh";
    let Some(gpu) = testing::gpu(test) else { return };
    if !gpu.description.ray_query {
        return testing::left_out(test, "this adapter has no ray query");
    }
    let masked = |mut scene: Scene| {
        scene.materials.iter_mut().for_each(|material| material.alpha_mode = AlphaMode::Mask { cutoff: 0.5 });
        scene
    };
    let half_masked = |mut scene: Scene| {
        let odd = scene.materials.iter_mut().skip(1).step_by(2);
        odd.for_each(|material| material.alpha_mode = AlphaMode::Mask { cutoff: 0.5 });
        scene
    };
    for (name, scene) in [("solid", cornell()), ("masked", masked(cornell())), ("both", half_masked(cornell()))] {
        let of = |tracer| {
            let sampled = Sampled { diffuse_rays: 8, glossy_rays: 4, ..sampled(tracer) };
            picture(gpu, settings(sampled), &scene, &scene.cameras[0])
        };
        let [bvh, ray_query] = [IndirectTracer::Bvh, IndirectTracer::RayQuery].map(of);
        let apart = off(&ray_query, &bvh);
        println!("{name}: apart by {apart:.5} of the mean");
        assert!(apart < 0.005 && mean(&bvh) > 0.0, "{name}: {apart}");
    }
}

#[test]
fn gpu_runs_are_the_same_to_the_bit() {
    let Some(gpu) = testing::gpu("gpu_runs_are_the_same_to_the_bit") else { return };
    let scene = demo("cornell").unwrap();
    let settings = settings(Sampled { diffuse_rays: 4, glossy_rays: 2, ..Sampled::default() });
    let [a, b] = [0, 1].map(|_| picture(gpu, settings.clone(), &scene, &scene.cameras[0]));
    assert!(a == b);
}

#[test]
fn gpu_every_store_gives_the_same_light() {
    let Some(gpu) = testing::gpu("gpu_every_store_gives_the_same_light") else { return };
    let scene = demo("cornell").unwrap();
    let of = |store, depth| {
        let deep_images = DeepImageSettings { store, depth, merge_texels: 0.0, ..DeepImageSettings::default() };
        let settings = Settings { deep_images, ..settings(sampled(IndirectTracer::WithinTexel)) };
        picture(gpu, settings, &scene, &scene.cameras[0])
    };
    let expected = of(DeepStore::LinearArray, DeepDepth::Bits32);
    for (store, depth) in [
        (DeepStore::LinearArray, DeepDepth::Bits16),
        (DeepStore::LinkedList, DeepDepth::Bits32),
        (DeepStore::SortedLinkedList, DeepDepth::Bits32),
    ] {
        // Of surfaces at one depth a linked list finds any.
        let off = off(&of(store, depth), &expected);
        assert!(off < 0.01, "{store}, {depth} bits: {off}");
    }
}

/// Where a pixel shows one surface, samples change nothing; where it shows two, each has its own light.
#[test]
fn gpu_samples_have_the_light_of_their_surfaces() {
    let Some(gpu) = testing::gpu("gpu_samples_have_the_light_of_their_surfaces") else { return };
    // A white floor under a white sky, and a black lid over a part of it whose underside is not seen.
    let floor = quad(0, Vec3::ZERO, 4.0 * Vec3::X, -4.0 * Vec3::Z);
    let lid = quad(1, Vec3::new(-2.0, 0.5, 0.0), 2.0 * Vec3::X, -4.0 * Vec3::Z);
    let black = Material { base_color: Vec4::new(0.0, 0.0, 0.0, 1.0), ..matt(0.0) };
    let scene = Scene { sky: Vec3::ONE, ..scene_of(vec![floor, lid], vec![matt(0.5), black]) };
    let camera = looking([0.3, 6.0, 0.2], [0.0, 0.0, 0.0]);
    let of = |samples| {
        let settings = settings(Sampled { diffuse_rays: 256, ..sampled(IndirectTracer::Bvh) });
        picture(gpu, Settings { samples, ..settings }, &scene, &camera)
    };
    let [one, four] = [Samples::One, Samples::Four].map(of);
    // How much of each pixel is floor.
    let mut shining = scene.clone();
    shining.materials[0] = Material { base_color: Vec4::ONE, unlit: true, ..matt(0.0) };
    let direct = Settings { samples: Samples::Four, ..Settings::direct_light() };
    let share = picture(gpu, direct, &shining, &camera);
    let differing = one.iter().zip(&four).filter(|(a, b)| (**a - **b).abs().max_element() > 1e-3).count();
    let edges = SIZE.y as usize;
    assert!((edges / 4..=3 * edges).contains(&differing), "{differing} pixels differ");
    // The lid sees all of the sky, the floor at its foot half of it: no sample of the floor has the lid's light.
    let (width, height) = (SIZE.x as usize, SIZE.y as usize);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let around = (0..9).map(|i| one[(y + i / 3 - 1) * width + x + i % 3 - 1].x);
            let most = around.fold(0.0, f32::max);
            let most = 1.03 * share[y * width + x].x * most;
            assert!(four[y * width + x].x <= most + 1e-3, "{x}, {y}: {} of {most}", four[y * width + x]);
        }
    }
}

#[test]
fn gpu_what_does_not_go_together_is_refused() {
    let Some(gpu) = testing::gpu("gpu_what_does_not_go_together_is_refused") else { return };
    let refused = |settings| match Renderer::new(&gpu.device, &gpu.queue, settings) {
        Err(RenderError::Together { needed, .. }) => needed,
        other => panic!("{other:?}"),
    };
    let default = settings(Sampled::default());
    assert!(refused(settings(Sampled { diffuse_rays: 0, ..Sampled::default() })).contains("rays"));
    assert!(refused(settings(Sampled { filter_radius: 65, ..Sampled::default() })).contains("64 pixels"));
    let deep_images = DeepImageSettings { payload: false, ..DeepImageSettings::default() };
    let within = settings(Sampled { tracer: IndirectTracer::WithinTexel, ..Sampled::default() });
    assert!(refused(Settings { deep_images, ..within }).contains("triangles"));
    // Rays of indirect light do not need any of shadows.
    Renderer::new(&gpu.device, &gpu.queue, Settings { shadows: Shadows::None, ..default }).unwrap();
}
