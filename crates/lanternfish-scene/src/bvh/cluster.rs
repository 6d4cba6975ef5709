//! A binary tree by parallel, locally ordered clustering [Meister2018].
//!
//! Boxes are sorted along a space-filling curve. In each pass every cluster selects the neighbour with which their common box
//! is smallest, and two clusters that select each other are merged. If many boxes coincide, each cluster selects the next one and
//! hardly any are merged; the pass then pairs neighbours in order. Each pass therefore leaves at most 15 of 16 clusters, except
//! for the last few, and all passes together do at most 16 times the work of the first.

use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, DEFAULT_MAX_STACK_DEPTH, node::Bvh2Node},
    ploc::morton::morton_encode_u128_unorm,
};
use rayon::prelude::*;

/// A pass that merges less than one pair per this many clusters pairs neighbours in order instead.
const LEAST_FRACTION: usize = 16;
/// Number of clusters up to which a pass may merge a single pair.
const FEW: usize = 64;
/// Minimum number of clusters in a thread's task.
const TASK: usize = 2048;

/// How a cluster's merge partner is selected.
#[derive(Clone, Copy, Debug)]
pub enum Search {
    /// Searches `radius` clusters on either side in order; in the first `narrow_passes` passes one on either side.
    Near { radius: usize, narrow_passes: usize },
    /// Merges neighbours in order without a search, which gives the minimum depth.
    Halves,
}

/// Indices of the boxes along a space-filling curve through their centres.
pub fn order(boxes: &[Aabb]) -> Vec<u32> {
    let bounds = boxes.par_iter().copied().reduce(Aabb::empty, |a, b| a.union(&b));
    // Along an axis without extent, all centres are at 0.
    let extent = bounds.diagonal().as_dvec3().max(glam::DVec3::splat(f64::MIN_POSITIVE));
    let code = |i: u32| {
        let position = (boxes[i as usize].center().as_dvec3() - bounds.min.as_dvec3()) / extent;
        (morton_encode_u128_unorm(position.clamp(glam::DVec3::ZERO, glam::DVec3::ONE)), i)
    };
    let mut codes: Vec<(u128, u32)> = (0..boxes.len() as u32).into_par_iter().map(code).collect();
    codes.par_sort_unstable();
    codes.into_par_iter().map(|(_, i)| i).collect()
}

/// The tree over boxes that are in this [`order`], one per leaf. There must be at least one box.
pub fn tree(boxes: &[Aabb], order: &[u32], search: Search) -> Bvh2 {
    let count = boxes.len();
    let mut nodes = vec![Bvh2Node::default(); 2 * count - 1];
    let mut free = nodes.len();
    let mut clusters: Vec<Bvh2Node> = order.iter().map(|i| Bvh2Node::new(boxes[*i as usize], 1, *i)).collect();
    let mut partners = vec![0; count];
    let mut pass = 0;
    while clusters.len() > 1 {
        let partners = &mut partners[..clusters.len()];
        match search {
            Search::Near { radius, narrow_passes } => {
                choose(&clusters, partners, if pass < narrow_passes { 1 } else { radius });
                if clusters.len() > FEW && pairs(partners) * LEAST_FRACTION < clusters.len() {
                    pair_neighbours(partners);
                }
            }
            Search::Halves => pair_neighbours(partners),
        }
        let mut next = Vec::with_capacity(clusters.len());
        for (i, cluster) in clusters.iter().enumerate() {
            let partner = partners[i] as usize;
            if partner == i || partners[partner] as usize != i {
                next.push(*cluster);
            } else if partner < i {
                // The second of a pair: stores both nodes, so that children come after their parents.
                let first = clusters[partner];
                free -= 2;
                (nodes[free], nodes[free + 1]) = (*cluster, first);
                next.push(Bvh2Node::new(first.aabb().union(cluster.aabb()), 0, free as u32));
            }
        }
        clusters = next;
        pass += 1;
    }
    nodes[0] = clusters[0];
    Bvh2 {
        nodes,
        primitive_indices: (0..count as u32).collect(),
        // With this depth obvhs traverses the tree with a fixed-size stack, which drops nodes that are too deep. Its stack for deeper
        // trees panics on overflow.
        max_depth: DEFAULT_MAX_STACK_DEPTH,
        children_are_ordered_after_parents: true,
        ..Bvh2::default()
    }
}

/// Writes to `partners`, for each cluster, the cluster within `radius` that has the smallest common box with it; the last of equals.
fn choose(clusters: &[Bvh2Node], partners: &mut [u32], radius: usize) {
    let best = |i: usize| {
        let (first, end) = (i.saturating_sub(radius), (i + radius + 1).min(clusters.len()));
        let own = clusters[i].aabb();
        let (mut best, mut least) = (i, f32::INFINITY);
        for other in (first..end).filter(|other| *other != i) {
            let area = own.union(clusters[other].aabb()).half_area();
            if area <= least {
                (best, least) = (other, area);
            }
        }
        best as u32
    };
    partners.par_iter_mut().enumerate().with_min_len(TASK).for_each(|(i, partner)| *partner = best(i));
}

/// Number of pairs of clusters that select each other.
fn pairs(partners: &[u32]) -> usize {
    let is_first =
        |(i, partner): &(usize, &u32)| **partner as usize > *i && partners[**partner as usize] as usize == *i;
    partners.iter().enumerate().filter(is_first).count()
}

/// Pairs each cluster with the next in order; the last of an odd number stays alone.
fn pair_neighbours(partners: &mut [u32]) {
    let count = partners.len();
    for (i, partner) in partners.iter_mut().enumerate() {
        *partner = if i ^ 1 < count { (i ^ 1) as u32 } else { i as u32 };
    }
}
