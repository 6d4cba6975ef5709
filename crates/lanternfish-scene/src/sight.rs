//! Coarse visibility from a point: the nearest hits of a few hundred rays, without a BVH.

use glam::{Affine3A, Mat3, Vec2, Vec3};
use rayon::prelude::*;

use crate::Scene;

/// A low-resolution view: rays through the centres of a square grid of cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    /// Rotation from the view's space to world space; the view axis is −z.
    pub world_from_face: Mat3,
    /// Slopes of the sides along x and y.
    pub slope: Vec2,
}

impl Face {
    /// The six sides of a cube: ahead (−z), right (+x), behind, left; up, down.
    pub fn cube() -> [Self; 6] {
        let quarter = std::f32::consts::FRAC_PI_2;
        let face = |world_from_face| Self { world_from_face, slope: Vec2::ONE };
        let rotated = |quarters: f32| face(Mat3::from_rotation_y(-quarters * quarter));
        let [up, down] = [1.0, -1.0].map(|sign| face(Mat3::from_rotation_x(sign * quarter)));
        [rotated(0.0), rotated(1.0), rotated(2.0), rotated(3.0), up, down]
    }
}

/// A ray hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// Depth along the face's axis, m.
    pub depth: f32,
    /// True if the triangle is counter-clockwise as seen from the eye, for any material.
    pub is_front: bool,
    /// Unique index of the placed triangle.
    pub triangle: usize,
}

/// The nearest hit of each ray from `eye` (world space, m): face by face, rows from the top, `side` × `side` rays per face.
/// Alpha masks count as opaque, transparent surfaces are skipped. If two surfaces coincide, a front face is preferred. Takes
/// time linear in the triangles; each triangle is tested against the rays within its projected box.
pub(crate) fn look(scene: &Scene, eye: Vec3, faces: &[Face], side: usize) -> Vec<Option<Hit>> {
    let nothing = || vec![None; faces.len() * side * side];
    let placed = scene.instances.iter().flat_map(|instance| {
        let mesh = &scene.meshes[instance.mesh];
        mesh.primitives.iter().map(move |primitive| (primitive, instance.world_from_object))
    });
    let solid = placed.filter(|(primitive, _)| !scene.materials[primitive.material].is_transparent());
    // Parts of about a thousand triangles, so that threads split long lists.
    const PART: usize = 1 << 10;
    let parts: Vec<_> = solid
        .flat_map(|(primitive, placed)| primitive.indices.chunks(3 * PART).map(move |part| (primitive, placed, part)))
        .collect();
    let hits =
        parts.par_iter().enumerate().fold(nothing, |mut hits, (part, (primitive, world_from_object, indices))| {
            let is_mirrored = world_from_object.matrix3.determinant() < 0.0;
            let eye_from_object = Affine3A::from_translation(-eye) * *world_from_object;
            for (i, corners) in indices.chunks_exact(3).enumerate() {
                let at = |i: usize| eye_from_object.transform_point3(primitive.positions[corners[i] as usize]);
                let (corners, index) = ([at(0), at(1), at(2)], PART * part + i);
                for (face, hits) in faces.iter().zip(hits.chunks_exact_mut(side * side)) {
                    let corners = corners.map(|p| face.world_from_face.transpose() * p);
                    Triangle { corners, index, is_mirrored }.intersect(face.slope, side, hits);
                }
            }
            hits
        });
    hits.reduce(nothing, |mut hits, others| {
        hits.iter_mut().zip(others).for_each(|(hit, other)| *hit = nearer(*hit, other));
        hits
    })
}

/// A triangle in a face's space.
struct Triangle {
    corners: [Vec3; 3],
    index: usize,
    /// True if its transform mirrors.
    is_mirrored: bool,
}

