use std::time::Duration;

use glam::Vec3A;
use obvhs::{
    BvhBuildParams,
    cwbvh::builder::build_cwbvh,
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};

use super::*;

/// A number in 0..1 for each counter, by splitmix64.
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
    let place = |i: usize| 50.0 * Vec3A::new(unit(4 * i), unit(4 * i + 1), unit(4 * i + 2));
    (0..count).map(|i| around(place(i), 0.3 * unit(4 * i + 3))).collect()
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

/// Builds it with every effort; every box is in a leaf once, and within all boxes above.
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

/// What clustering by the nearest alone joins one pair a pass: as many passes as boxes, and as many levels.
#[test]
fn a_crowd_on_one_spot_is_built_in_few_levels() {
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

/// Reinsertion looks at every box of a crowd for each: there is none, and there is none missed in a mesh.
#[test]
fn crowds_are_told_from_meshes() {
    let of = |boxes: &[Aabb]| {
        crowding(&cluster::tree(boxes, &cluster::order(boxes), Search::Near { radius: 14, narrow_passes: 3 }))
    };
    assert!(of(&scattered(20_000)) < 20.0, "{}", of(&scattered(20_000)));
    assert_eq!(of(&vec![around(Vec3A::ONE, 1.0); 5000]), 5000.0);
    assert_eq!(of(&vec![around(Vec3A::ONE, 0.0); 5000]), 5000.0);
    let nested: Vec<_> = (0..5000).map(|i| around(Vec3A::ZERO, 1.0 + i as f32 / 5000.0)).collect();
    assert!(of(&nested) > CROWD, "{}", of(&nested));
}

/// Halving is the bound of what is left when all else is too deep.
#[test]
fn halves_are_as_flat_as_can_be() {
    for count in [1, 2, 3, 4, 5, 1000, 1025] {
        let boxes = scattered(count);
        let tree = cluster::tree(&boxes, &cluster::order(&boxes), Search::Halves);
        assert_eq!(levels(&tree), 1 + (count as f64).log2().ceil() as usize, "{count} boxes");
    }
}

/// Where nothing is crowded the clusters are those of the library, whose trees were measured.
#[test]
fn meshes_get_the_trees_of_the_library() {
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
        let parameters = BvhBuildParams { pre_split: false, ..BvhBuildParams::slow_build() };
        let whole = build_cwbvh(&boxes, parameters, &mut Duration::default());
        assert_eq!(build(&boxes, Effort::High).nodes.len(), whole.nodes.len());
    }
    assert!(build(&[], Effort::High).nodes.is_empty());
}
