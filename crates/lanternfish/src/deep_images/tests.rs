mod depth_peeling;
mod moving;
mod ray_query;

use glam::{Vec3, Vec4};
use lanternfish_gpu::{Bindings, Frame, Gpu, Profiler, read_back, storage_buffer, storage_buffer_of, testing};
use lanternfish_scene::Scene;

use super::{
    Chunk, DeepFrame, DeepImageBuilder, DeepImages,
    directions::{DirectionSet, Directions},
    trace::{RayTracer, Structure, TracedRay},
    twin::{self, Fragment},
};
use crate::{
    Renderer, Settings,
    gpu_scene::GpuScene,
    settings::{DeepBuilder, DeepImageSettings, Shadows},
    testing::{Random, probe, quad, scene_of},
};

/// Uploads for the BVH, whose triangles the builders draw.
fn upload(gpu: &Gpu, scene: &Scene) -> GpuScene {
    let settings = Settings { shadows: Shadows::Bvh, ..Settings::default() };
    Renderer::new(&gpu.device, &gpu.queue, settings).unwrap().upload(scene).unwrap()
}

fn build(gpu: &Gpu, scene: &GpuScene, settings: DeepImageSettings) -> DeepImages {
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut builder = DeepImageBuilder::new(&gpu.device, settings).unwrap();
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let images = builder.record(&mut frame, scene).unwrap();
    frame.submit();
    images
}

/// A chunk's lists, after checking every invariant: starts ascend from zero to the total, lists are sorted, depths lie in the
/// sphere, every fragment is of a triangle that there is.
fn lists(gpu: &Gpu, chunk: &Chunk) -> Vec<Vec<Fragment>> {
    let count = chunk.list_count() as usize;
    let ends = read_back::<u32>(&gpu.device, &gpu.queue, &chunk.list_ends, count + 2).unwrap();
    let total = chunk.fragments as usize;
    let depths = read_back::<f32>(&gpu.device, &gpu.queue, &chunk.depths, total).unwrap();
    let triangles = read_back::<u32>(&gpu.device, &gpu.queue, &chunk.triangles, total).unwrap();
    assert_eq!((ends[1], ends[count + 1] as usize), (0, total), "starts do not cover the fragments");
    assert!(ends[1..].is_sorted(), "starts do not ascend");
    assert!(
        depths.iter().all(|depth| depth.abs() <= chunk.grid.radius + 1.0 / chunk.grid.texels_per_metre),
        "a depth outside the sphere"
    );
    assert!(triangles.iter().all(|triangle| *triangle < chunk.grid.triangle_count));
    let list = |i: usize| {
        let range = ends[i + 1] as usize..ends[i + 2] as usize;
        let list: Vec<Fragment> = range.map(|f| Fragment { depth: depths[f], triangle: triangles[f] }).collect();
        assert!(list.is_sorted_by(|a, b| a.depth <= b.depth), "list {i} is not sorted: {list:?}");
        list
    };
    (0..count).map(list).collect()
}

/// Triangles in the order in which the device holds them.
fn triangles(gpu: &Gpu, scene: &GpuScene) -> Vec<[Vec3; 3]> {
    let count = scene.traced_triangles as usize;
    let words = read_back::<[f32; 12]>(&gpu.device, &gpu.queue, scene.bvh_triangles().unwrap(), count).unwrap();
    words.iter().map(|w| [Vec3::from_slice(w), Vec3::from_slice(&w[4..]), Vec3::from_slice(&w[8..])]).collect()
}

/// What exact intersection makes of a chunk.
fn exact(gpu: &Gpu, scene: &GpuScene, images: &DeepImages, chunk: &Chunk) -> Vec<Vec<Fragment>> {
    let triangles = triangles(gpu, scene);
    let all = (0..chunk.grid.image_count).flat_map(|image| {
        let axes = images.directions.frame(chunk.grid.first_image + image);
        let frame = DeepFrame { x: axes.x_axis, y: axes.y_axis, z: axes.z_axis, ..DeepFrame::default() };
        twin::image(&chunk.grid, &frame, &triangles)
    });
    all.map(|list| twin::merge(&list, chunk.grid.merge_distance)).collect()
}

fn settings(builder: DeepBuilder) -> DeepImageSettings {
    DeepImageSettings {
        directions: DirectionSet::StacksSlices { stacks: 4, slices: 5 },
        resolution: 48,
        builder,
        ..DeepImageSettings::default()
    }
}