impl Triangle {
    /// Intersects the triangle with the rays within its projected box, and updates their nearest hits.
    fn intersect(&self, slope: Vec2, side: usize, hits: &mut [Option<Hit>]) {
        let [a, b, c] = self.corners;
        if a.z >= 0.0 && b.z >= 0.0 && c.z >= 0.0 {
            return;
        }
        let normal = (b - a).cross(c - a);
        let offset = normal.dot(a);
        // Edge-on, or degenerate.
        if offset == 0.0 || !offset.is_finite() {
            return;
        }
        let (mut first, mut last) = ([0; 2], [side - 1; 2]);
        if a.z < 0.0 && b.z < 0.0 && c.z < 0.0 {
            let projected = self.corners.map(|p| Vec2::new(p.x, -p.y) / (-p.z * slope));
            let (min, max) =
                (projected[0].min(projected[1]).min(projected[2]), projected[0].max(projected[1]).max(projected[2]));
            // Cell centres are at (2 i + 1) / side − 1. Casts to integers saturate.
            let cell = |x: f32| 0.5 * ((x + 1.0) * side as f32 - 1.0);
            for axis in 0..2 {
                let (low, high) = (cell(min[axis]).ceil(), cell(max[axis]).floor());
                if high < 0.0 || low > (side - 1) as f32 {
                    return;
                }
                first[axis] = low as usize;
                last[axis] = (high as usize).min(side - 1);
            }
        }
        for y in first[1]..=last[1] {
            for x in first[0]..=last[0] {
                let middle = |i: usize| (2 * i + 1) as f32 / side as f32 - 1.0;
                let ray = Vec3::new(slope.x * middle(x), -slope.y * middle(y), -1.0);
                let depth = offset / normal.dot(ray);
                // Inside all three edges, edges included; the sign depends on the winding.
                let volumes = [a.cross(b), b.cross(c), c.cross(a)].map(|n| n.dot(ray));
                let inside = volumes.iter().all(|v| *v >= 0.0) || volumes.iter().all(|v| *v <= 0.0);
                if depth > 0.0 && depth.is_finite() && inside {
                    let is_front = (normal.dot(ray) < 0.0) != self.is_mirrored;
                    let hit = Hit { depth, is_front, triangle: self.index };
                    let nearest = &mut hits[y * side + x];
                    *nearest = nearer(*nearest, Some(hit));
                }
            }
        }
    }
}

/// The nearer of two hits; at equal depth, the front face.
fn nearer(a: Option<Hit>, b: Option<Hit>) -> Option<Hit> {
    match (a, b) {
        (Some(x), Some(y)) if x.depth < y.depth || (x.depth == y.depth && x.is_front) => a,
        (Some(_), None) => a,
        _ => b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate;

    #[test]
    fn the_six_sides_of_a_room_have_the_right_distances() {
        // The Cornell box, open to +z, 2 m high, floor at y = 0; the eye is above the blocks.
        let scene = generate::demo("cornell").unwrap();
        let eye = Vec3::new(0.1, 1.6, 0.2);
        let hits = look(&scene, eye, &Face::cube(), 8);
        let bounds = scene.bounds();
        let depth = |face: usize, cell: usize| hits[face * 64 + cell].map(|hit| hit.depth);
        let near =
            |actual: Option<f32>, expected: f32| assert!((actual.unwrap() - expected).abs() < 1e-4, "{actual:?}");
        near(depth(0, 27), eye.z - bounds.min.z);
        near(depth(1, 27), bounds.max.x - eye.x);
        near(depth(3, 27), eye.x - bounds.min.x);
        assert_eq!(depth(2, 27), None, "the open side");
        assert!(depth(5, 27).is_some() && depth(4, 0).is_some());
        let fronts = hits.iter().flatten().filter(|hit| hit.is_front).count();
        assert_eq!(fronts, hits.iter().flatten().count(), "all faces look inwards");
        // Rows are from the top: the first hits the ceiling.
        near(depth(0, 3), (bounds.max.y - eye.y) / 0.875);
        // From behind the wall, the hits are on its back face.
        let behind = look(
            &scene,
            eye - 9.0 * Vec3::Z,
            &[Face { world_from_face: Mat3::from_rotation_y(std::f32::consts::PI), slope: Vec2::splat(0.02) }],
            4,
        );
        assert!(behind.iter().all(|hit| hit.is_some_and(|hit| !hit.is_front)));
    }
}
