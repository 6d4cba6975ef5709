//! Mesh building: flat polygons, boxes, solids of revolution, sheets and mouldings.
//!
//! Space: the caller's object space, +y up, metres. Texture coordinates are metres too, v downwards, until
//! [`Surface::primitive`] scales them to the texture.

use std::f32::consts::TAU;

use glam::{Affine3A, Vec2, Vec3, Vec4};

use crate::{Primitive, generate::surface::Surface};

/// A mesh under construction. Triangles are counter-clockwise seen from the front.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shape {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub uv: Vec<Vec2>,
    pub indices: Vec<u32>,
}

impl Shape {
    /// An empty shape.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a vertex and returns its index.
    pub fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        self.uv.push(uv);
        self.positions.len() as u32 - 1
    }

    /// Adds a triangle; degenerate ones (under 1 mm² / 100) are skipped.
    pub fn triangle(&mut self, a: u32, b: u32, c: u32) {
        let [p, q, r] = [a, b, c].map(|i| self.positions[i as usize]);
        if (q - p).cross(r - p).length() > 2e-8 {
            self.indices.extend([a, b, c]);
        }
    }

    /// Adds a flat convex polygon, counter-clockwise. Texture: metres in its plane, upright where possible.
    pub fn polygon(&mut self, points: &[Vec3]) -> &mut Self {
        // Newell's sum is the normal even if some points coincide.
        let sum: Vec3 = (0..points.len()).map(|i| points[i].cross(points[(i + 1) % points.len()])).sum();
        let Some(normal) = sum.try_normalize() else { return self };
        let right = if normal.y.abs() > 0.99 { Vec3::X } else { Vec3::Y.cross(normal).normalize() };
        let up = normal.cross(right);
        let corners: Vec<u32> =
            points.iter().map(|p| self.vertex(*p, normal, Vec2::new(p.dot(right), -p.dot(up)))).collect();
        for i in 2..corners.len() {
            self.triangle(corners[0], corners[i - 1], corners[i]);
        }
        self
    }

    /// Adds a box with edges bevelled at 45°, `bevel` wide (0: sharp; less than half the box).
    pub fn cuboid(&mut self, min: Vec3, max: Vec3, bevel: f32) -> &mut Self {
        let (center, half) = (0.5 * (min + max), 0.5 * (max - min));
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        for i in 0..3 {
            let (u, v) = ((i + 1) % 3, (i + 2) % 3);
            for side in [1.0f32, -1.0] {
                // The face across axis i; u × v = axis i, so the winding depends on `side`.
                let corner = |s: f32, t: f32| {
                    let inset = half - bevel;
                    center + side * half[i] * axes[i] + s * side * inset[u] * axes[u] + t * inset[v] * axes[v]
                };
                self.polygon(&[corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
                if bevel == 0.0 {
                    continue;
                }
                // The four edges along axis v, between this face and the next axis' face.
                for direction in [1.0f32, -1.0] {
                    let edge = |outer: usize, t: f32| {
                        let mut p = half - bevel;
                        p[outer] = half[outer];
                        center
                            + Vec3::from_array([0, 1, 2].map(|k| {
                                p[k] * if k == i {
                                    side
                                } else if k == u {
                                    direction
                                } else {
                                    t
                                }
                            }))
                    };
                    let [a, b] = if side * direction > 0.0 { [i, u] } else { [u, i] };
                    self.polygon(&[edge(a, -1.0), edge(b, -1.0), edge(b, 1.0), edge(a, 1.0)]);
                }
            }
        }
        if bevel > 0.0 {
            for corner in 0..8 {
                let sign = Vec3::from_array([0, 1, 2].map(|k| if corner >> k & 1 == 0 { 1.0 } else { -1.0 }));
                let mut points = [0, 1, 2].map(|k| center + sign * (half - bevel + bevel * axes[k]));
                if sign.x * sign.y * sign.z < 0.0 {
                    points.swap(1, 2);
                }
                self.polygon(&points);
            }
        }
        self
    }

    /// Adds a profile of (radius, height) revolved about +y in `segments` steps. If listed upwards, the outside is the front;
    /// if downwards, the inside. Profile corners of more than 40° stay sharp.
    pub fn lathe(&mut self, profile: &[(f32, f32)], segments: u32) -> &mut Self {
        let points: Vec<Vec2> = profile.iter().map(|(r, y)| Vec2::new(*r, *y)).collect();
        let normals: Vec<Vec2> = points.windows(2).map(|w| -(w[1] - w[0]).perp().normalize_or_zero()).collect();
        let widest = points.iter().fold(0.0f32, |r, p| r.max(p.x));
        let blend = |own: Vec2, other: Option<&Vec2>| match other {
            Some(other) if own.dot(*other) > 0.766 => (own + *other).normalize(),
            _ => own,
        };
        let mut length = 0.0;
        for (i, ends) in points.windows(2).enumerate() {
            let below = blend(normals[i], i.checked_sub(1).map(|j| &normals[j]));
            let above = blend(normals[i], normals.get(i + 1));
            let next = length + ends[0].distance(ends[1]);
            let first = self.positions.len() as u32;
            for segment in 0..=segments {
                let angle = TAU * segment as f32 / segments as f32;
                // From x towards −z: to the right, seen from outside.
                let (sin, cos) = if segment == segments { (0.0, 1.0) } else { angle.sin_cos() };
                for (point, normal, v) in [(ends[0], below, length), (ends[1], above, next)] {
                    let revolved = |p: Vec2| Vec3::new(p.x * cos, p.y, -p.x * sin);
                    self.vertex(revolved(point), revolved(normal), Vec2::new(angle * widest, -v));
                }
            }
            for segment in 0..segments {
                let a = first + 2 * segment;
                self.triangle(a, a + 2, a + 3);
                self.triangle(a, a + 3, a + 1);
            }
            length = next;
        }
        self
    }

    /// Adds a smooth sheet `position(s, t)` over 0..1 × 0..1 in `columns` × `rows` cells, `size` metres of texture. Its
    /// front is where s runs to the right and t upwards.
    pub fn sheet(&mut self, columns: u32, rows: u32, size: Vec2, position: impl Fn(f32, f32) -> Vec3) -> &mut Self {
        let first = self.positions.len() as u32;
        for row in 0..=rows {
            for column in 0..=columns {
                let (s, t) = (column as f32 / columns as f32, row as f32 / rows as f32);
                // Differences are taken within the sheet and away from its border, where a sheet may degenerate to a point.
                let step = 2e-3;
                let (s_in, t_in) = (s.clamp(2.0 * step, 1.0 - 2.0 * step), t.clamp(2.0 * step, 1.0 - 2.0 * step));
                let along_s = position(s_in + step, t_in) - position(s_in - step, t_in);
                let along_t = position(s_in, t_in + step) - position(s_in, t_in - step);
                let normal = along_s.cross(along_t).normalize_or(Vec3::Y);
                self.vertex(position(s, t), normal, size * Vec2::new(s, 1.0 - t));
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let a = first + row * (columns + 1) + column;
                let above = a + columns + 1;
                self.triangle(a, a + 1, above + 1);
                self.triangle(a, above + 1, above);
            }
        }
        self
    }

    /// Adds a profile of (reach, height), listed upwards, swept around a rectangle of half size `half` with mitred corners.
    /// If `inward`, it faces the rectangle's inside, and reach is measured inwards.
    pub fn moulding(&mut self, profile: &[(f32, f32)], half: Vec2, inward: bool) -> &mut Self {
        let sign = if inward { -1.0 } else { 1.0 };
        let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)];
        for ends in profile.windows(2) {
            for i in 0..4 {
                let [a, b] = if inward { [i + 1, i] } else { [i, i + 1] }.map(|k| corners[k % 4]);
                let at = |(x, z): (f32, f32), (reach, y): (f32, f32)| {
                    Vec3::new(x * (half.x + sign * reach), y, z * (half.y + sign * reach))
                };
                self.polygon(&[at(a, ends[0]), at(b, ends[0]), at(b, ends[1]), at(a, ends[1])]);
            }
        }
        self
    }

    /// Adds a round bar of `radius` from `from` to `to`, open at its ends.
    pub fn bar(&mut self, from: Vec3, to: Vec3, radius: f32, segments: u32) -> &mut Self {
        let axis = to - from;
        let rotation = glam::Quat::from_rotation_arc(Vec3::Y, axis.normalize());
        let mut bar = Shape::new();
        bar.lathe(&[(radius, 0.0), (radius, axis.length())], segments);
        self.append(&bar, &Affine3A::from_rotation_translation(rotation, from))
    }

    /// Adds a transformed copy of `other`. The transform may scale and mirror.
    pub fn append(&mut self, other: &Shape, transform: &Affine3A) -> &mut Self {
        let first = self.positions.len() as u32;
        let normal_from_normal = transform.matrix3.inverse().transpose();
        self.positions.extend(other.positions.iter().map(|p| transform.transform_point3(*p)));
        self.normals.extend(other.normals.iter().map(|n| (normal_from_normal * *n).normalize_or(Vec3::Y)));
        self.uv.extend(&other.uv);
        let mirrored = transform.matrix3.determinant() < 0.0;
        for t in other.indices.chunks_exact(3) {
            let t = if mirrored { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] };
            self.indices.extend(t.map(|i| first + i));
        }
        self
    }

    /// Adds a copy of `other`, translated by `offset`.
    pub fn append_at(&mut self, other: &Shape, offset: Vec3) -> &mut Self {
        self.append(other, &Affine3A::from_translation(offset))
    }
}

