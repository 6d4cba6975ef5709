//! Rays as the papers have them: the first fragment is hit [Aalund2015, §3.1]; a tolerance of any size [Niessner2010, §3.2].

use lanternfish::{
    gpu_scene::GpuScene,
    rays::{RayTracer, TracedRay},
};
use lanternfish_gpu::{Bindings, Frame, Gpu, Profiler, read_back, storage_buffer_of};

use super::{build, distances, frame_of, lists, settings, upload};
use crate::{
    ACROSS_TEXELS, DeepBuilder, DeepImageSettings, DeepStore,
    deep_images::{DeepImages, Fragment, cpu_reference, directions::DirectionSet},
    testing::{self, Random, probe},
};

const RAYS: usize = 2000;
/// Few: the CPU follows each ray through its image, and any will do.
const SET: DirectionSet = DirectionSet::Cube { k: 1 };

/// Rays from points within the scene.
fn rays(images: &DeepImages) -> Vec<TracedRay> {
    let (grid, mut random) = (&images.chunks[0].grid, Random::new(11));
    let mut ray = || images.ray(grid.center + 0.4 * grid.radius * random.point(), random.direction(), 0.0);
    (0..RAYS).map(|_| ray()).collect()
}

/// The lists of a ray's image.
fn lists_of<'a>(images: &DeepImages, lists: &'a [Vec<Fragment>], ray: &TracedRay) -> &'a [Vec<Fragment>] {
    let texels = images.chunks[0].grid.resolution.pow(2) as usize;
    &lists[(ray.image_and_side / 2) as usize * texels..][..texels]
}

/// Distance and triangle of closest hits within a texel; −1 if there is none.
fn closest_hits(gpu: &Gpu, scene: &GpuScene, images: &DeepImages, rays: &[TracedRay]) -> Vec<[f32; 2]> {
    let kernel = probe(gpu, "testing/closest_hits", &images.settings.fragment_features(), "closest");
    let answered = storage_buffer_of(&gpu.device, "rays", rays, wgpu::BufferUsages::empty()).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let chunk = images.chunks[0].bindings(&images.frames).with(&images.direction_bindings());
    let (own, scene) = (Bindings::new().buffer("answered_rays", &answered), scene.bindings());
    frame.dispatch(&kernel, &scene.with(&own).with(&chunk), [rays.len().div_ceil(64) as u32, 1, 1]);
    frame.submit();
    let vectors = read_back::<[f32; 4]>(&gpu.device, &gpu.queue, &answered, 2 * rays.len()).unwrap();
    vectors.iter().step_by(2).map(|answer| [answer[0], answer[1]]).collect()
}

#[gpu_test]
fn gpu_without_tests_of_triangles_the_first_fragment_is_hit(gpu: &Gpu) {
    let scene = upload(gpu, &lanternfish_scene::generate::demo("atrium").unwrap());
    for store in [DeepStore::LinearArray, DeepStore::SortedLinkedList] {
        let others = [false, true].map(|tests_triangles| {
            let settings = DeepImageSettings {
                directions: SET,
                store,
                tests_triangles,
                merge_texels: 0.0,
                ..settings(DeepBuilder::PerTriangle)
            };
            let images = build(gpu, &scene, settings);
            let (rays, lists) = (rays(&images), lists(gpu, &images, &images.chunks[0]));
            let differs = |(ray, [distance, triangle]): &(&TracedRay, [f32; 2])| {
                let frame = frame_of(&images, ray.image_and_side / 2);
                let expected =
                    cpu_reference::plain(&images.chunks[0].grid, &frame, lists_of(&images, &lists, ray), ray);
                let (depth, hit) = expected.map_or((-1.0, -1.0), |(d, hit)| (d, hit.triangle.unwrap() as f32));
                (depth - distance).abs() > 1e-4 || (hit != *triangle && hit < 0.0)
            };
            rays.iter().zip(closest_hits(gpu, &scene, &images, &rays)).filter(differs).count()
        });
        // Rays within rounding of a texel's border, or of another direction.
        assert!(100 * others[0] < RAYS && 4 * others[1] > RAYS, "{store}: {others:?}");
    }
}

#[gpu_test]
fn gpu_rays_across_texels_have_the_tolerance_of_the_settings(gpu: &Gpu) {
    let scene = upload(gpu, &lanternfish_scene::generate::demo("atrium").unwrap());
    let tracer = RayTracer::new(&gpu.device).unwrap();
    let mut misses = Vec::new();
    for tolerance in [0.0, 0.5, 2.0] {
        let images =
            build(gpu, &scene, DeepImageSettings { directions: SET, tolerance, ..settings(DeepBuilder::PerTriangle) });
        let (rays, lists) = (rays(&images), lists(gpu, &images, &images.chunks[0]));
        let actual = distances(gpu, &tracer, &scene, (ACROSS_TEXELS, Some(&images)), &rays);
        let grid = &images.chunks[0].grid;
        let differing = rays.iter().zip(&actual).filter(|(ray, actual)| {
            let frame = frame_of(&images, ray.image_and_side / 2);
            let expected = cpu_reference::across_texels(grid, &frame, lists_of(&images, &lists, ray), ray);
            let distance = expected.map_or(-1.0, |(distance, _)| distance);
            (distance - **actual).abs() > 1e-4 * grid.radius.max(distance)
        });
        let differing = differing.count();
        assert!(200 * differing <= RAYS, "{tolerance}: {differing}");
        misses.push(actual.iter().filter(|distance| **distance < 0.0).count());
    }
    // "There is a danger that a ray leaks" [Niessner2010, §3.2].
    assert!(misses[0] > misses[1] && misses[1] > misses[2], "{misses:?}");
}
