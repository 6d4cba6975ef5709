//! Animated scenes: images of posed scenes against the path tracer's, and updates on the device against fresh uploads.

use glam::{Affine3A, Vec3, Vec4};
use lanternfish::{
    GpuScene, Renderer, Settings,
    settings::{Attenuation, Shadows, Tracer},
    techniques::Sampled,
};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_metrics::{RelativeError, RgbImage, write_exr};
use lanternfish_papers::{
    Deep, DeepImageSettings, Hbao,
    indirect::{photon_splatting::PhotonSplatting, virtual_lights::VirtualLights},
};
use lanternfish_reference as reference;
use lanternfish_scene::{
    Bounds, Camera, Instance, Light, Material, Mesh, Projection, Scene,
    motion::{
        Animation, Channel, Deformation, DeformedMesh, Influences, Interpolation, Motion, Node, Property, Sampler, Skin,
    },
};

use crate::support::{differing, linear, quad, scene_of};

const SIZE: (u32, u32) = (64, 48);
/// Image size for the samples, pixels.
const POSED: (u32, u32) = (64, 48);
/// Every animated sample.
const SAMPLES: [&str; 12] = [
    "AnimatedCube/AnimatedCube.gltf",
    "AnimatedTriangle/AnimatedTriangle.gltf",
    "AnimatedMorphCube.glb",
    "BoxAnimated.glb",
    "CesiumMan.glb",
    "CesiumMilkTruck.glb",
    "Fox.glb",
    "InterpolationTest.glb",
    "RiggedFigure.glb",
    "RiggedSimple.glb",
    "SimpleMorph/SimpleMorph.gltf",
    "SimpleSkin/SimpleSkin.gltf",
];
/// Fractions of the animation's duration.
const TIMES: [f32; 5] = [0.0, 0.21, 0.45, 0.7, 0.93];
/// Those of [`TIMES`] at which images are compared with the ground truth.
const TRACED: [f32; 2] = [0.21, 0.45];

/// A camera that sees the scene at all times, and lights around it. Surfaces have no textures: these do not move, and each renderer filters
/// them differently.
fn staged(mut scene: Scene) -> (Scene, Camera) {
    for material in &mut scene.materials {
        material.base_color_texture = None;
        material.metallic_roughness_texture = None;
        material.normal_texture = None;
        material.occlusion_texture = None;
        material.emissive_texture = None;
        material.emissive = Vec3::ZERO;
    }
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
    (scene, Camera::framing(&bounds, 0.8, POSED.0 as f32 / POSED.1 as f32))
}

/// Direct light only.
fn ground_truth(scene: &Scene, camera: &Camera) -> RgbImage {
    let settings = reference::Settings { max_depth: 2, ..reference::Settings::default() };
    let tracer = reference::Tracer::new(scene, settings).unwrap();
    let mut film = reference::Film::new(POSED.into()).unwrap();
    tracer.render(camera, &mut film, 256);
    RgbImage::new(POSED.0 as usize, POSED.1 as usize, film.mean()).unwrap()
}

fn settings() -> Settings {
    Settings::direct_light().with_accumulate(64).with_shadows(Shadows::BVH).with_attenuation(Attenuation::Physical)
}