impl Surface {
    /// The shape as a primitive of this material: texture coordinates scaled to the texture, tangents where the
    /// material has a normal map.
    pub fn primitive(&self, shape: Shape) -> Primitive {
        let tangents = if self.normal_mapped { tangents(&shape) } else { Vec::new() };
        let uv0 = shape.uv.iter().map(|uv| *uv / self.texture_size).collect();
        Primitive {
            material: self.material,
            positions: shape.positions,
            normals: shape.normals,
            tangents,
            uv0,
            indices: shape.indices,
            ..Primitive::default()
        }
    }
}

/// Tangents along +u, averaged over the triangles of each vertex. The bitangent points along −v, up in the image, as
/// glTF's normal maps expect.
fn tangents(shape: &Shape) -> Vec<Vec4> {
    let mut along_u = vec![Vec3::ZERO; shape.positions.len()];
    let mut along_v = along_u.clone();
    for t in shape.indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| i as usize);
        let (e, f) = (shape.positions[b] - shape.positions[a], shape.positions[c] - shape.positions[a]);
        let (g, h) = (shape.uv[b] - shape.uv[a], shape.uv[c] - shape.uv[a]);
        // Solve e = g.x T + g.y B, f = h.x T + h.y B; the determinant's magnitude is the weight by area.
        let sign = g.perp_dot(h).signum();
        for i in [a, b, c] {
            along_u[i] += sign * (h.y * e - g.y * f);
            along_v[i] += sign * (g.x * f - h.x * e);
        }
    }
    let directions = along_u.iter().zip(&along_v);
    directions
        .zip(&shape.normals)
        .map(|((u, v), normal)| {
            let tangent = u.reject_from_normalized(*normal).try_normalize();
            let tangent = tangent.unwrap_or_else(|| normal.any_orthonormal_vector());
            let sign = if normal.cross(tangent).dot(*v) > 0.0 { -1.0 } else { 1.0 };
            tangent.extend(sign)
        })
        .collect()
}
