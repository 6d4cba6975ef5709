//! Animated scenes: updates on the device against fresh uploads.

use glam::{Affine3A, Vec3, Vec4};
use lanternfish::{
    GpuScene, RenderedImage, Renderer, Settings,
    settings::{Attenuation, Indirect, Shadows, Tracer},
    techniques::Sampled,
    testing::ANIMATED,
};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_papers::{
    ACROSS_TEXELS, Deep, DeepImageSettings, DirectionSet, Hbao, WITHIN_TEXEL,
    indirect::{photon_splatting::PhotonSplatting, virtual_lights::VirtualLights},
};
use lanternfish_scene::{
    Bounds, Camera, Instance, Light, Material, Mesh, Projection, Scene,
    motion::{
        Animation, Channel, Deformation, DeformedMesh, Influences, Interpolation, Motion, Node, Property, Sampler, Skin,
    },
};

use crate::support::{differing, quad, scene_of};

const SIZE: (u32, u32) = (64, 48);
/// Fractions of the animation's duration.
const TIMES: [f32; 5] = [0.0, 0.21, 0.45, 0.7, 0.93];

/// A camera that sees the scene at all times, and lights around it.
fn staged(mut scene: Scene) -> (Scene, Camera) {
    let mut bounds = Bounds::EMPTY;
    let duration = scene.motion.animations[0].duration();
    for time in TIMES {
        scene.pose(0, time * duration);
        bounds.add_bounds(&scene.bounds());
    }
    let (center, size) = (bounds.center(), bounds.size().length());
    let sun = Light::directional(Vec3::new(-0.5, -1.0, -0.7), Vec3::splat(2.0));
    let lamp = Light::point(center + size * Vec3::new(0.6, 0.7, 0.9), Vec3::new(1.0, 0.8, 0.6) * size * size);
    scene.lights = vec![sun, lamp];
    (scene, Camera::framing(&bounds, 0.8, SIZE.0 as f32 / SIZE.1 as f32))
}

fn settings() -> Settings {
    Settings::direct_light().with_shadows(Shadows::BVH).with_attenuation(Attenuation::Physical)
}

/// Maximum number of pixels, of `pixels`, that may differ when the device skins vertices instead of the host. None on a software adapter,
/// which rounds like the host; on others an edge, or that of a shadow, may move by one pixel.
fn otherwise_rounded(gpu: &Gpu, pixels: usize) -> usize {
    if gpu.device.adapter_info().device_type == wgpu::DeviceType::Cpu { 0 } else { pixels / 200 }
}

/// Animated samples at these fractions of the animation's duration: an update from the rest pose, and skinning and motion on the device,
/// equal a fresh upload.
fn check_samples(gpu: &Gpu, test: &str, samples: &[&str], times: &[f32]) {
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings()).unwrap();
    for sample in samples {
        let Some(path) = testing::shared(test, &format!("assets/conformance/{sample}")) else { return };
        let (mut scene, camera) = staged(lanternfish_scene::load(path.to_str().unwrap()).unwrap());
        let duration = scene.motion.animations[0].duration();
        scene.pose_at_rest();
        let rest = scene.clone();
        let [mut posed, mut animated] = [(); 2].map(|()| renderer.upload(&rest).unwrap());
        let mut last = None;
        let (mut wrong, mut changed) = (0, 0);
        for time in times {
            renderer.animate(&mut animated, &rest, Some((0, time * duration))).unwrap();
            scene.pose(0, time * duration);
            assert_eq!(scene.validate(), Ok(()), "{sample} at {time}");
            renderer.update(&mut posed, &scene).unwrap();
            let fresh = renderer.upload(&scene).unwrap();
            let [updated, animated, fresh] =
                [&posed, &animated, &fresh].map(|scene| renderer.render(scene, &camera, SIZE.into()).unwrap());
            assert_eq!(differing(&updated, &fresh), 0, "{sample} at {time}: the update differs from the upload");
            wrong += differing(&animated, &fresh);
            changed += last.replace(animated).map_or(0, |last| differing(&last, &fresh));
        }
        println!("{sample}: {wrong} pixels differ from a fresh upload, {changed} from the image before");
        let pixels = times.len() * (SIZE.0 * SIZE.1) as usize;
        assert!(wrong <= otherwise_rounded(gpu, pixels), "{sample}: {wrong} of {pixels} pixels");
        // Negative control: another moment is another image. The truck's wheels turn alone, and are round.
        assert!(changed > pixels / 200 || sample.contains("Truck"), "{sample}: {changed} of {pixels} pixels");
    }
}

/// A moving node, morphed vertices, and a skin.
#[gpu_test(crate::gpu)]
fn gpu_animation_on_the_device_equals_an_upload(gpu: &Gpu) {
    let samples = ["BoxAnimated.glb", "AnimatedMorphCube.glb", "RiggedSimple.glb"];
    check_samples(gpu, "gpu_animation_on_the_device_equals_an_upload", &samples, &TIMES[1..3]);
}