/// Each animated sample at two times: updated on the device from the rest pose, uploaded again, and path traced.
#[gpu_test(crate::gpu)]
fn gpu_posed_scenes_are_the_path_tracers(gpu: &Gpu) {
    let name = "gpu_posed_scenes_are_the_path_tracers";
    let of = |settings| Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let (mut renderer, mut once) = (of(settings()), of(settings().with_accumulate(1)));
    let mut all = Vec::new();
    for sample in SAMPLES {
        let Some(path) = testing::shared(name, &format!("assets/conformance/{sample}")) else { return };
        let (mut scene, camera) = staged(lanternfish_scene::load(path.to_str().unwrap()).unwrap());
        let duration = scene.motion.animations[0].duration();
        scene.pose_at_rest();
        let mut uploaded = renderer.upload(&scene).unwrap();
        let mut renderings = Vec::new();
        for time in TRACED {
            scene.pose(0, time * duration);
            assert_eq!(scene.validate(), Ok(()), "{sample} at {time}");
            renderer.update(&mut uploaded, &scene).unwrap();
            // One frame suffices to compare the update with the upload; the mean of many is compared with the ground truth.
            let updated = once.render(&uploaded, &camera, POSED.into()).unwrap();
            let fresh = once.upload(&scene).unwrap();
            let fresh = once.render(&fresh, &camera, POSED.into()).unwrap();
            assert_eq!(differing(&updated, &fresh), 0, "{sample} at {time}: the update differs from the upload");
            let actual = renderer.render(&uploaded, &camera, POSED.into()).unwrap();
            let (actual, expected) = (linear(&actual), ground_truth(&scene, &camera));
            if let Ok(folder) = std::env::var("LANTERNFISH_TEST_IMAGES") {
                for (kind, image) in [("actual", &actual), ("ground_truth", &expected)] {
                    let file = format!("{}-{time}-{kind}.exr", sample.replace('/', "-"));
                    write_exr(&std::path::Path::new(&folder).join(file), image).expect("the folder can be written");
                }
            }
            let error = RelativeError::measure(&actual, &expected, 1e-3).unwrap();
            println!(
                "{sample} at {time}: {} lit, median {:.3} %, {:.2} % within 5 %, energy {:+.3} %",
                error.lit_count(),
                100.0 * error.median(),
                100.0 * error.fraction_within(0.05),
                100.0 * (error.energy_ratio() - 1.0)
            );
            renderings.push((actual, expected, error));
        }
        all.push((sample, renderings));
    }
    for (sample, renderings) in &all {
        for (time, (_, _, error)) in TRACED.iter().zip(renderings) {
            // Up to half of the pixels of such small objects are edges, which 64 frames sample at 64 positions.
            assert!(error.lit_count() > 40, "{sample} at {time}: few lit pixels");
            assert!(error.median() < 0.04, "{sample} at {time}: median {}", error.median());
            assert!(error.fraction_within(0.1) > 0.7, "{sample} at {time}: {} within 10 %", error.fraction_within(0.1));
            assert!((error.energy_ratio() - 1.0).abs() < 0.01, "{sample} at {time}: energy {}", error.energy_ratio());
        }
        // Negative control: another moment is another image. The truck's wheels turn alone, and are round.
        let other = RelativeError::measure(&renderings[1].0, &renderings[0].1, 1e-3).unwrap().fraction_within(0.1);
        let own = renderings[1].2.fraction_within(0.1);
        assert!(
            other < own - 0.02 || sample.contains("Truck"),
            "{sample}: insensitive to the motion: {other} and {own}"
        );
    }
}

/// Maximum number of pixels, of `pixels`, that may differ when the device skins vertices instead of the host. None on a software adapter,
/// which rounds like the host; on others an edge, or that of a shadow, may move by one pixel.
fn otherwise_rounded(gpu: &Gpu, pixels: usize) -> usize {
    if gpu.device.adapter_info().device_type == wgpu::DeviceType::Cpu { 0 } else { pixels / 200 }
}

/// Each animated sample at five times: skinning and motion on the device equal a fresh upload.
#[gpu_test(crate::gpu)]
fn gpu_animation_on_the_device_equals_an_upload(gpu: &Gpu) {
    let name = "gpu_animation_on_the_device_equals_an_upload";
    let Some(gpu) = crate::gpu(name) else { return };
    let settings = settings().with_accumulate(1);
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    for sample in SAMPLES {
        let Some(path) = testing::shared(name, &format!("assets/conformance/{sample}")) else { return };
        let (mut scene, camera) = staged(lanternfish_scene::load(path.to_str().unwrap()).unwrap());
        let duration = scene.motion.animations[0].duration();
        scene.pose_at_rest();
        let rest = scene.clone();
        let mut animated = renderer.upload(&rest).unwrap();
        let mut last = None;
        let (mut wrong, mut changed) = (0, 0);
        for time in TIMES {
            renderer.animate(&mut animated, &rest, Some((0, time * duration))).unwrap();
            let actual = renderer.render(&animated, &camera, POSED.into()).unwrap();
            scene.pose(0, time * duration);
            let fresh = renderer.upload(&scene).unwrap();
            let fresh = renderer.render(&fresh, &camera, POSED.into()).unwrap();
            wrong += differing(&actual, &fresh);
            changed += last.replace(actual).map_or(0, |last| differing(&last, &fresh));
        }
        println!("{sample}: {wrong} pixels differ from a fresh upload, {changed} from the image before");
        let pixels = TIMES.len() * (POSED.0 * POSED.1) as usize;
        assert!(wrong <= otherwise_rounded(gpu, pixels), "{sample}: {wrong} of {pixels} pixels");
        // Negative control: another moment is another image. The truck's wheels turn alone, and are round.
        assert!(changed > pixels / 200 || sample.contains("Truck"), "{sample}: {changed} of {pixels} pixels");
    }
}

