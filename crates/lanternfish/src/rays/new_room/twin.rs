//! The shader's search in plain Rust: its specification.

use glam::Vec3;

/// Distance along `direction` (unit) to the nearest of the triangles, m; none where it meets none.
pub(super) fn nearest(triangles: &[[Vec3; 3]], origin: Vec3, direction: Vec3) -> Option<f32> {
    let distances = triangles.iter().filter_map(|[a, b, c]| {
        let normal = (b - a).cross(c - a);
        let t = normal.dot(a - origin) / normal.dot(direction);
        let p = origin + t * direction;
        let is_inside = [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (*to - *from).cross(p - *from).dot(normal) > 0.0);
        (t > 0.0 && is_inside).then_some(t)
    });
    distances.min_by(f32::total_cmp)
}
