//! Refit of a compressed wide BVH after its triangles have moved: the same tree with new boxes [Ylitie2017].
//!
//! 1. Nodes are visited from the last to the first: children have greater indices than their parent.
//! 2. A child's box is that of its triangles, or of its node.
//! 3. A node's grid starts at the least corner of its children. Its spacing along an axis is the least power of two for
//!    which 255 steps reach the greatest corner.
//! 4. Children's boxes are rounded outwards to the grid.
//!
//! The tree keeps its topology, however far its triangles move apart: its boxes grow, and rays get slower.

use glam::{DVec3, Vec3};
use lanternfish_scene::Bounds;
use obvhs::cwbvh::{BRANCHING, node::CwBvhNode};

#[cfg(test)]
use super::triangles::TracedTriangle;

/// Largest quantised coordinate.
const GRID_CELLS: f64 = 255.0;
/// Extent of flat boxes, m, as in obvhs. The spacing's exponent must not be zero.
const LEAST_EXTENT: f64 = 1e-20;

/// Refits a tree. `box_of`: the finite box of the triangle at an index of its leaf order.
pub fn refit(nodes: &mut [CwBvhNode], box_of: impl Fn(usize) -> Bounds) {
    let mut boxes = vec![Bounds::EMPTY; nodes.len()];
    refit_nodes(nodes, (0..nodes.len()).rev(), box_of, &mut boxes);
}

/// Refits these nodes alone, children before their parents, and returns their traversal cost: see [`cost`], also for
/// `box_of`. `boxes` has those of all nodes; those of other nodes must be up to date.
pub fn refit_nodes(
    nodes: &mut [CwBvhNode],
    indices: impl Iterator<Item = usize>,
    box_of: impl Fn(usize) -> Bounds,
    boxes: &mut [Bounds],
) -> f64 {
    let mut cost = 0.0;
    for index in indices {
        let node = &mut nodes[index];
        let children = std::array::from_fn(|slot| child_bounds(node, slot, &box_of, boxes));
        cost += cost_of(node, &children);
        boxes[index] = Bounds::EMPTY;
        children.iter().for_each(|child| boxes[index].add_bounds(child));
        quantise(node, &boxes[index], &children);
    }
    cost
}

/// Traversal cost of a tree for rays from anywhere in all directions, up to a factor, by the surface-area heuristic
/// [MacDonald1990]: the sum over all children of half the box's area, m², times the number of triangles of a leaf.
/// `box_of`: the box of the triangle at an index of the leaf order. `refit.wesl` computes the same on the device.
pub fn cost(nodes: &[CwBvhNode], box_of: impl Fn(usize) -> Bounds) -> f64 {
    let mut boxes = vec![Bounds::EMPTY; nodes.len()];
    let mut cost = 0.0;
    for (index, node) in nodes.iter().enumerate().rev() {
        let children: [Bounds; BRANCHING] = std::array::from_fn(|slot| child_bounds(node, slot, &box_of, &boxes));
        children.iter().for_each(|child| boxes[index].add_bounds(child));
        cost += cost_of(node, &children);
    }
    cost
}

/// What the children of one node cost.
fn cost_of(node: &CwBvhNode, children: &[Bounds; BRANCHING]) -> f64 {
    let of_child = |(slot, child): (usize, &Bounds)| {
        let size = child.size().as_dvec3();
        let tests = if node.is_leaf(slot) { node.child_primitives(slot).1 } else { 1 };
        f64::from(tests) * (size.x * size.y + size.y * size.z + size.z * size.x)
    };
    children.iter().enumerate().filter(|(_, child)| !child.is_empty()).map(of_child).sum()
}

/// The bounding box of some points.
pub fn box_of(corners: &[Vec3]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    corners.iter().for_each(|corner| bounds.add_point(*corner));
    bounds
}

/// The exact box of a child; empty without one. `box_of`: see [`cost`]; `boxes`: of all nodes after this one.
fn child_bounds(node: &CwBvhNode, slot: usize, box_of: impl Fn(usize) -> Bounds, boxes: &[Bounds]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    if node.is_child_empty(slot) {
        return bounds;
    }
    if !node.is_leaf(slot) {
        return boxes[node.child_node_index(slot) as usize];
    }
    let (first, count) = node.child_primitives(slot);
    (first..first + count).for_each(|index| bounds.add_bounds(&box_of(index as usize)));
    bounds
}

