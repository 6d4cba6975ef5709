//! The adapter's ray query against the BVH.

use super::*;
use crate::testing::{self, Random};

#[gpu_test]
fn gpu_ray_query_finds_what_the_bvh_finds(gpu: &Gpu) {
    let test = "gpu_ray_query_finds_what_the_bvh_finds";
    if !gpu.description.ray_query {
        return testing::left_out(test, "this adapter has no ray query");
    }
    // The scene has alpha-masked surfaces.
    let scene = lanternfish_scene::generate::demo("atrium").unwrap();
    let bounds = scene.bounds();
    let mut random = Random::new(10);
    let rays: Vec<TracedRay> = (0..4000)
        .map(|_| {
            let origin = bounds.center() + 0.4 * random.point() * bounds.size();
            TracedRay { origin, direction: random.direction(), offset: 0.01, ..TracedRay::default() }
        })
        .collect();
    let tracer = RayTracer::new(&gpu.device).unwrap();
    let buffer = tracer.upload(&gpu.device, &rays).unwrap();
    let [bvh, ray_query] = [Tracer::BVH, Tracer::RAY_QUERY].map(|through| {
        let settings = Settings::direct_light().with_shadows(Shadows::Traced(through));
        let uploaded = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap().upload(&scene).unwrap();
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        let distances = tracer.record(&mut frame, &uploaded, through, None, &buffer, rays.len() as u32).unwrap();
        frame.submit();
        read_back::<f32>(&gpu.device, &gpu.queue, &distances, rays.len()).unwrap()
    });
    let other = |bvh: &[f32], ray_query: &[f32]| {
        let pairs = bvh.iter().zip(ray_query);
        pairs.filter(|(a, b)| (**a < 0.0) != (**b < 0.0) || (*a - *b).abs() > 1e-3 * a.abs().max(1.0)).count()
    };
    let hits = bvh.iter().filter(|distance| **distance >= 0.0).count();
    println!("{} of {hits} differ", other(&bvh, &ray_query));
    // Edges of triangles and of alpha masks: 0.2 %.
    assert!(hits > 2000 && other(&bvh, &ray_query) <= 8, "{} of {hits}", other(&bvh, &ray_query));
    // Negative control.
    assert!(other(&bvh[1..], &ray_query) > 1000);
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
