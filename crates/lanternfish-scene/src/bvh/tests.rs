use std::time::Duration;

use glam::Vec3A;
use obvhs::{
    BvhBuildParams,
    cwbvh::builder::build_cwbvh,
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};

use super::*;

/// A pseudo-random number in 0..1 for each counter, by splitmix64.
fn unit(counter: usize) -> f32 {
    let mut z = (counter as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

fn around(center: Vec3A, half: f32) -> Aabb {
    Aabb::new(center - half, center + half)
}

fn scattered(count: usize) -> Vec<Aabb> {
    let center = |i: usize| 50.0 * Vec3A::new(unit(4 * i), unit(4 * i + 1), unit(4 * i + 2));
    (0..count).map(|i| around(center(i), 0.3 * unit(4 * i + 3))).collect()
}

/// Levels of a binary tree.
fn levels(tree: &Bvh2) -> usize {
    let mut level = vec![0; tree.nodes.len()];
    for (i, node) in tree.nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf()) {
        level[node.first_index as usize] = level[i] + 1;
        level[node.first_index as usize + 1] = level[i] + 1;
    }
    1 + level.into_iter().max().unwrap_or(0)
}

/// Builds a tree with every effort. Asserts that each box is in exactly one leaf and within the boxes of all its ancestors.
fn check(what: &str, boxes: &[Aabb]) {
    for effort in [Effort::Medium, Effort::High] {
        let tree = build(boxes, effort);
        assert!(depth(&tree.nodes) <= MAX_DEPTH, "{what}: {} levels", depth(&tree.nodes));
        let mut seen = tree.primitive_indices.clone();
        seen.sort_unstable();
        assert!(seen.iter().copied().eq(0..boxes.len() as u32), "{what}");
        tree.validate(boxes, false);
    }
}

/// Clustering by the nearest neighbour alone merges one pair of these boxes per pass: as many passes and levels as boxes.
#[test]
fn coincident_boxes_give_few_levels() {
    const COUNT: usize = 30_000;
    let size = |i: usize| i as f32 / COUNT as f32;
    let mut mesh = scattered(COUNT);
    mesh.extend(vec![around(Vec3A::ONE, 1.0); COUNT]);
    let hostile: [(&str, Vec<Aabb>); 6] = [
        ("equal", vec![around(Vec3A::ONE, 1.0); COUNT]),
        ("points", vec![around(Vec3A::ONE, 0.0); COUNT]),
        ("one in another", (0..COUNT).map(|i| around(Vec3A::ZERO, 1.0 + size(i))).collect()),
        ("on a line, ever farther", (0..COUNT).map(|i| around(Vec3A::X * 9e3 * size(i).powi(2), 1e-6)).collect()),
        ("ever larger", (0..250).map(|i| around(Vec3A::X * 1.4f32.powi(i / 4), 0.4 * 1.4f32.powi(i / 4))).collect()),
        ("within a mesh", mesh),
    ];
    for (what, boxes) in hostile {
        let near = Search::Near { radius: 24, narrow_passes: 2 };
        let binary = cluster::tree(&boxes, &cluster::order(&boxes), near);
        assert!(levels(&binary) <= 150, "{what}: {} levels of {} boxes", levels(&binary), boxes.len());
        check(what, &boxes);
    }
}

/// Reinsertion visits all overlapping boxes for each box. It must be skipped for crowds, and only for these.
#[test]
fn crowds_are_distinguished_from_meshes() {
    let of = |boxes: &[Aabb]| {
        crowding(&cluster::tree(boxes, &cluster::order(boxes), Search::Near { radius: 14, narrow_passes: 3 }))
    };
    assert!(of(&scattered(20_000)) < 20.0, "{}", of(&scattered(20_000)));
    assert_eq!(of(&vec![around(Vec3A::ONE, 1.0); 5000]), 5000.0);
    assert_eq!(of(&vec![around(Vec3A::ONE, 0.0); 5000]), 5000.0);
    let nested: Vec<_> = (0..5000).map(|i| around(Vec3A::ZERO, 1.0 + i as f32 / 5000.0)).collect();
    assert!(of(&nested) > CROWD, "{}", of(&nested));
}

/// Halving bounds the depth if the clustered tree is too deep.
#[test]
fn halving_gives_the_minimum_depth() {
    for count in [1, 2, 3, 4, 5, 1000, 1025] {
        let boxes = scattered(count);
        let tree = cluster::tree(&boxes, &cluster::order(&boxes), Search::Halves);
        assert_eq!(levels(&tree), 1 + (count as f64).log2().ceil() as usize, "{count} boxes");
    }
}

/// Without crowds, the clusters are equal to those of the library, whose trees were measured.
#[test]
fn trees_of_meshes_equal_those_of_the_library() {
    for count in [1, 2, 3, 50, 5000] {
        let boxes = scattered(count);
        check("scattered", &boxes);
        let indices = (0..count as u32).collect();
        let theirs = PlocBuilder::new().build(PlocSearchDistance::High, &boxes, indices, SortPrecision::U128, 2);
        let ours = cluster::tree(&boxes, &cluster::order(&boxes), Search::Near { radius: 24, narrow_passes: 2 });
        assert_eq!(ours.nodes.len(), theirs.nodes.len());
        for (ours, theirs) in ours.nodes.iter().zip(&theirs.nodes) {
            assert_eq!((ours.first_index, ours.prim_count), (theirs.first_index, theirs.prim_count));
        }
        let parameters =
            BvhBuildParams { pre_split: false, reinsertion_batch_ratio: 0.05, ..BvhBuildParams::slow_build() };
        let wide = build_cwbvh(&boxes, parameters, &mut Duration::default());
        assert_eq!(build(&boxes, Effort::High).nodes.len(), wide.nodes.len());
    }
    assert!(build(&[], Effort::High).nodes.is_empty());
}
