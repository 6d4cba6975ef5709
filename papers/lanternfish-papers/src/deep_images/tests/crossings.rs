//! Counts of the texels that rays cross and of the fragments that they are compared with [Niessner2010, §3.2, §7].

use lanternfish::{
    rays::{RayTracer, TracedRay},
    settings::Tracer,
};
use lanternfish_gpu::{Frame, Gpu, Profiler, read_back};

use super::{build, distances, frame_of, lists, settings, upload};
use crate::{
    ACROSS_TEXELS, DeepBuilder, DeepImageSettings, DeepSearch, DeepStore, WITHIN_TEXEL,
    deep_images::{DeepImages, cpu_reference},
    rays::RayCounter,
    testing::{self, Random},
};

/// Texels and fragments of each ray.
fn counts(gpu: &Gpu, through: Tracer, images: &DeepImages, rays: &[TracedRay]) -> Vec<[u32; 2]> {
    let uploaded = RayTracer::new(&gpu.device).unwrap().upload(&gpu.device, rays).unwrap();
    let counter = RayCounter::new(&gpu.device, through, &images.settings).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let buffer = counter.record(&mut frame, images, &uploaded, rays.len() as u32).unwrap();
    frame.submit();
    read_back(&gpu.device, &gpu.queue, &buffer, rays.len()).unwrap()
}

#[gpu_test]
fn gpu_crossed_texels_and_compared_fragments_are_the_cpu_references(gpu: &Gpu) {
    let scene = upload(gpu, &lanternfish_scene::generate::demo("cornell").unwrap());
    let images = build(gpu, &scene, settings(DeepBuilder::PerTriangle));
    let lists_of = lists(gpu, &images, &images.chunks[0]);
    let grid = &images.chunks[0].grid;
    let texels = (grid.resolution * grid.resolution) as usize;
    let mut random = Random::new(18);
    let rays: Vec<TracedRay> = (0..1500)
        .map(|_| images.ray(grid.center + 0.5 * grid.radius * random.point(), random.direction(), 0.0))
        .collect();
    let expected = |ray: &TracedRay| {
        let image = ray.image_and_side / 2;
        let first = image as usize * texels;
        cpu_reference::counts(grid, &frame_of(&images, image), &lists_of[first..first + texels], ray)
    };
    let actual = counts(gpu, ACROSS_TEXELS, &images, &rays);
    let differing = rays.iter().zip(&actual).filter(|(ray, actual)| expected(ray) != **actual).count();
    let mean = actual.iter().map(|[texels, _]| f64::from(*texels)).sum::<f64>() / rays.len() as f64;
    println!("{mean:.2} texels a ray, {differing} rays differ");
    // Rays that cross within rounding of a texel's corner, of a surface or of the tolerance: as in combinations.rs.
    assert!(100 * differing <= rays.len() && mean > 2.0, "{differing} of {}, {mean}", rays.len());
    // One list each, whatever the ray.
    assert!(counts(gpu, WITHIN_TEXEL, &images, &rays).iter().all(|[texels, _]| *texels == 1));

    // The same lists stepped through linearly: the same texels, other fragments.
    let linear = DeepImages {
        settings: DeepImageSettings { search: DeepSearch::LinearSteps, ..images.settings },
        ..images.clone()
    };
    let stepped = counts(gpu, ACROSS_TEXELS, &linear, &rays);
    assert!(stepped.iter().zip(&actual).all(|(a, b)| a[0] == b[0]) && stepped != actual);

    // "Ideally, the projection and ray direction are identical: no pixel crossings are necessary" [Niessner2010, §3.2].
    let axes = images.directions.axes().iter();
    let rays: Vec<TracedRay> = axes.map(|axis| images.ray(grid.center + 0.1 * random.point(), *axis, 0.0)).collect();
    // Rays that hit: others go on to the image's border.
    let tracer = RayTracer::new(&gpu.device).unwrap();
    let hits = distances(gpu, &tracer, &scene, (ACROSS_TEXELS, Some(&images)), &rays);
    let actual = counts(gpu, ACROSS_TEXELS, &images, &rays);
    let crossing = actual.iter().zip(&hits).filter(|([texels, _], hit)| **hit >= 0.0 && *texels != 1).count();
    assert!(hits.iter().filter(|hit| **hit >= 0.0).count() > rays.len() / 2, "{hits:?}");
    // An axis that lies within rounding of a border may step over it once.
    assert!(crossing <= 1, "{actual:?}");

    let linked = DeepImageSettings { store: DeepStore::LinkedList, ..DeepImageSettings::default() };
    assert!(RayCounter::new(&gpu.device, Tracer::BVH, &linked).is_err(), "only deep images are counted");
    assert!(RayCounter::new(&gpu.device, ACROSS_TEXELS, &linked).is_ok());
}