/// Of texels where the exact axis meets something: how many are empty, and how many first surfaces are off by more than a
/// texel. And how many texels hold something where there is nothing.
fn compare(found: &[Vec<Fragment>], exact: &[Vec<Fragment>], texel: f32) -> (f64, f64, f64) {
    let (mut met, mut empty, mut off, mut false_hits) = (0, 0, 0, 0);
    for (found, exact) in found.iter().zip(exact) {
        match (found.first(), exact.first()) {
            (None, Some(_)) => (met, empty) = (met + 1, empty + 1),
            (Some(found), Some(exact)) => {
                met += 1;
                off += usize::from((found.depth - exact.depth).abs() > texel);
            }
            (Some(_), None) => false_hits += 1,
            (None, None) => {}
        }
    }
    let share = |count: usize| count as f64 / met as f64;
    (share(empty), share(off), share(false_hits))
}

#[test]
fn gpu_images_of_a_direction_each_are_exact_but_at_edges() {
    let Some(gpu) = testing::gpu("gpu_images_of_a_direction_each_are_exact_but_at_edges") else { return };
    let scene = upload(gpu, &lanternfish_scene::generate::demo("cornell").unwrap());
    let images = build(gpu, &scene, settings(DeepBuilder::PerDirection));
    for chunk in &images.chunks {
        let (found, exact) = (lists(gpu, chunk), exact(gpu, &scene, &images, chunk));
        let (empty, off, false_hits) = compare(&found, &exact, 1.0 / chunk.grid.texels_per_metre);
        println!("empty {empty:.4}, off {off:.4}, false {false_hits:.4}");
        // A texel's middle that lies on an edge may go either way; half a per cent of them do.
        assert!(empty < 0.005 && off < 0.005 && false_hits < 0.005, "{empty} {off} {false_hits}");
        // It can fail: the lists of another image are something else.
        let shifted: Vec<_> = exact.iter().cycle().skip(48 * 48).take(exact.len()).cloned().collect();
        let (_, off, _) = compare(&found, &shifted, 1.0 / chunk.grid.texels_per_metre);
        assert!(off > 0.2, "{off}");
    }
}

#[test]
fn gpu_a_single_pass_leaves_few_holes() {
    let Some(gpu) = testing::gpu("gpu_a_single_pass_leaves_few_holes") else { return };
    for name in ["cornell", "atrium"] {
        let scene = upload(gpu, &lanternfish_scene::generate::demo(name).unwrap());
        let mut share = Vec::new();
        for supersampling in [1, 2, 3] {
            let images = build(gpu, &scene, DeepImageSettings { supersampling, ..settings(DeepBuilder::SinglePass) });
            let yardstick = build(gpu, &scene, settings(DeepBuilder::PerDirection));
            let (mut empty, mut off, mut false_hits) = (0.0, 0.0, 0.0);
            for (chunk, other) in images.chunks.iter().zip(&yardstick.chunks) {
                let (e, o, f) = compare(&lists(gpu, chunk), &lists(gpu, other), 1.0 / chunk.grid.texels_per_metre);
                (empty, off, false_hits) = (empty + e, off + o, false_hits + f);
            }
            let n = images.chunks.len() as f64;
            let more = images.counts.kept as f64 / yardstick.counts.kept as f64;
            println!(
                "{name} x{supersampling}: empty {:.4}, off {:.4}, false {:.4}; drawn {}, kept {} ({more:.2} of a direction each)",
                empty / n,
                off / n,
                false_hits / n,
                images.counts.drawn,
                images.counts.kept
            );
            share.push(empty / n);
        }
        assert!(share[1] <= share[0] && share[1] < 0.02, "{share:?}");
    }
}

#[test]
fn gpu_lists_are_the_same_whatever_order_the_atomics_ran_in() {
    let Some(gpu) = testing::gpu("gpu_lists_are_the_same_whatever_order_the_atomics_ran_in") else { return };
    let scene = upload(gpu, &lanternfish_scene::generate::demo("atrium").unwrap());
    let once = build(gpu, &scene, settings(DeepBuilder::SinglePass));
    for _ in 0..2 {
        let again = build(gpu, &scene, settings(DeepBuilder::SinglePass));
        assert_eq!(once.counts, again.counts);
        for (a, b) in once.chunks.iter().zip(&again.chunks) {
            assert_eq!(lists(gpu, a), lists(gpu, b));
        }
    }
}