/// A floor, and above it a sheet with two joints, one of which is animated: half of the sheet folds down with its lamp.
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

/// A skinned surface changes shadows, occlusion and indirect light in the same frame, through every structure that is traced; and an update
/// on the device equals a fresh upload.
#[gpu_test(crate::gpu)]
fn gpu_skinned_surfaces_change_all_lighting(gpu: &Gpu) {
    let (mut scene, camera) = folding();
    let direct = || Settings::direct_light().with_shadows(Shadows::None);
    let deep = |settings: Settings| {
        let images = DeepImageSettings { resolution: 64, payload: true, ..DeepImageSettings::default() };
        settings.with_structure(images)
    };
    let mut requested = vec![
        ("occlusion deep".to_owned(), direct().with_occlusion(Deep { max_distance: Some(2.0), ..Deep::default() })),
        ("occlusion hbao".to_owned(), direct().with_occlusion(Hbao { radius: 2.0, ..Hbao::default() })),
        ("virtual lights".to_owned(), direct().with_indirect(VirtualLights::default())),
    ];
    for tracer in Tracer::in_one_level() {
        if tracer == Tracer::RAY_QUERY && !gpu.description.ray_query {
            testing::left_out("gpu_skinned_surfaces_change_all_lighting", "this adapter has no ray query");
            continue;
        }
        let sampled = Sampled { diffuse_rays: 2, glossy_rays: 1, tracer: tracer.into(), ..Sampled::default() };
        let photons = PhotonSplatting { count: 1024, tracer: tracer.into(), ..PhotonSplatting::default() };
        requested.push((format!("shadows {tracer}"), deep(direct().with_shadows(Shadows::Traced(tracer)))));
        requested.push((format!("sampled {tracer}"), deep(direct().with_indirect(sampled))));
        requested.push((format!("photons {tracer}"), deep(direct().with_indirect(photons))));
    }
    for (name, settings) in requested {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        scene.pose_at_rest();
        let mut uploaded = renderer.upload(&scene).unwrap();
        let shown =
            |renderer: &mut Renderer, uploaded: &GpuScene| renderer.render(uploaded, &camera, SIZE.into()).unwrap();
        let before = shown(&mut renderer, &uploaded);
        scene.pose(0, 1.0);
        renderer.update(&mut uploaded, &scene).unwrap();
        let after = shown(&mut renderer, &uploaded);
        let fresh = renderer.upload(&scene).unwrap();
        assert_eq!(differing(&after, &shown(&mut renderer, &fresh)), 0, "{name}: the update differs from an upload");
        // Skinned by the device only; the host has no posed vertices.
        scene.pose_at_rest();
        let mut animated = renderer.upload(&scene).unwrap();
        renderer.animate(&mut animated, &scene, Some((0, 1.0))).unwrap();
        let wrong = differing(&after, &shown(&mut renderer, &animated));
        assert!(wrong <= otherwise_rounded(gpu, after.radiance.len()), "{name}: {wrong} pixels, bent by the device");
        // On the floor and the wall only: pixels that show the sheet before or after are excluded by their colour.
        let is_grey = |[r, _, b, _]: &[f32; 4]| *r <= 1.8 * *b;
        let pairs = || before.radiance.iter().zip(&after.radiance).filter(|(a, b)| is_grey(a) && is_grey(b));
        let changed = pairs().filter(|(a, b)| (a[1] - b[1]).abs() > 0.02 * a[1].max(b[1])).count();
        println!("{name}: {changed} of {} pixels of floor and wall change", pairs().count());
        assert!(pairs().count() > 2000 && changed > 25, "{name}: {changed} of {}", pairs().count());
        // Negative control: the difference comes from the light, since the last of these frames equals its repetition.
        let again = shown(&mut renderer, &uploaded);
        assert_eq!(differing(&after, &again), 0, "{name}: the same frame again");
    }
}
