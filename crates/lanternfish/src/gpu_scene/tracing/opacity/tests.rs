//! Micromaps against the texture, read by the shader of the tracers.

use bytemuck::{Pod, Zeroable};
use glam::{Affine2, Vec2, Vec4};
use lanternfish_gpu::{
    ComputeKernel, Gpu, ShaderLibrary,
    testing::{self, Memory},
};
use lanternfish_scene::{Filter, Scene, Wrap};

use super::{
    super::tests::{ANY, masked_scene},
    *,
};
use crate::testing::{Random, edited_library, library, probe_of};

/// As in `testing/masks.wesl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Query {
    barycentrics: Vec2,
    record: u32,
    opacity: u32,
}

/// A device, and the entry point `compare` on it.
type On<'a> = (&'a Gpu, &'a ComputeKernel);

fn kernel(gpu: &Gpu, library: &ShaderLibrary) -> ComputeKernel {
    probe_of(library, gpu, "testing/masks", &[], "compare")
}

/// Results of some points of triangles: the state of the point's subtriangle, whether it is solid by the texture, and for rays.
fn compare((gpu, kernel): On, masks: &[u32], queries: &[Query]) -> Vec<(u32, bool, bool)> {
    let mut memory = Memory::new();
    memory.bind(&["masks"], masks);
    memory.bind(&["queries"], queries);
    memory.bind(&["states"], &vec![0u32; queries.len()]);
    memory.bind(&["solid"], &vec![0u32; queries.len()]);
    memory.run(gpu, kernel, [queries.len().div_ceil(64) as u32, 1, 1]);
    let (states, solid): (Vec<u32>, Vec<u32>) = (memory.get("states"), memory.get("solid"));
    states.into_iter().zip(solid).map(|(state, solid)| (state, solid & 1 > 0, solid & 2 > 0)).collect()
}

/// A masked triangle for each of some images of smooth shapes, with random wraps, filters, transforms, cutoffs and factors.
fn scene(seed: u64, count: usize) -> Scene {
    let mut random = Random::new(seed);
    let wraps = [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge];
    let sizes: Vec<u32> = (0..count).map(|_| random.between(1.0, 70.0) as u32).collect();
    let masks: Vec<_> = (0..count).map(|i| (i, wraps[i % 3], random.between(0.0, 1.0))).collect();
    let mut scene = masked_scene(&sizes, &masks);
    for i in 0..count {
        let image = &mut scene.images[i];
        image.width = random.between(1.0, 70.0) as u32;
        let (phase, steepness) = (random.point(), random.between(1.0, 400.0));
        image.rgba = (0..image.width * image.height)
            .flat_map(|texel| {
                let (x, y) = ((texel % image.width) as f32, (texel / image.width) as f32);
                let wave = (0.1 * x + 6.0 * phase.x).sin() * (0.1 * y + 6.0 * phase.y).sin() + 0.5 * phase.z;
                [0, 0, 0, (128.0 + steepness * wave) as u8]
            })
            .collect();
        scene.samplers[i].wrap_v = wraps[i / 3 % 3];
        scene.samplers[i].mag = if random.unit() < 0.3 { Filter::Nearest } else { Filter::Linear };
        let material = &mut scene.materials[i];
        material.base_color.w = if random.unit() < 0.5 { 1.0 } else { random.between(0.3, 1.0) };
        let scale = Vec2::new(random.between(-2.0, 2.0), random.between(-2.0, 2.0));
        let offset = [0.0, 5.0, 3000.0][i % 7 % 3] * Vec2::new(random.unit(), random.unit());
        let reference = material.base_color_texture.as_mut().unwrap();
        reference.texture_from_uv = Affine2::from_scale_angle_translation(scale, random.between(0.0, 6.0), offset);
        let primitive = &mut scene.meshes[0].primitives[i];
        match i % 4 {
            0 => primitive.colors.iter_mut().for_each(|color| color.w = random.unit()),
            _ => primitive.colors = vec![Vec4::ONE; 3],
        }
    }
    assert_eq!(scene.validate(), Ok(()));
    scene
}

