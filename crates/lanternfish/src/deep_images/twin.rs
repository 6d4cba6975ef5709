//! Deep images as plain loops: every surface on the axis of every texel, by exact intersection. The builders' specification
//! and oracle.

use glam::{DVec3, Vec3};

use super::{DeepFrame, DeepGrid, Fragment};

/// Lists of one image, row by row, each ascending.
pub(crate) fn image(grid: &DeepGrid, frame: &DeepFrame, triangles: &[[Vec3; 3]]) -> Vec<Vec<Fragment>> {
    let n = grid.resolution as usize;
    let mut lists = vec![Vec::new(); n * n];
    let texel = |value: f64| (value * f64::from(grid.texels_per_metre) + 0.5 * n as f64 - 0.5).ceil().max(0.0) as usize;
    let (x, y, z) = (frame.x.as_dvec3(), frame.y.as_dvec3(), frame.z.as_dvec3());
    for (index, corners) in triangles.iter().enumerate() {
        let local: [DVec3; 3] = corners.map(|corner| {
            let q = (corner - grid.center).as_dvec3();
            DVec3::new(q.dot(x), q.dot(y), q.dot(z))
        });
        // Texels whose middle lies in the triangle's box.
        let low = local[0].min(local[1]).min(local[2]);
        let high = local[0].max(local[1]).max(local[2]);
        for row in texel(low.y)..texel(high.y).min(n) {
            for column in texel(low.x)..texel(high.x).min(n) {
                let middle = |i: usize| (i as f64 + 0.5 - 0.5 * n as f64) / f64::from(grid.texels_per_metre);
                if let Some(depth) = meet(&local, middle(column), middle(row)) {
                    lists[row * n + column].push(Fragment { depth: depth as f32, triangle: Some(index as u32) });
                }
            }
        }
    }
    for list in &mut lists {
        list.sort_by(|a, b| a.depth.total_cmp(&b.depth).then(a.triangle.cmp(&b.triangle)));
    }
    lists
}

/// z at which the line along z through (x, y) meets a triangle.
fn meet([a, b, c]: &[DVec3; 3], x: f64, y: f64) -> Option<f64> {
    let edge = |p: &DVec3, q: &DVec3| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
    let (u, v, w) = (edge(b, c), edge(c, a), edge(a, b));
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let sum = u + v + w;
    (inside && sum != 0.0).then(|| (u * a.z + v * b.z + w * c.z) / sum)
}

/// Merges as sorting does: runs of fragments nearer to each other than `distance` are their first and, where the run is as long
/// as that, their last.
pub(crate) fn merge(list: &[Fragment], distance: f32) -> Vec<Fragment> {
    let mut kept: Vec<Fragment> = Vec::new();
    for run in list.chunk_by(|a, b| b.depth - a.depth < distance) {
        let (first, last) = (run[0], run[run.len() - 1]);
        kept.push(first);
        if run.len() > 1 && last.depth - first.depth >= distance {
            kept.push(last);
        }
    }
    kept
}

/// Distance to the first fragment beyond `depth`, forwards or backwards.
pub(crate) fn trace(list: &[Fragment], depth: f32, reversed: bool) -> Option<f32> {
    if reversed {
        return list.iter().rev().map(|f| depth - f.depth).find(|distance| *distance > 0.0);
    }
    list.iter().map(|f| f.depth - depth).find(|distance| *distance > 0.0)
}
