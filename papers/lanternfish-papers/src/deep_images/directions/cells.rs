//! Candidate axes per direction: a table over the cube's faces.
//!
//! A direction and its opposite have the same cell: the face is the axis of its largest component, and u and v are the other two divided by
//! it. The table is one array of words, as `nearest_image.wesl` reads it:
//!
//! | words | |
//! |---|---|
//! | 0 | n: each of the three faces has n × n cells |
//! | 1 to 3 n² + 1 | where each cell's candidates start in this array; the last is its length |
//! | the rest | candidates: images, ascending within a cell |
//!
//! The directions nearest to one of the points ±axis are a convex cone: its sides are the planes half-way to the other points. On a face a
//! cone is a convex polygon. A cell's candidates are the points whose polygon overlaps it, so no list could be shorter.

use glam::{DVec2, DVec3, Vec3};

/// Margin of a cell beyond its border, in u and v. Both are quotients in −1..1 that one addition and two multiplications map to cells:
/// eight roundings of 2⁻²⁴ in total, if a shader's division has 2.5 units in the last place.
const CELL_MARGIN: f64 = 1e-6;
/// Maximum difference by which a point may lose against another and stay a candidate, for directions as long as those to a face, at most
/// √3. A scalar product in single precision is off by up to 3 · 2⁻²⁴ of that; two are compared.
const DOT_MARGIN: f64 = 1e-6;
/// Target number of cells per axis.
const CELLS_PER_AXIS: f64 = 8.0;

/// The table for these unit axes.
pub(super) fn build(axes: &[Vec3]) -> Vec<u32> {
    // Odd, so that the coordinate axes, where sets have their poles and seams, are not on the border of cells.
    let edge = (CELLS_PER_AXIS * axes.len() as f64 / 3.0).sqrt() as u32 | 1;
    let points: Vec<DVec3> = axes.iter().flat_map(|axis| [axis.as_dvec3(), -axis.as_dvec3()]).collect();
    let mut entries = Vec::new();
    for face in 0..3 {
        for i in 0..points.len() {
            let polygon = nearest_to(&points, i, face);
            scan(&polygon, edge, |row, column| entries.push(((face * edge + row) * edge + column, i as u32 / 2)));
        }
    }
    // With few axes, both points of an axis may overlap a cell.
    entries.sort_unstable();
    entries.dedup();

    let cells = 3 * edge * edge;
    let first = 1 + cells + 1;
    let start = |cell| first + entries.partition_point(|entry| entry.0 < cell) as u32;
    let candidates = entries.iter().map(|entry| entry.1);
    std::iter::once(edge).chain((0..=cells).map(start)).chain(candidates).collect()
}

/// The cell of a direction of any length; CPU reference of `direction_cell` in `nearest_image.wesl`.
pub(super) fn cell_of(direction: Vec3, edge: u32) -> u32 {
    let size = direction.abs();
    let (face, p) = if size.x >= size.y.max(size.z) {
        (0, direction)
    } else if size.y >= size.z {
        (1, Vec3::new(direction.y, direction.z, direction.x))
    } else {
        (2, Vec3::new(direction.z, direction.x, direction.y))
    };
    let along = |q: f32| (((0.5 * (q / p.x) + 0.5) * edge as f32) as u32).min(edge - 1);
    (face * edge + along(p.z)) * edge + along(p.y)
}

/// Range of a cell's candidates in the table.
pub(super) fn range(table: &[u32], cell: u32) -> std::ops::Range<usize> {
    table[1 + cell as usize] as usize..table[2 + cell as usize] as usize
}

/// The image nearest to ±direction, and true if −axis is the nearer end; CPU reference of `nearest_direction`.
pub(super) fn nearest(axes: &[Vec3], table: &[u32], direction: Vec3) -> (u32, bool) {
    let cell = cell_of(direction, table[0]);
    let mut image = 0;
    let mut cosine = 0.0f32;
    for candidate in &table[range(table, cell)] {
        let dot = axes[*candidate as usize].dot(direction);
        if dot.abs() > cosine.abs() {
            image = *candidate;
            cosine = dot;
        }
    }
    (image, cosine < 0.0)
}

/// A point on the face of a cell, not unit length.
fn on_face(face: u32, uv: DVec2) -> DVec3 {
    match face {
        0 => DVec3::new(1.0, uv.x, uv.y),
        1 => DVec3::new(uv.y, 1.0, uv.x),
        _ => DVec3::new(uv.x, uv.y, 1.0),
    }
}

/// The part of a face where directions are nearest to one of the points, or nearly: a convex polygon in u and v, or empty.
fn nearest_to(points: &[DVec3], i: usize, face: u32) -> Vec<DVec2> {
    let far = 1.0 + CELL_MARGIN;
    let mut polygon = vec![DVec2::splat(-far), DVec2::new(far, -far), DVec2::splat(far), DVec2::new(-far, far)];
    let point = points[i];
    // Every direction of the polygon is within an angle of the point; a point at twice that angle is nearer to none of them.
    let mut cosine_of_twice = -1.0;
    for (j, other) in points.iter().enumerate() {
        if j == i || point.dot(*other) < cosine_of_twice {
            continue;
        }
        if clip(&mut polygon, |uv| (point - *other).dot(on_face(face, uv)) + DOT_MARGIN) {
            let cosine = |uv: &DVec2| on_face(face, *uv).normalize().dot(point);
            let least = polygon.iter().map(cosine).fold(1.0, f64::min);
            cosine_of_twice = if least > 0.0 { 2.0 * least * least - 1.0 } else { -1.0 };
        }
        if polygon.is_empty() {
            break;
        }
    }
    polygon
}

/// Calls `reached` with row and column of every cell that a convex polygon overlaps.
fn scan(polygon: &[DVec2], edge: u32, mut reached: impl FnMut(u32, u32)) {
    let cell = |w: f64| ((0.5 * w + 0.5) * f64::from(edge)).clamp(0.0, f64::from(edge - 1)) as u32;
    let cells = |range: [f64; 2]| cell(range[0] - CELL_MARGIN)..=cell(range[1] + CELL_MARGIN);
    let extent = |polygon: &[DVec2], along: DVec2| {
        let positions = polygon.iter().map(|p| p.dot(along));
        [positions.clone().fold(f64::MAX, f64::min), positions.fold(f64::MIN, f64::max)]
    };
    if polygon.is_empty() {
        return;
    }
    for row in cells(extent(polygon, DVec2::Y)) {
        let border = |i: u32| 2.0 * f64::from(i) / f64::from(edge) - 1.0;
        let mut in_row = polygon.to_vec();
        clip(&mut in_row, |uv| uv.y - (border(row) - CELL_MARGIN));
        clip(&mut in_row, |uv| border(row + 1) + CELL_MARGIN - uv.y);
        if !in_row.is_empty() {
            cells(extent(&in_row, DVec2::X)).for_each(|column| reached(row, column));
        }
    }
}

/// Clips a convex polygon to where a linear function is not negative; true if anything was removed.
fn clip(polygon: &mut Vec<DVec2>, inside: impl Fn(DVec2) -> f64) -> bool {
    if polygon.iter().all(|p| inside(*p) >= 0.0) {
        return false;
    }
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for i in 0..polygon.len() {
        let (from, to) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        let (a, b) = (inside(from), inside(to));
        if a >= 0.0 {
            kept.push(from);
        }
        if (a >= 0.0) != (b >= 0.0) {
            kept.push(from.lerp(to, a / (a - b)));
        }
    }
    *polygon = kept;
    true
}
