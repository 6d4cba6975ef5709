//! Depth peeling against a draw for each direction and against exact intersection.

use super::{builders::compare, *};
use crate::{
    deep_images::DeepGrid,
    testing::{self, quad, scene_of},
};

/// Two fractions of all lists: those whose depths differ by more than a thousandth of a texel, and those with the same depths but other
/// triangles.
///
/// Tiles have different positions in their target, so the middle of a texel differs in its last place, and a surface that is seen edge-on
/// amplifies that. This changes which of two touching surfaces comes first and is kept when they are merged.
fn differing(actual: &[Vec<Fragment>], other: &[Vec<Fragment>], grid: &DeepGrid) -> (f64, f64) {
    let near = 1e-3 / grid.texels_per_metre;
    let all = |a: &[Fragment], b: &[Fragment], same: &dyn Fn(&Fragment, &Fragment) -> bool| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b))
    };
    let (mut depths, mut triangles) = (0, 0);
    for (a, b) in actual.iter().zip(other) {
        if !all(a, b, &|a, b| (a.depth - b.depth).abs() <= near) {
            depths += 1;
        } else if !all(a, b, &|a, b| a.triangle == b.triangle) {
            triangles += 1;
        }
    }
    assert_eq!(actual.len(), other.len());
    let fraction = |count: usize| count as f64 / actual.len() as f64;
    (fraction(depths), fraction(triangles))
}

#[gpu_test]
fn gpu_peeled_images_equal_those_of_a_draw_for_each_direction(gpu: &Gpu) {
    for (name, stacks) in [("cornell", 4), ("atrium", 1)] {
        let scene = upload(gpu, &lanternfish_scene::generate::demo(name).unwrap());
        // One draw per layer of the atrium is slow: three images only.
        let settings = |builder| DeepImageSettings {
            directions: DirectionSet::StacksSlices { stacks, slices: 3 },
            // Touching surfaces may come in either order.
            merge_texels: 0.5,
            ..settings(builder)
        };
        let peeled = build(gpu, &scene, settings(DeepBuilder::DepthPeeling));
        let baseline = build(gpu, &scene, settings(DeepBuilder::PerDirection));
        let more = peeled.counts.drawn as f64 / baseline.counts.drawn as f64;
        let (chunk, other) = (&peeled.chunks[0], &baseline.chunks[0]);
        let (actual, expected) = (lists(gpu, &peeled, chunk), lists(gpu, &baseline, other));
        let (depths, triangles) = differing(&actual, &expected, &chunk.grid);
        println!("{name}: {depths:.5} of the lists differ, {triangles:.5} in triangles; {more:.5} times the fragments");
        // Samples on an edge may fall to either side of it, and where two surfaces intersect, each builder rounds its depths differently.
        assert!(depths < 0.006 && triangles < 0.02, "{name}: {depths} {triangles}");
        assert!((more - 1.0).abs() < 1e-3, "{name}: {more}");
        // Negative control: the lists of another image differ.
        let shifted: Vec<_> = expected.iter().cycle().skip(48 * 48).take(actual.len()).cloned().collect();
        let (depths, _) = differing(&actual, &shifted, &chunk.grid);
        assert!(depths > 0.2, "{name}: {depths}");
    }
}

#[gpu_test]
fn gpu_peeled_images_are_exact_except_at_edges(gpu: &Gpu) {
    let scene = upload(gpu, &lanternfish_scene::generate::demo("cornell").unwrap());
    let images = build(gpu, &scene, settings(DeepBuilder::DepthPeeling));
    let chunk = &images.chunks[0];
    let (actual, exact) = (lists(gpu, &images, chunk), exact(gpu, &scene, &images, chunk));
    let (empty, off, false_hits) = compare(&actual, &exact, 1.0 / chunk.grid.texels_per_metre);
    println!("empty {empty:.4}, off {off:.4}, false {false_hits:.4}");
    assert!(empty < 0.005 && off < 0.005 && false_hits < 0.005, "{empty} {off} {false_hits}");
}

/// Images of several atlases equal those of one.
#[gpu_test]
fn gpu_peeling_continues_across_chunks(gpu: &Gpu) {
    let scene = upload(gpu, &lanternfish_scene::generate::demo("cornell").unwrap());
    let single = build(gpu, &scene, settings(DeepBuilder::DepthPeeling));
    let entries = gpu.device.limits().max_storage_buffer_binding_size / 4;
    // Capacity for seven images.
    let fragments_a_texel = entries / (48 * 48 * 7);
    let parts = build(gpu, &scene, DeepImageSettings { fragments_a_texel, ..settings(DeepBuilder::DepthPeeling) });
    let images: Vec<u32> = parts.chunks.iter().map(|chunk| chunk.grid.image_count).collect();
    assert_eq!(images, [7, 7, 6]);
    let actual: Vec<_> = parts.chunks.iter().flat_map(|chunk| lists(gpu, &parts, chunk)).collect();
    let (depths, triangles) = differing(&actual, &lists(gpu, &single, &single.chunks[0]), &single.chunks[0].grid);
    assert!(depths < 0.002 && triangles < 0.02, "{depths} {triangles}");
}

/// All surfaces at one depth are stored.
#[gpu_test]
fn gpu_peeling_keeps_all_surfaces_at_one_depth(gpu: &Gpu) {
    let sheet = quad(0, Vec3::ZERO, 0.4 * Vec3::X, 0.4 * Vec3::Y);
    let scene = upload(gpu, &scene_of(vec![sheet; 5], vec![Default::default()]));
    let settings = |builder| DeepImageSettings {
        directions: DirectionSet::Cube { k: 1 },
        resolution: 16,
        merge_texels: 0.0,
        ..settings(builder)
    };
    let [actual, expected] = [DeepBuilder::DepthPeeling, DeepBuilder::PerDirection]
        .map(|builder| build(gpu, &scene, settings(builder)))
        .map(|images| lists(gpu, &images, &images.chunks[0]));
    assert!(expected.iter().any(|list| list.len() == 5 && list[0].depth == list[4].depth), "no list of five sheets");
    let triangles = |lists: Vec<Vec<Fragment>>| -> Vec<Vec<Option<u32>>> {
        lists.into_iter().map(|list| list.into_iter().map(|fragment| fragment.triangle).collect()).collect()
    };
    assert_eq!(triangles(actual), triangles(expected));
}
