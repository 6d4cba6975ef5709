//! A compressed wide BVH `[Ylitie2017]` over boxes, with bounded build time and depth even if many boxes coincide.
//!
//! 1. `cluster`: a binary tree by locally ordered clustering `[Meister2018]`, with guaranteed progress in each pass.
//! 2. Reinsertion `[Meister2018b]`, by `obvhs`: its cost per box is proportional to the number of overlapping boxes, so
//!    it is skipped if these are thousands.
//! 3. Eight children per node, by `obvhs`. If the tree is deeper than [`MAX_DEPTH`], it is rebuilt by repeatedly
//!    halving the boxes' order along a space-filling curve: a tree of fewer than 2³² boxes then has at most 32 levels.

mod cluster;
#[cfg(test)]
mod tests;

use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh, node::CwBvhNode},
};

use cluster::Search;

/// Maximum number of levels of a tree: the capacity of the traversal stacks.
pub const MAX_DEPTH: usize = 32;

/// Maximum memory of [`build`] per box, bytes. Most of it holds the binary tree, and for each node the costs of eight
/// ways to collapse it.
pub const BYTES_PER_BOX: u64 = 420;

/// Maximum number of boxes per leaf.
const LEAF_SIZE: u32 = 3;

/// Mean number of overlapping boxes from which reinsertion is skipped. Meshes of a million triangles have 2 to 60.
const CROWD: f64 = 1024.0;

/// Build quality of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Takes a tenth to a quarter less time than [`Effort::High`].
    Medium,
    /// Fewest traversal steps per ray.
    High,
}

/// Builds the tree over boxes whose coordinates and their squares are finite. The leaves hold each box's index once.
/// Without boxes the tree has no nodes.
pub fn build(boxes: &[Aabb], effort: Effort) -> CwBvh {
    if boxes.is_empty() {
        return CwBvh::default();
    }
    let order = cluster::order(boxes);
    let (radius, narrow_passes, reinserted) = match effort {
        Effort::Medium => (14, 3, 0.05),
        Effort::High => (24, 2, 0.05),
    };
    let mut binary = cluster::tree(boxes, &order, Search::Near { radius, narrow_passes });
    let crowd = crowding(&binary);
    if crowd < CROWD {
        ReinsertionOptimizer::default().run(&mut binary, reinserted, None);
    } else {
        let count = boxes.len();
        tracing::warn!(
            "on average, {crowd:.0} of {count} triangles overlap each triangle: a ray there intersects all of them"
        );
    }
    let wide = bvh2_to_cwbvh(&binary, LEAF_SIZE, true, false);
    if depth(&wide.nodes) <= MAX_DEPTH {
        return wide;
    }
    bvh2_to_cwbvh(&cluster::tree(boxes, &order, Search::Halves), LEAF_SIZE, true, false)
}

/// Number of levels of a tree; stops counting one above [`MAX_DEPTH`].
fn depth(nodes: &[CwBvhNode]) -> usize {
    let mut depth = 0;
    let mut level: Vec<u32> = if nodes.is_empty() { vec![] } else { vec![0] };
    while !level.is_empty() && depth <= MAX_DEPTH {
        depth += 1;
        let children = |n: &u32| {
            let node = &nodes[*n as usize];
            node.child_base_idx..node.child_base_idx + node.imask.count_ones()
        };
        level = level.iter().flat_map(children).collect();
    }
    depth
}

/// Mean number of boxes that overlap a box. For each box, this is the greatest ratio over its ancestors of the summed
/// areas of the boxes below the ancestor to the ancestor's own area.
fn crowding(tree: &Bvh2) -> f64 {
    let area = |i: usize| f64::from(tree.nodes[i].aabb().half_area());
    // Children come after their parents.
    let mut below: Vec<(f64, f64)> = vec![(0.0, 0.0); tree.nodes.len()];
    for (i, node) in tree.nodes.iter().enumerate().rev() {
        let first = node.first_index as usize;
        below[i] = match node.is_leaf() {
            true => (area(i), 1.0),
            false => (below[first].0 + below[first + 1].0, below[first].1 + below[first + 1].1),
        };
    }
    // Boxes without area, on one line, all count as overlapping.
    let ratio = |i: usize| if area(i) > 0.0 { below[i].0 / area(i) } else { below[i].1 };
    let (mut greatest, mut sum) = (vec![0.0f64; tree.nodes.len()], 0.0);
    for (i, node) in tree.nodes.iter().enumerate() {
        let own = greatest[i].max(ratio(i));
        match node.is_leaf() {
            true => sum += own,
            false => greatest[node.first_index as usize..][..2].fill(own),
        }
    }
    sum / below[0].1
}
