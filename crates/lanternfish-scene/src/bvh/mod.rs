//! A compressed wide BVH `[Ylitie2017]` over boxes, in bounded time and depth whatever lies on one spot.
//!
//! 1. `cluster`: a binary tree by locally ordered clustering `[Meister2018]`, which always gets on.
//! 2. Reinsertion `[Meister2018b]`, by `obvhs`: it costs as many steps a box as there are boxes around it, so it is left out
//!    where these are thousands.
//! 3. Eight children a node, by `obvhs`. Where that is deeper than [`MAX_DEPTH`], the boxes' order along a space-filling
//!    curve is halved again and again instead: no tree of fewer than 2³² boxes is deeper than 32 levels then.

mod cluster;
#[cfg(test)]
mod tests;

use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh, node::CwBvhNode},
};

use cluster::Search;

/// Most levels of a tree: what the stacks of the walks have room for.
pub const MAX_DEPTH: usize = 32;

/// Memory that [`build`] takes for each box, at most: the binary tree and the costs of eight ways to divide each of its nodes
/// are most of it.
pub const BYTES_PER_BOX: u64 = 420;

/// Most boxes of one leaf.
const LEAF_SIZE: u32 = 3;

/// Boxes in the same place, on average over all boxes, from which reinsertion is left out. Meshes of a million triangles
/// have 2 to 60.
const CROWD: f64 = 1024.0;

/// How much work goes into a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Half as long to build as [`Effort::High`].
    Medium,
    /// Fewest steps a ray.
    High,
}

/// The tree over these boxes, which are finite, of coordinates whose squares are finite. Its leaves hold indices of them, each
/// once. Without boxes it has no nodes.
pub fn build(boxes: &[Aabb], effort: Effort) -> CwBvh {
    if boxes.is_empty() {
        return CwBvh::default();
    }
    let order = cluster::order(boxes);
    let (radius, narrow_passes, reinserted) = match effort {
        Effort::Medium => (14, 3, 0.05),
        Effort::High => (24, 2, 0.2),
    };
    let mut binary = cluster::tree(boxes, &order, Search::Near { radius, narrow_passes });
    let crowd = crowding(&binary);
    if crowd < CROWD {
        ReinsertionOptimizer::default().run(&mut binary, reinserted, None);
    } else {
        let count = boxes.len();
        tracing::warn!(
            "{crowd:.0} of {count} triangles are in the place of one, on average: a ray there meets all of them"
        );
    }
    let wide = bvh2_to_cwbvh(&binary, LEAF_SIZE, true, false);
    if depth(&wide.nodes) <= MAX_DEPTH {
        return wide;
    }
    bvh2_to_cwbvh(&cluster::tree(boxes, &order, Search::Halves), LEAF_SIZE, true, false)
}

/// Levels of a tree; counts no further than one over [`MAX_DEPTH`].
pub fn depth(nodes: &[CwBvhNode]) -> usize {
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

/// Number of boxes that overlap one, on average: of each box, the greatest ratio of the boxes' areas below a node
/// above it to the node's own.
fn crowding(tree: &Bvh2) -> f64 {
    let area = |i: usize| f64::from(tree.nodes[i].aabb().half_area());
    // Children lie behind their parents.
    let mut below: Vec<(f64, f64)> = vec![(0.0, 0.0); tree.nodes.len()];
    for (i, node) in tree.nodes.iter().enumerate().rev() {
        let first = node.first_index as usize;
        below[i] = match node.is_leaf() {
            true => (area(i), 1.0),
            false => (below[first].0 + below[first + 1].0, below[first].1 + below[first + 1].1),
        };
    }
    // Boxes without an area, on one line, count as all in one place.
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