fn quantise(node: &mut CwBvhNode, all: &Bounds, children: &[Bounds; BRANCHING]) {
    if all.is_empty() {
        return;
    }
    node.p = all.min;
    let origin = all.min.as_dvec3();
    let extent = all.max.as_dvec3() - origin;
    node.e = [extent.x, extent.y, extent.z].map(exponent);
    let spacing: DVec3 = node.e.map(spacing).into();
    let cells = |corner: Vec3| (corner.as_dvec3() - origin) / spacing;
    for (slot, child) in children.iter().enumerate().filter(|(_, child)| !child.is_empty()) {
        let [low, high] = [cells(child.min).floor(), cells(child.max).ceil()];
        (node.child_min_x[slot], node.child_max_x[slot]) = (low.x as u8, high.x as u8);
        (node.child_min_y[slot], node.child_max_y[slot]) = (low.y as u8, high.y as u8);
        (node.child_min_z[slot], node.child_max_z[slot]) = (low.z as u8, high.z as u8);
    }
}

/// Biased exponent, as in a float, of the least power of two of which 255 steps reach `extent`.
fn exponent(extent: f64) -> u8 {
    let extent = extent.max(LEAST_EXTENT);
    let guess = (extent / GRID_CELLS).log2().ceil() as i32;
    // The logarithm is rounded.
    let least = (guess - 1..).find(|e| GRID_CELLS * f64::from(*e).exp2() >= extent).unwrap_or(guess);
    (least + 127).clamp(1, 254) as u8
}

/// The power of two with this biased exponent.
fn spacing(exponent: u8) -> f64 {
    (f64::from(exponent) - 127.0).exp2()
}

/// A child's box as the traversal decodes it.
#[cfg(test)]
fn dequantised(node: &CwBvhNode, slot: usize) -> [DVec3; 2] {
    let spacing: DVec3 = node.e.map(spacing).into();
    let corner = |x: u8, y: u8, z: u8| node.p.as_dvec3() + spacing * DVec3::new(x.into(), y.into(), z.into());
    [
        corner(node.child_min_x[slot], node.child_min_y[slot], node.child_min_z[slot]),
        corner(node.child_max_x[slot], node.child_max_y[slot], node.child_max_z[slot]),
    ]
}

/// Number of triangles that are outside any box above them, and number of all triangles reached.
#[cfg(test)]
pub(in crate::gpu_scene) fn outside(nodes: &[CwBvhNode], triangles: &[TracedTriangle]) -> (usize, usize) {
    let (mut outside_count, mut reached) = (0, 0);
    let mut waiting = vec![(0, vec![])];
    while let Some((index, above)) = waiting.pop() {
        let node: &CwBvhNode = &nodes[index];
        for slot in (0..BRANCHING).filter(|slot| !node.is_child_empty(*slot)) {
            let mut boxes: Vec<[DVec3; 2]> = above.clone();
            boxes.push(dequantised(node, slot));
            if !node.is_leaf(slot) {
                waiting.push((node.child_node_index(slot) as usize, boxes));
                continue;
            }
            let (first, count) = node.child_primitives(slot);
            for triangle in &triangles[first as usize..(first + count) as usize] {
                let holds = |[low, high]: &[DVec3; 2]| {
                    triangle.corners.iter().all(|c| c.as_dvec3().cmpge(*low).all() && c.as_dvec3().cmple(*high).all())
                };
                outside_count += usize::from(!boxes.iter().all(holds));
                reached += 1;
            }
        }
    }
    (outside_count, reached)
}

#[cfg(test)]
mod tests {
    use glam::Quat;
    use proptest::prelude::*;

    use super::{
        super::{Source, Tracing, bvh},
        *,
    };
    use crate::testing::Random;

    /// Groups of small triangles around random points.
    fn scattered(random: &mut Random, groups: usize, each: usize) -> Vec<TracedTriangle> {
        let mut triangles = Vec::new();
        for _ in 0..groups {
            let (center, size) = (20.0 * random.point(), random.between(0.01, 3.0));
            triangles.extend((0..each).map(|_| {
                let position = center + size * random.point();
                let corners = [0; 3].map(|_| position + 0.2 * size * random.point());
                TracedTriangle { corners, source: Source::default() }
            }));
        }
        triangles
    }