/// 10,000 sheets behind each other: a list as long is sorted, and in no quadratic time.
#[test]
fn gpu_long_lists_are_sorted() {
    let test = "gpu_long_lists_are_sorted";
    let Some(gpu) = testing::gpu(test) else { return };
    if crate::gpu_scene::anisotropy(crate::settings::Anisotropy::Auto, &gpu.device.adapter_info()) == 1 {
        return testing::left_out(
            test,
            "this driver ends a shader's loops after 65,536 turns: 4 of 40,000 fragments are left",
        );
    }
    let sheets = (0..10_000u32).map(|i| {
        // In no order of depth.
        let z = (i * 7919 % 10_000) as f32 / 5_000.0 - 1.0;
        quad(0, Vec3::new(0.0, 0.0, z), 0.4 * Vec3::X, 0.4 * Vec3::Y)
    });
    let scene = upload(gpu, &scene_of(sheets.collect(), vec![Default::default()]));
    let settings = DeepImageSettings {
        directions: DirectionSet::Cube { k: 1 },
        resolution: 4,
        merge_texels: 0.0,
        ..settings(DeepBuilder::SinglePass)
    };
    let images = build(gpu, &scene, settings);
    let longest = images.chunks.iter().flat_map(|chunk| lists(gpu, chunk)).map(|list| list.len()).max().unwrap();
    assert!(longest >= 10_000, "{longest}");
}

#[test]
fn gpu_rays_find_what_the_lists_hold() {
    let Some(gpu) = testing::gpu("gpu_rays_find_what_the_lists_hold") else { return };
    let scene = upload(gpu, &lanternfish_scene::generate::demo("cornell").unwrap());
    let images = build(gpu, &scene, settings(DeepBuilder::SinglePass));
    let chunk = &images.chunks[0];
    let all = lists(gpu, chunk);
    let mut random = Random::new(4);
    let rays: Vec<(Vec3, u32)> = (0..5000)
        .map(|_| {
            let (image, reversed) = images.directions.nearest(random.direction());
            (chunk.grid.center + random.point(), 2 * image + u32::from(reversed))
        })
        .collect();
    let packed: Vec<TracedRay> =
        rays.iter().map(|(p, side)| TracedRay { origin: *p, image_and_side: *side, ..TracedRay::default() }).collect();
    let ray_buffer = storage_buffer_of(&gpu.device, "rays", &packed, wgpu::BufferUsages::empty()).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let tracer = RayTracer::new(&gpu.device).unwrap();
    let distances =
        tracer.record(&mut frame, &scene, Structure::WithinTexel(&images), &ray_buffer, rays.len() as u32).unwrap();
    frame.submit();
    let found = read_back::<f32>(&gpu.device, &gpu.queue, &distances, rays.len()).unwrap();
    let mut hits = 0;
    for ((p, side), found) in rays.iter().zip(found) {
        let axes = images.directions.frame(side / 2);
        let q = *p - chunk.grid.center;
        let texel = |v: f32| ((v * chunk.grid.texels_per_metre + 24.0) as usize).min(47);
        let list = &all[((side / 2) as usize * 48 + texel(q.dot(axes.y_axis))) * 48 + texel(q.dot(axes.x_axis))];
        let expected = twin::trace(list, q.dot(axes.z_axis), side % 2 == 1);
        let near = |expected: f32| (found - expected).abs() < 1e-4;
        assert!(expected.map_or(found < 0.0, near), "{p} {side}: {found}, not {expected:?}");
        hits += usize::from(expected.is_some());
    }
    assert!(hits > 1000, "{hits}");
}

#[test]
fn gpu_the_bvh_finds_the_closest_surface() {
    let Some(gpu) = testing::gpu("gpu_the_bvh_finds_the_closest_surface") else { return };
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
    let buffer = storage_buffer_of(&gpu.device, "rays", &rays, wgpu::BufferUsages::empty()).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let tracer = RayTracer::new(&gpu.device).unwrap();
    let distances = tracer.record(&mut frame, &uploaded, Structure::Bvh, &buffer, rays.len() as u32).unwrap();
    frame.submit();
    let found = read_back::<f32>(&gpu.device, &gpu.queue, &distances, rays.len()).unwrap();
    let (mut hits, mut other) = (0, 0);
    for (ray, found) in rays.iter().zip(found) {
        let expected = exact.nearest(ray.origin.into(), ray.direction.into());
        let same = expected.map_or(found < 0.0, |expected| (found - expected).abs() < 1e-3 * expected.max(1.0));
        other += usize::from(!same);
        hits += usize::from(expected.is_some());
    }
    // Edges, and blended surfaces, which only the path tracer's rays meet.
    assert!(hits > 2000 && other <= 20, "{other} of {hits}");
}

