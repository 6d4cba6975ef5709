//! Generation of missing normals and repair of broken ones.

use glam::Vec3;

use super::vertices;
use crate::Primitive;

/// Gives the primitive flat normals. Every corner gets its own vertex.
pub(super) fn make_flat(primitive: &mut Primitive) {
    vertices::unshare(primitive);
    let (triangles, _) = primitive.positions.as_chunks::<3>();
    primitive.normals = triangles.iter().flat_map(|corners| [triangle_normal(corners); 3]).collect();
}

/// Normalises the normals. A normal without a direction (zero or NaN) becomes that of a triangle that uses the
/// vertex.
pub(super) fn repair(primitive: &mut Primitive) {
    let mut has_broken = false;
    for normal in &mut primitive.normals {
        *normal = direction(*normal).unwrap_or_else(|| {
            has_broken = true;
            Vec3::ZERO
        });
    }
    if !has_broken {
        return;
    }
    let (triangles, _) = primitive.indices.as_chunks::<3>();
    for triangle in triangles {
        for corner in triangle.map(|index| index as usize) {
            if primitive.normals[corner] == Vec3::ZERO {
                primitive.normals[corner] = triangle_normal(&triangle.map(|i| primitive.positions[i as usize]));
            }
        }
    }
}

/// Unit vector along `v`. `None` if `v` is zero, not finite, or so short that its square is denormal.
pub(super) fn direction(v: Vec3) -> Option<Vec3> {
    v.try_normalize().filter(|unit| unit.is_normalized())
}

/// The normal on the side from which the corners are counter-clockwise; +y for a triangle without area.
fn triangle_normal([a, b, c]: &[Vec3; 3]) -> Vec3 {
    direction((b - a).cross(c - a)).unwrap_or(Vec3::Y)
}