/// Random points of a triangle, and points on the borders of subtriangles.
fn points(random: &mut Random, count: usize) -> impl Iterator<Item = Vec2> {
    (0..count).map(move |i| {
        let [u, v] = [random.unit(), random.unit()];
        let p = if u + v > 1.0 { Vec2::new(1.0 - u, 1.0 - v) } else { Vec2::new(u, v) };
        match i % 4 {
            0 => (p * 32.0).floor() / 32.0,
            1 => Vec2::new((p.x * 32.0).floor() / 32.0, p.y),
            2 => Vec2::new(p.x, 1.0 - p.x),
            _ => p,
        }
    })
}

/// Number of points, of those in decided triangles and subtriangles, and of those where maps and texture differ, over random scenes.
fn counts(on: On, scenes: u64) -> [usize; 3] {
    const POINTS: usize = 120;
    let [mut all, mut decided, mut wrong] = [0; 3];
    for seed in 0..scenes {
        let before = Tracing::new(&scene(seed, 24), ANY);
        let mut after = Tracing { triangles: before.triangles.clone(), masks: before.masks.clone(), ..before };
        after.decide_opacity(ANY);
        let mut random = Random::new(seed + 1000);
        // The decided triangles by their texture before, and the others by their texture and map after.
        let (mut uniform, mut is_solid, mut mixed) = (Vec::new(), Vec::new(), Vec::new());
        for triangle in &before.triangles {
            let now = after.triangles.iter().find(|now| now.source.part == triangle.source.part).map(|now| now.source);
            for barycentrics in points(&mut random, POINTS) {
                let record = triangle.source.record;
                match now.filter(|now| now.record > 0) {
                    Some(now) => mixed.push(Query { barycentrics, record: now.record, opacity: now.opacity }),
                    None => {
                        uniform.push(Query { barycentrics, record, opacity: 0 });
                        is_solid.push(now.is_some());
                    }
                }
            }
        }
        let of_uniform = compare(on, &before.masks, &uniform);
        wrong += of_uniform.iter().zip(is_solid).filter(|((_, by_texture, _), solid)| by_texture != solid).count();
        let of_mixed = compare(on, &after.masks, &mixed);
        wrong += of_mixed.iter().filter(|(_, by_texture, for_rays)| by_texture != for_rays).count();
        decided += uniform.len() + of_mixed.iter().filter(|(state, ..)| *state != 0).count();
        all += uniform.len() + mixed.len();
    }
    [all, decided, wrong]
}

#[gpu_test]
fn gpu_micromaps_agree_with_the_texture_everywhere(gpu: &Gpu) {
    let [all, decided, wrong] = counts((gpu, &kernel(gpu, &library())), 12);
    assert_eq!(wrong, 0, "of {all} points, {decided} of them decided");
    assert!(decided > all / 3 && decided < all, "{decided} of {all} points are decided");
}

/// The comparison detects a wrong subtriangle and a footprint that lacks a row of texels.
#[gpu_test]
fn gpu_faults_of_micromaps_are_noticed(gpu: &Gpu) {
    let file = "gpu_scene/mask";
    for (text, by) in [
        ("2u * column + select", "2u * column + 1u - select"),
        ("row * (2u * count - row)", "row * (2u * count - row - 1u)"),
        ("let low = floor(p)", "let low = floor(p + 2.0)"),
    ] {
        let [all, _, wrong] = counts((gpu, &kernel(gpu, &edited_library(file, text, by))), 3);
        assert!(wrong > 0, "{by}: none of {all} points differs");
    }
}