#[test]
fn gpu_the_nearest_direction_is_the_hosts() {
    let Some(gpu) = testing::gpu("gpu_the_nearest_direction_is_the_hosts") else { return };
    let kernel = probe(gpu, "testing/directions", &[], "nearest");
    let mut random = Random::new(2);
    let queries: Vec<Vec4> = (0..20_000).map(|_| random.direction().extend(0.0)).collect();
    for set in [
        DirectionSet::StacksSlices { stacks: 13, slices: 13 },
        DirectionSet::Cube { k: 5 },
        DirectionSet::ZonalEqualArea { count: 169 },
        DirectionSet::ZonalEqualArea { count: 1 },
    ] {
        let directions = Directions::new(set).unwrap();
        let none = wgpu::BufferUsages::empty();
        let axes = storage_buffer_of(&gpu.device, "axes", &directions.gpu_axes(), none).unwrap();
        let cells = storage_buffer_of(&gpu.device, "cells", directions.cells(), none).unwrap();
        let asked = storage_buffer_of(&gpu.device, "queries", &queries, none).unwrap();
        let answers = storage_buffer(&gpu.device, "answers", 16 * queries.len() as u64).unwrap();
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        let bindings = Bindings::new()
            .buffer("queries", &asked)
            .buffer("answers", &answers)
            .buffer("direction_axes", &axes)
            .buffer("direction_cells", &cells);
        frame.dispatch(&kernel, &bindings, [queries.len().div_ceil(64) as u32, 1, 1]);
        frame.submit();
        let found = read_back::<Vec4>(&gpu.device, &gpu.queue, &answers, queries.len()).unwrap();
        for (query, found) in queries.iter().zip(found) {
            let direction = query.truncate();
            let (image, reversed) = directions.nearest(direction);
            let cosine = |image: usize| directions.axes()[image].dot(direction);
            // Between two that are equally near to the last bits, either may be found.
            let tied = (cosine(found.x as usize).abs() - cosine(image as usize).abs()).abs() < 1e-6;
            assert!(
                tied && (found.y == 1.0) == (cosine(found.x as usize) < 0.0),
                "{set:?} {direction}: {found}, not {image}"
            );
            assert!(found.x as u32 != image || (found.y == 1.0) == reversed);
        }
    }
}

/// Rays that are followed from texel to texel end closer to the truth than those that stay in one.
#[test]
fn gpu_rays_across_texels_are_closer_to_the_truth() {
    let Some(gpu) = testing::gpu("gpu_rays_across_texels_are_closer_to_the_truth") else { return };
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
            TracedRay::new(&images, origin, random.direction(), 0.0)
        })
        .collect();
    let tracer = RayTracer::new(&gpu.device).unwrap();
    let buffer = tracer.upload(&gpu.device, &rays).unwrap();
    let median = |structure| {
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        let distances = tracer.record(&mut frame, &uploaded, structure, &buffer, rays.len() as u32).unwrap();
        frame.submit();
        let found = read_back::<f32>(&gpu.device, &gpu.queue, &distances, rays.len()).unwrap();
        let pairs = rays.iter().zip(found);
        let mut errors: Vec<f32> = pairs
            .filter_map(|(ray, found)| {
                let expected = exact.nearest(ray.origin.into(), ray.direction.into())?;
                // A miss is as wrong as can be.
                Some(if found < 0.0 { f32::INFINITY } else { (found - expected).abs() / expected })
            })
            .collect();
        errors.sort_unstable_by(f32::total_cmp);
        errors[errors.len() / 2]
    };
    let (within, across) = (median(Structure::WithinTexel(&images)), median(Structure::AcrossTexels(&images)));
    println!("median error {within} within a texel, {across} across texels");
    assert!(across < 0.4 * within && across < 0.05, "{within} {across}");
}
