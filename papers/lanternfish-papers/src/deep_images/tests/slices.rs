//! Deep images of moving scenes, with one slice built in each frame.

use glam::{Affine3A, Vec3, Vec4};
use lanternfish::{
    FrameReport, GpuScene, Renderer, Settings, Target, ViewRequest,
    techniques::{IndirectClamp, Sampled},
};
use lanternfish_gpu::{Gpu, faulty_software};
use lanternfish_scene::{Bounds, Instance, Light, Scene, generate::demo};

use crate::{
    DeepImageSettings, DirectionSet, WITHIN_TEXEL,
    testing::{self, apart},
};

const SIZE: [u32; 2] = [40, 30];

fn settings(slices: u32) -> Settings {
    let clamp = IndirectClamp::Off;
    let rays = Sampled { diffuse_rays: 16, glossy_rays: 0, filter_radius: 0, clamp, ..Sampled::default().one_bounce() };
    Settings::direct_light().with_indirect(Sampled { tracer: WITHIN_TEXEL.into(), ..rays }).with_structure(
        DeepImageSettings {
            directions: DirectionSet::ZonalEqualArea { count: 40 },
            resolution: 32,
            slices,
            ..DeepImageSettings::default()
        },
    )
}

fn scene() -> Scene {
    let mut scene = apart(&demo("cornell").unwrap());
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    scene.lights = vec![Light::point(Vec3::new(0.0, 1.2, 0.5), Vec3::new(3.0, 2.5, 2.0))];
    scene
}

/// An instance that stays within the scene's bounds while it rises by 0.4 m: if the bounds grow, all images are built at once.
fn block(scene: &Scene) -> usize {
    let bounds = scene.bounds();
    let is_inside = |instance: &Instance| {
        let mut own = Bounds::EMPTY;
        scene.meshes[instance.mesh].primitives.iter().for_each(|primitive| own.add_bounds(&primitive.bounds()));
        let own = own.transformed(&instance.world_from_object);
        own.size().max_element() > 0.2 && own.size().min_element() > 0.1 && own.max.y + 0.4 < bounds.max.y
    };
    scene.instances.iter().position(is_inside).expect("the box has blocks")
}

/// The image and the report of a complete frame; a frame that lacks capacity is rendered again.
fn complete_frame(gpu: &Gpu, renderer: &mut Renderer, uploaded: &GpuScene, scene: &Scene) -> (Vec<Vec3>, FrameReport) {
    let request = ViewRequest::of_camera(0, &scene.cameras[0], SIZE, Target::Own);
    for _ in 0..8 {
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        let frame = renderer.record(&mut commands, uploaded, &[request]).unwrap();
        gpu.queue.submit([commands.finish()]);
        let frame = renderer.submitted(frame);
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let report = std::iter::from_fn(|| renderer.poll()).find(|report| report.frame == frame).unwrap();
        if report.is_complete {
            let rendering = renderer.read(frame).unwrap().remove(0);
            return (rendering.radiance.iter().map(|pixel| Vec4::from(*pixel).truncate()).collect(), report);
        }
    }
    panic!("no frame is complete");
}

fn age(report: &FrameReport) -> Option<u64> {
    report.counters.iter().find(|(name, _)| name == "deep_images/age").map(|(_, age)| *age)
}

/// The age of images is at most the number of slices; once nothing moves, they equal those that are built at once.
#[test]
fn gpu_slices_of_deep_images_are_built_one_per_frame() {
    const TEST: &str = "gpu_slices_of_deep_images_are_built_one_per_frame";
    let Some(gpu) = testing::gpu(TEST) else { return };
    if faulty_software(&gpu.device.adapter_info()) {
        testing::left_out(TEST, "this driver would lose triangles");
        return;
    }
    let slices = 4;
    let scene = scene();
    let of = |slices| {
        let renderer = Renderer::with_engine(&testing::engine(gpu), settings(slices)).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        (renderer, uploaded)
    };
    let ((mut at_once, mut all), (mut by_slices, mut sliced)) = (of(1), of(slices));
    let request = ViewRequest::of_camera(0, &scene.cameras[0], SIZE, Target::Own);
    by_slices.ready(&sliced, &[request]).unwrap();
    let (first, report) = complete_frame(gpu, &mut at_once, &all, &scene);
    assert_eq!(age(&report), None);
    let (same, report) = complete_frame(gpu, &mut by_slices, &sliced, &scene);
    assert_eq!(age(&report), Some(0));
    assert!(first == same, "the images depend on the number of slices");
    let inside = block(&scene);
    let rest = scene.instances[inside].world_from_object;
    let (mut ages, mut apart) = (Vec::new(), 0.0_f32);
    for step in 1..=6 {
        let moved = [(inside, Affine3A::from_translation(0.04 * step as f32 * Vec3::Y) * rest)];
        at_once.move_instances(&mut all, &moved).unwrap();
        by_slices.move_instances(&mut sliced, &moved).unwrap();
        let (ground_truth, _) = complete_frame(gpu, &mut at_once, &all, &scene);
        let (rendering, report) = complete_frame(gpu, &mut by_slices, &sliced, &scene);
        ages.push(age(&report).unwrap());
        let sum = |pixels: &[Vec3]| pixels.iter().map(|pixel| pixel.element_sum()).sum::<f32>();
        apart = apart.max((sum(&rendering) / sum(&ground_truth) - 1.0).abs());
    }
    println!("ages {ages:?}, light off by {apart:.4} at most");
    assert!(ages.iter().all(|age| (1..u64::from(slices)).contains(age)) && apart < 0.02, "{ages:?}, {apart}");
    let (ground_truth, _) = complete_frame(gpu, &mut at_once, &all, &scene);
    let rested: Vec<_> = (1..slices).map(|_| complete_frame(gpu, &mut by_slices, &sliced, &scene)).collect();
    let ages: Vec<u64> = rested.iter().map(|(_, report)| age(report).unwrap()).collect();
    assert!(ages[..2].iter().all(|age| *age > 0) && ages[2] == 0, "{ages:?}");
    assert!(
        rested[0].0 != ground_truth && rested[2].0 == ground_truth,
        "the images are not those of the current scene"
    );
    // Images that no longer hold all of the scene are built again at once.
    let outside = [(inside, Affine3A::from_translation(3.0 * Vec3::Y) * rest)];
    at_once.move_instances(&mut all, &outside).unwrap();
    by_slices.move_instances(&mut sliced, &outside).unwrap();
    let (ground_truth, _) = complete_frame(gpu, &mut at_once, &all, &scene);
    let (rendering, report) = complete_frame(gpu, &mut by_slices, &sliced, &scene);
    assert!(age(&report) == Some(0) && rendering == ground_truth, "{:?}", age(&report));
}