#[gpu_test(full, crate::gpu)]
fn gpu_every_animation_on_the_device_equals_an_upload(gpu: &Gpu) {
    check_samples(gpu, "gpu_every_animation_on_the_device_equals_an_upload", &ANIMATED, &TIMES);
}

/// A floor, and above it a sheet with two joints, one of which is animated: half of the sheet folds down. The last instance is a block.
fn folding() -> (Scene, Camera) {
    let surface = |base_color: [f32; 3]| Material {
        base_color: Vec3::from(base_color).extend(1.0),
        double_sided: true,
        ..Material::default()
    };
    let mut sheet = quad(1, Vec3::new(0.0, 0.5, 0.0), 0.4 * Vec3::X, -0.3 * Vec3::Z);
    let weights = sheet.positions.iter().map(|p| if p.x > 0.0 { Vec4::Y } else { Vec4::X }).collect();
    sheet.deformation = Some(Box::new(Deformation {
        positions: sheet.positions.clone(),
        normals: sheet.normals.clone(),
        influences: vec![Influences { joints: vec![[0, 1, 0, 0]; 4], weights }],
        ..Deformation::default()
    }));
    let floor = quad(0, Vec3::ZERO, 1.5 * Vec3::X, -1.5 * Vec3::Z);
    let wall = quad(0, Vec3::new(0.0, 0.7, -1.0), 1.5 * Vec3::X, 0.7 * Vec3::Y);
    let mut scene = scene_of(vec![floor, wall], vec![surface([0.7, 0.7, 0.7]), surface([0.8, 0.2, 0.1])]);
    scene.meshes.push(Mesh { name: "sheet".to_owned(), primitives: vec![sheet] });
    scene.instances.push(Instance { mesh: 1, ..scene.instances[0].clone() });
    let block = quad(1, Vec3::new(-0.7, 0.25, 0.2), 0.2 * Vec3::X, -0.2 * Vec3::Z);
    scene.meshes.push(Mesh { name: "block".to_owned(), primitives: vec![block] });
    scene.instances.push(Instance { mesh: 2, ..scene.instances[0].clone() });
    let values = [Vec3::ZERO, Vec3::new(-0.1, -0.35, 0.2)].iter().flat_map(|v| v.to_array()).collect();
    let sampler = Sampler { interpolation: Interpolation::Linear, times: vec![0.0, 1.0], values };
    let fold = Channel { node: 1, property: Property::Translation, sampler: sampler.into() };
    scene.motion = Motion {
        nodes: vec![Node::default(), Node::default()],
        skins: vec![Skin { joints: vec![0, 1], joint_from_object: vec![Affine3A::IDENTITY; 2] }],
        animations: vec![Animation { name: "fold".to_owned(), channels: vec![fold] }],
        meshes: vec![DeformedMesh { mesh: 1, node: 0, skin: Some(0) }],
        ..Motion::default()
    };
    scene.lights = vec![Light::point(Vec3::new(0.4, 1.4, 0.3), Vec3::splat(2.0))];
    scene.sky = Vec3::splat(0.3);
    let projection = Projection::Perspective { fov_y: 0.8, near: 0.05 };
    (scene, Camera::look_at(Vec3::new(0.2, 1.0, 2.4), Vec3::new(0.0, 0.3, 0.0), projection))
}

/// The scene before and after a move of its block and of half of its sheet, with what belongs to another time at rest.
fn moved(mut scene: Scene) -> [Scene; 2] {
    let block = scene.instances.len() - 1;
    let mut after = scene.clone();
    after.pose(0, 1.0);
    after.instances[block].world_from_object = Affine3A::from_translation(Vec3::new(0.1, 0.1, 0.0));
    scene.pose_at_rest();
    [scene, after]
}

/// Green of pixels of the floor and the wall in each of these images. Pixels that show the sheet or the block in one of
/// the first two, before and after the move, are left out by their colour.
fn on_grey<const N: usize>(images: [&RenderedImage; N]) -> Vec<[f32; N]> {
    let is_grey = |[r, _, b, _]: &[f32; 4]| *r <= 1.8 * *b;
    let pixels = (0..images[0].radiance.len()).filter(|i| images[..2].iter().all(|image| is_grey(&image.radiance[*i])));
    pixels.map(|i| images.map(|image| image.radiance[i][1])).collect()
}

