use glam::Vec3;
use lanternfish_gpu::{Frame, Profiler, read_back, testing};
use lanternfish_scene::Material;

use super::twin;
use crate::{
    Renderer, Settings,
    rays::{RayTracer, TracedRay, Tracer},
    settings::{Indirect, Sampled, Shadows},
    testing::{Random, quad, scene_of},
};

fn renderer(gpu: &lanternfish_gpu::Gpu, tracer: Tracer) -> Renderer {
    let sampled = Sampled { tracer: tracer.into(), filter_radius: 0, ..Sampled::default().one_bounce() };
    let settings = Settings {
        shadows: Shadows::Traced(tracer),
        indirect: Indirect::Sampled(sampled),
        ..Settings::direct_light()
    };
    Renderer::new(&gpu.device, &gpu.queue, settings).unwrap()
}

/// Rays between walls that lie anywhere end where the twin says.
#[test]
fn gpu_new_room_is_its_twin() {
    let Some(gpu) = testing::gpu("gpu_new_room_is_its_twin") else { return };
    let mut random = Random::new(31);
    let walls: Vec<[Vec3; 3]> = (0..24)
        .map(|_| {
            let right = random.direction();
            [4.0 * random.point(), right, right.any_orthonormal_vector()]
        })
        .collect();
    let quads = walls.iter().map(|[center, right, up]| quad(0, *center, *right, *up)).collect();
    let triangles: Vec<[Vec3; 3]> = walls
        .iter()
        .flat_map(|[center, right, up]| {
            let corner = |x: f32, y: f32| center + x * right + y * up;
            let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let uploaded = renderer(gpu, Tracer::NewRoom).upload(&scene_of(quads, vec![Material::default()])).unwrap();
    let new_ray = |_| TracedRay { origin: 4.0 * random.point(), direction: random.direction(), ..TracedRay::default() };
    let rays: Vec<TracedRay> = (0..2000).map(new_ray).collect();
    let tracer = RayTracer::new(&gpu.device).unwrap();
    let buffer = tracer.upload(&gpu.device, &rays).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let found = tracer.record(&mut frame, &uploaded, Tracer::NewRoom, None, &buffer, rays.len() as u32).unwrap();
    frame.submit();
    let found = read_back::<f32>(&gpu.device, &gpu.queue, &found, rays.len()).unwrap();
    let expected: Vec<_> = rays.iter().map(|ray| twin::nearest(&triangles, ray.origin, ray.direction)).collect();
    let met = expected.iter().flatten().count();
    assert!((400..1600).contains(&met), "{met} of {} rays meet a wall", rays.len());
    let is_other = |found: f32, expected: Option<f32>| match expected {
        Some(distance) => (found - distance).abs() > 1e-4 * distance.max(1.0),
        None => found != -1.0,
    };
    // One ray in a thousand may meet an edge.
    let other = found.iter().zip(&expected).filter(|(found, expected)| is_other(**found, **expected)).count();
    assert!(other <= 2, "{other} of {} rays", rays.len());
}

/// Shadows and indirect light through it are those through the BVH.
#[test]
fn gpu_new_room_shades_as_the_bvh_does() {
    let Some(gpu) = testing::gpu("gpu_new_room_shades_as_the_bvh_does") else { return };
    let scene = lanternfish_scene::generate::demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    let [found, expected] = [Tracer::NewRoom, Tracer::Bvh].map(|tracer| {
        let mut renderer = renderer(gpu, tracer);
        let uploaded = renderer.upload(&scene).unwrap();
        renderer.render(&uploaded, &camera, 48, 48).unwrap().radiance
    });
    let is_other = |(a, b): &(&[f32; 4], &[f32; 4])| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > 1e-2 * b.abs());
    let other = found.iter().zip(&expected).filter(is_other).count();
    // A ray that meets two triangles at once may be said to meet either.
    assert!(other <= found.len() / 100, "{other} of {} pixels", found.len());
}
