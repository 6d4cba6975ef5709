//! Rays through a tree on the host, as the renderer's `rays/bvh/walk.wesl` traverses it, for tests and `examples/compare.rs`.

use glam::Vec3;
use obvhs::cwbvh::node::CwBvhNode;

use super::inputs::Corners;

/// Rounding of a slab test: 2 units in the last place of the larger term.
const SLAB_ERROR: f32 = 2.0 * f32::EPSILON;

/// What a ray found and visited.
#[derive(Clone, Copy, Debug, Default)]
pub struct Visits {
    /// Distance of the closest hit, in lengths of the direction; infinite without one.
    pub t: f32,
    /// Nodes visited.
    pub nodes: u32,
    /// Triangles intersected.
    pub triangles: u32,
}

/// The closest hit.
pub fn closest(nodes: &[CwBvhNode], indices: &[u32], triangles: &[Corners], origin: Vec3, direction: Vec3) -> Visits {
    let mut visits = Visits { t: f32::INFINITY, ..Visits::default() };
    let inverse = 1.0 / direction;
    let octant = direction.cmpge(Vec3::ZERO);
    let octant = 4 * u32::from(octant.x) + 2 * u32::from(octant.y) + u32::from(octant.z);
    let mut stack = vec![(0u32, 0x8000_0000u32)];
    while let Some((base, group)) = stack.pop() {
        let bit = 31 - group.leading_zeros();
        let rest = group & !(1 << bit);
        if rest > 0x00ff_ffff {
            stack.push((base, rest));
        }
        assert!(stack.len() <= 32, "the stack of the shader overflows");
        let slot = (bit - 24) ^ octant;
        let node = &nodes[(base + (group & !(u32::MAX << slot) & 255).count_ones()) as usize];
        visits.nodes += 1;
        let bits = children_hit(node, origin, direction, inverse, octant, visits.t);
        let mut places = bits & 0x00ff_ffff;
        while places != 0 {
            let place = node.primitive_base_idx + places.trailing_zeros();
            places &= places - 1;
            visits.triangles += 1;
            visits.t = visits.t.min(distance(&triangles[indices[place as usize] as usize], origin, direction));
        }
        let nodes_hit = bits & 0xff00_0000;
        if nodes_hit != 0 {
            stack.push((node.child_base_idx, nodes_hit | u32::from(node.imask)));
        }
    }
    visits
}

fn children_hit(node: &CwBvhNode, origin: Vec3, direction: Vec3, inverse: Vec3, octant: u32, t_max: f32) -> u32 {
    let spacing = Vec3::from_array(node.e.map(|e| f32::from_bits(u32::from(e) << 23)));
    let scale = spacing * inverse;
    let offset = (node.p - origin) * inverse;
    let slack = SLAB_ERROR * (offset.abs() + 255.0 * scale.abs());
    let mut bits = 0;
    for child in 0..8 {
        let low = [node.child_min_x[child], node.child_min_y[child], node.child_min_z[child]];
        let high = [node.child_max_x[child], node.child_max_y[child], node.child_max_z[child]];
        let [low, high] = [low, high].map(|cells| Vec3::from_array(cells.map(f32::from)));
        let is_negative = direction.cmplt(Vec3::ZERO);
        let near = Vec3::select(is_negative, high, low) * scale + offset - slack;
        let far = Vec3::select(is_negative, low, high) * scale + offset + slack;
        if near.max_element().max(0.0) <= far.min_element().min(t_max) {
            let meta = u32::from(node.child_meta[child]);
            let is_node = meta & (meta << 1) & 0x10 != 0;
            let index = (meta ^ if is_node { octant } else { 0 }) & 31;
            bits |= (meta >> 5) << index;
        }
    }
    bits
}

/// Distance along a ray to a triangle [MoellerTrumbore1997]; infinite without a hit.
pub fn distance([a, b, c]: &Corners, origin: Vec3, direction: Vec3) -> f32 {
    let (ab, ac, from) = (b - a, c - a, origin - a);
    let p = direction.cross(ac);
    let scale = 1.0 / ab.dot(p);
    let (u, q) = (from.dot(p) * scale, from.cross(ab));
    let (v, t) = (direction.dot(q) * scale, ac.dot(q) * scale);
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 { t } else { f32::INFINITY }
}
