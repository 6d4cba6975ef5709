//! The traversal cost of a tree, for tests and `examples/compare.rs`.

use glam::Vec3A;
use obvhs::{aabb::Aabb, cwbvh::node::CwBvhNode};

use super::inputs::Corners;

/// Cost of rays by the surface-area heuristic, with obvhs's cost of a triangle, for exact boxes, relative to the root's.
pub fn sah_cost(nodes: &[CwBvhNode], indices: &[u32], triangles: &[Corners]) -> f64 {
    let mut boxes = vec![Aabb::empty(); nodes.len()];
    let mut cost = 0.0;
    for (index, node) in nodes.iter().enumerate().rev() {
        let mut all = Aabb::empty();
        for child in (0..8).filter(|child| !node.is_child_empty(*child)) {
            let mut own = Aabb::empty();
            if node.is_leaf(child) {
                let (first, count) = node.child_primitives(child);
                let leaf = &indices[first as usize..(first + count) as usize];
                leaf.iter().for_each(|i| own = own.union(&bounds(&triangles[*i as usize])));
                cost += 0.3 * f64::from(count) * f64::from(own.half_area());
            } else {
                own = boxes[node.child_node_index(child) as usize];
            }
            all = all.union(&own);
        }
        cost += f64::from(all.half_area());
        boxes[index] = all;
    }
    cost / f64::from(boxes[0].half_area())
}

/// The box of a triangle.
pub fn bounds(corners: &Corners) -> Aabb {
    let [a, b, c] = corners.map(Vec3A::from);
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}
