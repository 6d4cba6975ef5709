//! Deep images as plain loops: every surface on the axis of every texel, by exact intersection. The builders'
//! specification and reference.

use glam::{DVec3, Vec3};
use lanternfish::rays::TracedRay;

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
                if let Some(depth) = intersect(&local, middle(column), middle(row)) {
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

/// z at which the line along z through (x, y) intersects a triangle.
fn intersect([a, b, c]: &[DVec3; 3], x: f64, y: f64) -> Option<f64> {
    let edge = |p: &DVec3, q: &DVec3| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
    let (u, v, w) = (edge(b, c), edge(c, a), edge(a, b));
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let sum = u + v + w;
    (inside && sum != 0.0).then(|| (u * a.z + v * b.z + w * c.z) / sum)
}

/// Merges as the sort pass does: of a run of fragments closer to each other than `distance`, the first is kept and, if
/// the run is at least that long, the last.
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

/// A ray's start in an image: texels across and down, and depth, m.
fn start(grid: &DeepGrid, frame: &DeepFrame, ray: &TracedRay) -> Vec3 {
    let q = ray.origin - grid.center;
    let texels = |axis: Vec3| q.dot(axis) * grid.texels_per_metre + 0.5 * grid.resolution as f32;
    Vec3::new(texels(frame.x), texels(frame.y), q.dot(frame.z))
}

/// The nearest fragment of an ascending list above `depth`, or, backwards, below it.
fn first(list: &[Fragment], depth: f32, backwards: bool) -> Option<Fragment> {
    if backwards {
        return list.iter().rev().find(|fragment| fragment.depth < depth).copied();
    }
    list.iter().find(|fragment| fragment.depth > depth).copied()
}

/// `rays/within_texel/walk.wesl`: distance of the ray's hit, m, and its fragment. `lists`: of the ray's image.
pub(crate) fn within_texel(
    grid: &DeepGrid,
    frame: &DeepFrame,
    lists: &[Vec<Fragment>],
    ray: &TracedRay,
) -> Option<(f32, Fragment)> {
    let p = start(grid, frame, ray);
    let last = grid.resolution as usize - 1;
    let list = &lists[(p.y as usize).min(last) * grid.resolution as usize + (p.x as usize).min(last)];
    let backwards = ray.image_and_side % 2 == 1;
    let offset = if backwards { -ray.offset } else { ray.offset };
    let hit = first(list, p.z + offset, backwards)?;
    Some(((hit.depth - p.z).abs(), hit))
}

/// `rays/within_texel/plain.wesl`: the same, of the fragment after the one nearest to the ray's start.
pub(crate) fn plain(
    grid: &DeepGrid,
    frame: &DeepFrame,
    lists: &[Vec<Fragment>],
    ray: &TracedRay,
) -> Option<(f32, Fragment)> {
    let p = start(grid, frame, ray);
    let list = &lists[p.y as usize * grid.resolution as usize + p.x as usize];
    let apart = |fragment: &Fragment| (fragment.depth - p.z).abs();
    let own = (0..list.len()).min_by(|a, b| apart(&list[*a]).total_cmp(&apart(&list[*b])))?;
    let (next, side) = if ray.image_and_side % 2 == 1 { (own.checked_sub(1)?, -1.0) } else { (own + 1, 1.0) };
    let hit = list.get(next)?;
    Some(((side * (hit.depth - p.z)).max(0.0), *hit))
}

/// A list on a ray's way: its index, the depth beyond which the ray's hit lies, and the last depth at which it counts.
struct Visit {
    list: usize,
    beyond: f32,
    last: f32,
}

/// The lists that a ray crosses up to the image's border, in order, with a tolerance before it enters a list and after
/// it leaves. True: depths grow along the ray.
fn visits(grid: &DeepGrid, frame: &DeepFrame, ray: &TracedRay) -> (Vec<Visit>, bool) {
    let p = start(grid, frame, ray);
    let n = grid.resolution as usize;
    let along = ray.direction.dot(frame.z);
    let tolerance = grid.tolerance / grid.texels_per_metre;
    // The interval of distances in which the ray is over the texels from i to i + 1.
    let over = |axis: Vec3, at: f32, i: usize| {
        let speed = ray.direction.dot(axis) * grid.texels_per_metre;
        let (a, b) = ((i as f32 - at) / speed, (i as f32 + 1.0 - at) / speed);
        (a.min(b), a.max(b))
    };
    let mut passed: Vec<(f32, f32, usize)> = Vec::new();
    for row in 0..n {
        let (enters_row, leaves_row) = over(frame.y, p.y, row);
        for column in 0..n {
            let (enters, leaves) = over(frame.x, p.x, column);
            let (enters, leaves) = (enters.max(enters_row).max(0.0), leaves.min(leaves_row));
            if enters < leaves {
                passed.push((enters, leaves.min(4.0 * grid.radius), row * n + column));
            }
        }
    }
    passed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let visit = |(enters, leaves, list): (f32, f32, usize)| {
        // Depths grow with distance if the ray follows the axis.
        let (near, far) = (p.z + along * enters, p.z + along * leaves);
        let start = p.z + ray.offset * along.signum();
        if along > 0.0 {
            Visit { list, beyond: start.max(near - tolerance), last: far + tolerance }
        } else {
            Visit { list, beyond: start.min(near + tolerance), last: far - tolerance }
        }
    };
    (passed.into_iter().map(visit).collect(), along > 0.0)
}

/// The hit in one list.
fn hit_in(lists: &[Vec<Fragment>], visit: &Visit, ascending: bool) -> Option<Fragment> {
    let is_near = |hit: &Fragment| if ascending { hit.depth <= visit.last } else { hit.depth >= visit.last };
    first(&lists[visit.list], visit.beyond, !ascending).filter(is_near)
}

/// `rays/across_texels/walk.wesl`: the same, from every list that the ray crosses.
pub(crate) fn across_texels(
    grid: &DeepGrid,
    frame: &DeepFrame,
    lists: &[Vec<Fragment>],
    ray: &TracedRay,
) -> Option<(f32, Fragment)> {
    let (visits, ascending) = visits(grid, frame, ray);
    let hit = visits.iter().find_map(|visit| hit_in(lists, visit, ascending))?;
    Some(((hit.depth - start(grid, frame, ray).z) / ray.direction.dot(frame.z), hit))
}

/// Lists that a ray across texels looks into, up to its hit's or the last one, and fragments that bisection compares
/// with it in them.
pub(crate) fn counts(grid: &DeepGrid, frame: &DeepFrame, lists: &[Vec<Fragment>], ray: &TracedRay) -> [u32; 2] {
    let (visits, ascending) = visits(grid, frame, ray);
    let to_hit = visits.iter().position(|visit| hit_in(lists, visit, ascending).is_some());
    let visited = &visits[..to_hit.map_or(visits.len(), |hit| hit + 1)];
    let compared = |visit: &Visit| bisection(&lists[visit.list], visit.beyond, ascending);
    [visited.len() as u32, visited.iter().map(compared).sum()]
}

/// Fragments of a list that bisection compares with a depth.
fn bisection(list: &[Fragment], depth: f32, past_equal: bool) -> u32 {
    let (mut low, mut high, mut compared) = (0, list.len(), 0);
    while low < high {
        let middle = usize::midpoint(low, high);
        let is_before = list[middle].depth < depth || (past_equal && list[middle].depth == depth);
        (low, high) = if is_before { (middle + 1, high) } else { (low, middle) };
        compared += 1;
    }
    compared
}
