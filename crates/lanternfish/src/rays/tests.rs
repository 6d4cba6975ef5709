use lanternfish_gpu::{Frame, Gpu, Profiler, read_back};
use wgpu::{DeviceType, Features};

use super::{RayTracer, TracedRay, Tracer, TracerChoice};
use crate::GpuScene;

/// Distances of rays to their first hits, m.
pub fn distances(gpu: &Gpu, uploaded: &GpuScene, tracer: Tracer, rays: &[TracedRay]) -> Vec<f32> {
    let traced = RayTracer::of(&gpu.device, &[tracer]).unwrap();
    let buffer = traced.upload(&gpu.device, rays).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let actual = traced.record(&mut frame, uploaded, tracer, None, &buffer, rays.len() as u32).unwrap();
    frame.submit();
    read_back(&gpu.device, &gpu.queue, &actual, rays.len()).unwrap()
}

#[test]
fn the_automatic_tracer_is_decided_by_the_kind_of_adapter_and_can_be_overridden() {
    let ray_query = Features::EXPERIMENTAL_RAY_QUERY;
    for (kind, features, expected) in [
        (DeviceType::DiscreteGpu, ray_query, Tracer::RAY_QUERY),
        (DeviceType::IntegratedGpu, ray_query, Tracer::RAY_QUERY),
        (DeviceType::DiscreteGpu, Features::empty(), Tracer::BVH),
        (DeviceType::Cpu, ray_query, Tracer::BVH),
    ] {
        assert_eq!(Tracer::automatic(kind, features), expected, "{kind:?}");
        let resolved = |mut choice: TracerChoice| {
            choice.resolve(expected);
            choice.fixed()
        };
        assert_eq!(resolved(TracerChoice::Auto), expected);
        assert_eq!(resolved(Tracer::RAY_QUERY.into()), Tracer::RAY_QUERY, "a named tracer is not replaced");
    }
    for choice in TracerChoice::all() {
        assert_eq!(choice.name().parse(), Ok(choice));
    }
}
