//! Rays through deep images and through the BVH.

use lanternfish::{
    rays::{RayTracer, TracedRay},
    settings::Tracer,
};

use super::{build, distances, settings, upload};
use crate::{
    ACROSS_TEXELS, DeepBuilder, DeepImageSettings, WITHIN_TEXEL,
    deep_images::directions::DirectionSet,
    testing::{self, Random},
};

#[gpu_test]
fn gpu_the_bvh_finds_the_closest_surface(gpu: &Gpu) {
    let scene = lanternfish_scene::generate::demo("atrium").unwrap();
    let uploaded = upload(gpu, &scene);
    let exact = lanternfish_reference::Tracer::new(&scene, lanternfish_reference::Settings::default()).unwrap();
    let mut random = Random::new(6);
    let bounds = scene.bounds();
    let rays: Vec<TracedRay> = (0..4000)
        .map(|_| {
            let origin = bounds.center() + 0.4 * random.point() * bounds.size();
            TracedRay { origin, direction: random.direction(), ..TracedRay::default() }
        })
        .collect();
    let actual = distances(gpu, &RayTracer::new(&gpu.device).unwrap(), &uploaded, (Tracer::BVH, None), &rays);
    let (mut hits, mut other) = (0, 0);
    for (ray, actual) in rays.iter().zip(actual) {
        let expected = exact.nearest(ray.origin.into(), ray.direction.into());
        let same = expected.map_or(actual < 0.0, |expected| (actual - expected).abs() < 1e-3 * expected.max(1.0));
        other += usize::from(!same);
        hits += usize::from(expected.is_some());
    }
    // Differences at edges, and transparent surfaces, which only the path tracer's rays hit.
    assert!(hits > 2000 && other <= 20, "{other} of {hits}");
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
    let mut random = Random::new(8);
    let bounds = scene.bounds();
    let rays: Vec<TracedRay> = (0..8000)
        .map(|_| {
            let origin = bounds.center() + 0.3 * random.point() * bounds.size();
            images.ray(origin, random.direction(), 0.0)
        })
        .collect();
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