/// A skinned surface and an instance that move change this light in the same frame, through every structure that is
/// traced; and an update on the device equals the upload of a renderer that has shown nothing before.
fn check_moves(gpu: &Gpu, requested: Vec<(String, Settings)>) {
    let (scene, camera) = folding();
    let [rest, posed] = moved(scene);
    let engine = testing::engine(gpu);
    let renderer = |settings: &Settings| Renderer::with_engine(&engine, settings.clone()).unwrap();
    let shown = |renderer: &mut Renderer, uploaded: &GpuScene| renderer.render(uploaded, &camera, SIZE.into()).unwrap();
    for (name, settings) in requested {
        let [mut renderer, mut other, mut direct] = [&settings, &settings, &unshadowed()].map(renderer);
        let mut uploaded = renderer.upload(&rest).unwrap();
        let before = shown(&mut renderer, &uploaded);
        renderer.update(&mut uploaded, &posed).unwrap();
        let after = shown(&mut renderer, &uploaded);
        let fresh = other.upload(&posed).unwrap();
        assert_eq!(differing(&after, &shown(&mut other, &fresh)), 0, "{name}: the update differs from an upload");
        // Skinned by the device only; the host has no posed vertices.
        let mut scene = posed.clone();
        scene.pose_at_rest();
        let mut animated = renderer.upload(&scene).unwrap();
        renderer.animate(&mut animated, &scene, Some((0, 1.0))).unwrap();
        let wrong = differing(&after, &shown(&mut renderer, &animated));
        assert!(wrong <= otherwise_rounded(gpu, after.radiance.len()), "{name}: {wrong} pixels, bent by the device");
        // Of what this light adds to unshadowed direct light, or shadows take from it, more than a tenth changes.
        let grey = on_grey([&before, &after, &shown(&mut direct, &fresh)]);
        let is_changed = |[a, b, direct]: &&[f32; 3]| (a - b).abs() > 0.1 * (a - direct).abs().max((b - direct).abs());
        let changed = grey.iter().filter(is_changed).count();
        println!("{name}: {changed} of {} pixels of floor and wall change", grey.len());
        assert!(grey.len() > 2000 && changed > 50, "{name}: {changed} of {}", grey.len());
    }
}

/// Indirect light of the lamp after the move over that before, on floor and wall.
fn gained(gpu: &Gpu, settings: Settings) -> f32 {
    let (scene, camera) = folding();
    let scenes = moved(Scene { sky: Vec3::ZERO, ..scene });
    let images = |settings: Settings| {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        scenes.each_ref().map(|scene| {
            let uploaded = renderer.upload(scene).unwrap();
            renderer.render(&uploaded, &camera, SIZE.into()).unwrap()
        })
    };
    let ([rest, posed], direct) = (images(settings.clone()), images(settings.with_indirect(Indirect::NONE)));
    let grey = on_grey([&rest, &posed, &direct[0], &direct[1]]);
    let sum = |light: usize| grey.iter().map(|pixel| pixel[light] - pixel[light + 2]).sum::<f32>();
    sum(1) / sum(0)
}

fn unshadowed() -> Settings {
    Settings::direct_light().with_shadows(Shadows::None)
}

/// Few deep images, with triangles for hits.
fn images() -> DeepImageSettings {
    let directions = DirectionSet::ZonalEqualArea { count: 40 };
    DeepImageSettings { directions, resolution: 64, payload: true, ..DeepImageSettings::default() }
}

/// Shadows and indirect light through a tracer.
fn through(tracer: Tracer) -> [(String, Settings); 3] {
    let images = images();
    let sampled = Sampled { diffuse_rays: 2, glossy_rays: 1, tracer: tracer.into(), ..Sampled::default() };
    let photons = PhotonSplatting { count: 1024, tracer: tracer.into(), ..PhotonSplatting::default() };
    [
        (format!("shadows {tracer}"), unshadowed().with_shadows(Shadows::Traced(tracer)).with_structure(images)),
        (format!("sampled {tracer}"), unshadowed().with_indirect(sampled).with_structure(images)),
        (format!("photons {tracer}"), unshadowed().with_indirect(photons).with_structure(images)),
    ]
}

#[gpu_test(crate::gpu)]
fn gpu_what_moves_changes_its_light(gpu: &Gpu) {
    let [shadows, ..] = through(ACROSS_TEXELS);
    let [_, sampled, _] = through(WITHIN_TEXEL);
    let occlusion = Deep { max_distance: Some(2.0), ..Deep::default() };
    let occlusion = unshadowed().with_occlusion(occlusion).with_structure(images());
    check_moves(gpu, vec![shadows, sampled, ("occlusion deep".to_owned(), occlusion)]);
}

#[gpu_test(full, crate::gpu)]
fn gpu_what_moves_changes_all_light(gpu: &Gpu) {
    let mut requested = vec![
        ("occlusion hbao".to_owned(), unshadowed().with_occlusion(Hbao { radius: 2.0, ..Hbao::default() })),
        ("virtual lights".to_owned(), unshadowed().with_indirect(VirtualLights::default())),
    ];
    for tracer in Tracer::in_one_level() {
        if tracer == Tracer::RAY_QUERY && !gpu.description.ray_query {
            testing::left_out("gpu_what_moves_changes_all_light", "this adapter has no ray query");
            continue;
        }
        requested.extend(through(tracer));
    }
    check_moves(gpu, requested);
    // A move changes which virtual lights are chosen, and so all pixels a little. Their mean gains what that of rays does.
    let mean = || unshadowed().with_accumulate(32);
    let by_rays = gained(gpu, mean().with_indirect(Sampled::default().one_bounce()));
    let by_lights = gained(gpu, mean().with_indirect(VirtualLights::default()));
    assert!(by_rays > 1.03 && (by_lights / by_rays - 1.0).abs() < 0.02, "{by_lights}, not {by_rays}");
}
