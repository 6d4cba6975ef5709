//! What makes a tree right, in double precision.

use glam::DVec3;
use obvhs::cwbvh::node::CwBvhNode;

use crate::{MAX_LEVELS, most_nodes};

/// Least and greatest corner; `None` is an empty box.
pub type Box = Option<[DVec3; 2]>;

/// The box around three points, or that of two corners; `None` if one is not finite or beyond 10¹⁵, or if it is inside out.
pub fn box_around(points: &[[f32; 4]]) -> Box {
    let is_near = |p: &[f32; 4]| p[..3].iter().all(|x| x.abs() <= 1e15);
    let corner = |p: &[f32; 4]| DVec3::new(p[0].into(), p[1].into(), p[2].into());
    let is_inside_out = points.len() == 2 && corner(&points[0]).cmpgt(corner(&points[1])).any();
    (points.iter().all(is_near) && !is_inside_out).then(|| {
        let start = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        points.iter().map(corner).fold(start, |[low, high], p| [low.min(p), high.max(p)])
    })
}

fn union(a: Box, b: Box) -> Box {
    match (a, b) {
        (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
        (a, b) => a.or(b),
    }
}

fn decoded(node: &CwBvhNode, child: usize) -> [DVec3; 2] {
    let spacing: DVec3 = node.e.map(|e| (f64::from(e) - 127.0).exp2()).into();
    let corner = |x: u8, y: u8, z: u8| node.p.as_dvec3() + spacing * DVec3::new(x.into(), y.into(), z.into());
    [
        corner(node.child_min_x[child], node.child_min_y[child], node.child_min_z[child]),
        corner(node.child_max_x[child], node.child_max_y[child], node.child_max_z[child]),
    ]
}

/// Checks that each primitive is in one leaf, each node has one parent, levels are contiguous and at most 32, and every child's box holds
/// all primitives below. Returns the number of nodes of each level.
pub fn check(nodes: &[CwBvhNode], indices: &[u32], boxes: &[Box]) -> Result<Vec<usize>, String> {
    let mut seen = vec![false; boxes.len()];
    let mut levels = Vec::new();
    let (mut first, mut end) = (0, 1);
    while first < end {
        levels.push(end - first);
        let mut next = end;
        for (index, node) in nodes.iter().enumerate().take(end).skip(first) {
            let mut place = node.primitive_base_idx;
            for child in (0..8).filter(|child| !node.is_child_empty(*child)) {
                if !node.is_leaf(child) {
                    if node.child_node_index(child) as usize != next {
                        return Err(format!("node {index}: child {child} is not node {next}"));
                    }
                    next += 1;
                    continue;
                }
                let (start, count) = node.child_primitives(child);
                if start != place || !(1..=3).contains(&count) {
                    return Err(format!("node {index}: child {child} has {count} primitives from {start}"));
                }
                place += count;
                let leaf = indices.get(start as usize..(start + count) as usize);
                for primitive in leaf.ok_or_else(|| format!("node {index}: a leaf ends at {place}"))? {
                    if std::mem::replace(&mut seen[*primitive as usize], true) {
                        return Err(format!("node {index}: primitive {primitive} is in two leaves"));
                    }
                }
            }
        }
        (first, end) = (end, next);
        if end > nodes.len() || levels.len() > MAX_LEVELS as usize {
            return Err(format!("{end} nodes in {} levels", levels.len()));
        }
    }
    if let Some(missing) = seen.iter().position(|seen| !seen) {
        return Err(format!("primitive {missing} is in no leaf"));
    }
    if end as u64 > most_nodes(boxes.len() as u32) {
        return Err(format!("{end} nodes over {} primitives", boxes.len()));
    }
    check_boxes(&nodes[..end], indices, boxes)?;
    Ok(levels)
}

fn check_boxes(nodes: &[CwBvhNode], indices: &[u32], boxes: &[Box]) -> Result<(), String> {
    let mut exact: Vec<Box> = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate().rev() {
        for child in (0..8).filter(|child| !node.is_child_empty(*child)) {
            let below = if node.is_leaf(child) {
                let (start, count) = node.child_primitives(child);
                let leaf = &indices[start as usize..(start + count) as usize];
                leaf.iter().fold(None, |all, primitive| union(all, boxes[*primitive as usize]))
            } else {
                exact[node.child_node_index(child) as usize]
            };
            exact[index] = union(exact[index], below);
            let [low, high] = decoded(node, child);
            match below {
                None if low.cmple(high).any() => return Err(format!("node {index}: child {child} is not empty")),
                Some(below) if low.cmpgt(below[0]).any() || high.cmplt(below[1]).any() => {
                    return Err(format!("node {index}: child {child} is {low} to {high}, below it {below:?}"));
                }
                _ => {}
            }
        }
    }
    Ok(())
}