/// Points of subtriangles that are not empty lie in the box that the BVH is built over, by more than the error of a hit.
#[gpu_test]
fn gpu_boxes_hold_all_that_is_not_empty(gpu: &Gpu) {
    let kernel = kernel(gpu, &library());
    let (mut outside, mut area, mut full_area) = (0, 0.0, 0.0);
    for seed in 0..6 {
        let mut tracing = Tracing::new(&scene(seed, 24), ANY);
        tracing.decide_opacity(ANY);
        let mut random = Random::new(seed + 2000);
        let (mut queries, mut places) = (Vec::new(), Vec::new());
        for triangle in tracing.triangles.iter().filter(|triangle| triangle.source.opacity > 0) {
            let (record, opacity) = (triangle.source.record, triangle.source.opacity);
            let bounds = tracing.bounds(triangle);
            let [a, b, c] = triangle.corners.map(glam::Vec3A::from);
            for barycentrics in points(&mut random, 60) {
                queries.push(Query { barycentrics, record, opacity });
                places.push((a + barycentrics.x * (b - a) + barycentrics.y * (c - a), bounds));
            }
            area += bounds.half_area();
            full_area += Aabb::new(a.min(b).min(c), a.max(b).max(c)).half_area();
        }
        let states = compare((gpu, &kernel), &tracing.masks, &queries);
        for ((p, bounds), _) in places.iter().zip(states).filter(|(_, (state, ..))| *state != Opacity::Empty as u32) {
            outside += usize::from(p.cmplt(bounds.min - 1e-6).any() || p.cmpgt(bounds.max + 1e-6).any());
        }
    }
    assert_eq!(outside, 0);
    assert!(area < 0.95 * full_area, "{area} of {full_area}");
}

#[test]
fn decided_triangles_lose_their_records_and_equal_ones_share_a_map() {
    // A disk of alpha 1. The first triangle lies within, the second outside; the other two, equal, intersect its edge.
    let mut scene = masked_scene(&[64], &[(0, Wrap::ClampToEdge, 0.5); 4]);
    let is_within = |i: u32| Vec2::new((i % 64) as f32 - 32.0, (i / 64) as f32 - 32.0).length() < 20.0;
    scene.images[0].rgba = (0..64 * 64).flat_map(|i| [0, 0, 0, if is_within(i) { 255 } else { 0 }]).collect();
    let corners = [(0.5, 0.1), (0.02, 0.05), (0.5, 0.5), (0.5, 0.5)];
    for (primitive, (at, size)) in scene.meshes[0].primitives.iter_mut().zip(corners) {
        primitive.colors.clear();
        primitive.uv0 = [Vec2::ZERO, Vec2::X, Vec2::Y].map(|corner| at + size * corner).to_vec();
    }
    scene.samplers.iter_mut().for_each(|sampler| *sampler = scene_sampler());
    let mut tracing = Tracing::new(&scene, ANY);
    let (before, triangles) = (tracing.masks.len(), tracing.triangles.clone());
    tracing.decide_opacity(ANY);
    let sources: Vec<_> = tracing.triangles.iter().map(|triangle| triangle.source).collect();
    assert_eq!(sources.iter().map(|source| (source.part, source.record)).collect::<Vec<_>>(), [(0, 0), (2, 1), (3, 2)]);
    assert!(sources[1].opacity > 0 && sources[1].opacity == sources[2].opacity, "{sources:?}");
    let level = sources[1].opacity % (1 << LEVEL_BITS);
    assert_eq!(tracing.masks.len(), before - 2 * RECORD_WORDS + map_words(level));

    // Without space for a map, the texture is read.
    let mut crowded = Tracing { triangles, ..Tracing::new(&scene, ANY) };
    crowded.decide_opacity(4 * before as u64);
    assert!(crowded.triangles.iter().all(|triangle| triangle.source.opacity == 0));
    assert_eq!((crowded.triangles.len(), crowded.record_count), (3, 2));
}

fn scene_sampler() -> lanternfish_scene::Sampler {
    lanternfish_scene::Sampler { wrap_u: Wrap::ClampToEdge, wrap_v: Wrap::ClampToEdge, ..Default::default() }
}

#[test]
fn constants_are_the_shaders() {
    let constant = |name| crate::shaders::constant("gpu_scene/mask", name);
    assert_eq!(constant("LEVEL_BITS"), f64::from(LEVEL_BITS));
    assert_eq!((constant("EMPTY"), constant("SOLID")), (Opacity::Empty as u8 as f64, Opacity::Solid as u8 as f64));
}
