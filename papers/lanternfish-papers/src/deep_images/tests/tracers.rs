//! Rays through deep images, through the BVH and by the adapter's ray query.

use glam::Vec3;
use lanternfish::{
    Renderer, Settings,
    rays::{RayTracer, TracedRay},
    settings::{Shadows, Tracer},
};
use lanternfish_gpu::{Frame, Gpu, Profiler};
use lanternfish_scene::Scene;

use super::{build, distances, settings, upload};
use crate::{
    ACROSS_TEXELS, DeepBuilder, DeepImageSettings, WITHIN_TEXEL,
    deep_images::directions::DirectionSet,
    testing::{self, Random},
};

/// Rays from points within a scene.
fn rays_within(scene: &Scene, count: usize, seed: u64, ray: impl Fn(Vec3, Vec3) -> TracedRay) -> Vec<TracedRay> {
    let (bounds, mut random) = (scene.bounds(), Random::new(seed));
    let mut ray = || ray(bounds.center() + 0.3 * random.point() * bounds.size(), random.direction());
    (0..count).map(|_| ray()).collect()
}

/// The scene has alpha-masked surfaces.
#[gpu_test]
fn gpu_exact_tracers_find_the_closest_surface(gpu: &Gpu) {
    let scene = lanternfish_scene::generate::demo("atrium").unwrap();
    let exact = lanternfish_reference::Tracer::new(&scene, lanternfish_reference::Settings::default()).unwrap();
    let rays =
        rays_within(&scene, 4000, 6, |origin, direction| TracedRay { origin, direction, ..TracedRay::default() });
    let expected: Vec<Option<f32>> =
        rays.iter().map(|ray| exact.nearest(ray.origin.into(), ray.direction.into())).collect();
    let tracer = RayTracer::new(&gpu.device).unwrap();
    for through in [Tracer::BVH, Tracer::RAY_QUERY] {
        if through == Tracer::RAY_QUERY && !gpu.description.ray_query {
            return testing::left_out("gpu_exact_tracers_find_the_closest_surface", "this adapter has no ray query");
        }
        let settings = Settings::direct_light().with_shadows(Shadows::Traced(through));
        let uploaded = Renderer::with_engine(&testing::engine(gpu), settings).unwrap().upload(&scene).unwrap();
        let actual = distances(gpu, &tracer, &uploaded, (through, None), &rays);
        let other = |actual: &[f32]| {
            let same = |(expected, actual): &(&Option<f32>, &f32)| {
                expected.map_or(**actual < 0.0, |expected| (**actual - expected).abs() < 1e-3 * expected.max(1.0))
            };
            expected.iter().zip(actual).filter(|pair| !same(pair)).count()
        };
        let hits = expected.iter().flatten().count();
        println!("{through}: {} of {hits} differ", other(&actual));
        // Differences at edges of triangles and of alpha masks, and transparent surfaces, which only the path tracer's rays hit.
        assert!(hits > 2000 && other(&actual) <= 20, "{through}: {} of {hits}", other(&actual));
        // Negative control: other rays.
        assert!(other(&actual[1..]) > 1000, "{through}");
    }
}

#[gpu_test]
fn gpu_a_device_without_ray_query_says_so(gpu: &Gpu) {
    // The same adapter, opened without optional features.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    let adapter = adapters.iter().find(|adapter| adapter.get_info().name == gpu.description.name);
    let gpu = Gpu::open_adapter(adapter.expect("it is open already"), wgpu::Features::empty()).unwrap();

    let scene = upload(&gpu, &lanternfish_scene::generate::demo("cornell").unwrap());
    let tracer = RayTracer::new(&gpu.device).unwrap();
    let rays = tracer.upload(&gpu.device, &[TracedRay::default()]).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let error = tracer.record(&mut frame, &scene, Tracer::RAY_QUERY, None, &rays, 1).unwrap_err();
    assert!(error.to_string().contains("ray queries"), "{error}");
}

/// Rays traced across texels end closer to the ground truth than those that stay in one texel.
#[gpu_test]
fn gpu_rays_across_texels_are_closer_to_the_ground_truth(gpu: &Gpu) {
    let scene = lanternfish_scene::generate::demo("atrium").unwrap();
    let uploaded = upload(gpu, &scene);
    let exact = lanternfish_reference::Tracer::new(&scene, lanternfish_reference::Settings::default()).unwrap();
    let directions = DirectionSet::ZonalEqualArea { count: 60 };
    let images =
        build(gpu, &uploaded, DeepImageSettings { directions, resolution: 128, ..settings(DeepBuilder::SinglePass) });
    let rays = rays_within(&scene, 4000, 8, |origin, direction| images.ray(origin, direction, 0.0));
    let tracer = RayTracer::new(&gpu.device).unwrap();
    let median = |through| {
        let actual = distances(gpu, &tracer, &uploaded, (through, Some(&images)), &rays);
        let pairs = rays.iter().zip(actual);
        let mut errors: Vec<f32> = pairs
            .filter_map(|(ray, actual)| {
                let expected = exact.nearest(ray.origin.into(), ray.direction.into())?;
                // A miss counts as an infinite error.
                Some(if actual < 0.0 { f32::INFINITY } else { (actual - expected).abs() / expected })
            })
            .collect();
        errors.sort_unstable_by(f32::total_cmp);
        errors[errors.len() / 2]
    };
    let (within, across) = (median(WITHIN_TEXEL), median(ACROSS_TEXELS));
    println!("median error {within} within a texel, {across} across texels");
    assert!(across < 0.4 * within && across < 0.05, "{within} {across}");
}