    /// A tree and its triangles in leaf order.
    fn built(triangles: Vec<TracedTriangle>) -> (Vec<CwBvhNode>, Vec<TracedTriangle>) {
        let mut tracing = Tracing { triangles, ..Tracing::default() };
        let nodes = bvh::build(&mut tracing);
        (nodes, tracing.triangles)
    }

    /// Rotates and shifts each triangle independently; some degenerate to a line or a point.
    fn shaken(random: &mut Random, triangles: &mut [TracedTriangle], reach: f32) {
        for triangle in triangles {
            let rotation = Quat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
            let shift = reach * random.point();
            triangle.corners = triangle.corners.map(|corner| rotation * corner + shift);
            match (random.unit() * 20.0) as u32 {
                0 => triangle.corners = [triangle.corners[0]; 3],
                1 => triangle.corners[1] = triangle.corners[2],
                _ => {}
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn after_any_motion_all_boxes_hold_their_triangles(
            seed in 0u64..1 << 32, groups in 1usize..12, each in 1usize..40, reach in -6.0f32..6.0,
        ) {
            let mut random = Random::new(seed);
            let (mut nodes, mut triangles) = built(scattered(&mut random, groups, each));
            // Half of the triangles do not move.
            let moved = triangles.len() / 2;
            shaken(&mut random, &mut triangles[moved..], reach.exp2());
            refit(&mut nodes, |index| box_of(&triangles[index].corners));
            prop_assert_eq!(outside(&nodes, &triangles), (0, groups * each));
        }
    }

    /// The boxes are as small as the grid allows: moving any side inwards by a step excludes a triangle, which the test
    /// detects.
    #[test]
    fn a_box_that_is_a_step_too_small_is_noticed() {
        let mut random = Random::new(5);
        let (mut nodes, mut triangles) = built(scattered(&mut random, 9, 30));
        shaken(&mut random, &mut triangles, 4.0);
        assert!(outside(&nodes, &triangles).0 > 100, "the old boxes contain the moved triangles");
        refit(&mut nodes, |index| box_of(&triangles[index].corners));
        let mut tried = 0;
        for index in 0..nodes.len() {
            for slot in (0..BRANCHING).filter(|slot| !nodes[index].is_child_empty(*slot)) {
                for side in 0..6 {
                    let mut broken = nodes.clone();
                    let node = &mut broken[index];
                    let (edge, step) = match side {
                        0 => (&mut node.child_min_x, 1),
                        1 => (&mut node.child_min_y, 1),
                        2 => (&mut node.child_min_z, 1),
                        3 => (&mut node.child_max_x, -1),
                        4 => (&mut node.child_max_y, -1),
                        _ => (&mut node.child_max_z, -1),
                    };
                    let Some(moved) = edge[slot].checked_add_signed(step) else { continue };
                    edge[slot] = moved;
                    assert!(outside(&broken, &triangles).0 > 0, "node {index}, child {slot}, side {side}");
                    tried += 1;
                }
            }
        }
        assert!(tried > 1000, "{tried}");
    }

    /// Without motion the boxes are those of the build, except for rounding by a step.
    #[test]
    fn a_tree_that_stands_still_keeps_its_boxes() {
        let mut random = Random::new(9);
        let (nodes, triangles) = built(scattered(&mut random, 20, 50));
        let mut again = nodes.clone();
        refit(&mut again, |index| box_of(&triangles[index].corners));
        let same = nodes.iter().zip(&again).filter(|(a, b)| a == b).count();
        assert!(100 * same >= 98 * nodes.len(), "{same} of {}", nodes.len());
        for (node, again) in nodes.iter().zip(&again) {
            assert_eq!((node.p, node.imask, node.child_meta), (again.p, again.imask, again.child_meta));
            assert_eq!(
                (node.child_base_idx, node.primitive_base_idx),
                (again.child_base_idx, again.primitive_base_idx)
            );
        }
    }

    #[test]
    fn spacings_are_the_least_that_reach() {
        for extent in [0.0, 1e-20, 3e-9, 1.0, 254.999, 255.0, 255.001, 510.0, 6e38] {
            let chosen = exponent(extent);
            assert!(GRID_CELLS * spacing(chosen) >= extent, "{extent}");
            assert!(extent < 1e-19 || GRID_CELLS * spacing(chosen - 1) < extent, "{extent}");
        }
        // A scene without triangles has one node without children.
        let mut nodes = [CwBvhNode::default()];
        refit(&mut nodes, |_| Bounds::EMPTY);
        assert_eq!(nodes, [CwBvhNode::default()]);
    }
}
