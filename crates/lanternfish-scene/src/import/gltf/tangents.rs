//! Tangent generation for normal maps by MikkTSpace (M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008), as
//! the format prescribes for files without tangents.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};
use lanternfish_limits::caught;

use super::fault::{Result, invalid};
use super::{normals, vertices};
use crate::Primitive;

/// Index that means no vertex.
const NONE: u32 = u32::MAX;

/// Generates tangents along texture coordinates `uv_set`, before any `KHR_texture_transform`. Vertices whose corners
/// get different tangents are split; other vertices stay shared. The primitive must have normals.
pub(super) fn generate(primitive: &mut Primitive, uv_set: u32) -> Result<()> {
    let uv = if uv_set == 0 { &primitive.uv0 } else { &primitive.uv1 };
    if uv.is_empty() {
        // Missing texture coordinates are constant and define no direction.
        primitive.tangents = primitive.normals.iter().map(|normal| any_tangent(*normal)).collect();
        return Ok(());
    }
    let mut corners = Corners { primitive, uv, tangents: vec![Vec4::ZERO; primitive.indices.len()] };
    let cannot = |error: String| invalid(format!("tangents cannot be generated: {error}"));
    let generated = caught(|| generate_tangents(&mut corners)).map_err(cannot)?;
    generated.map_err(|error| cannot(error.to_string()))?;
    let tangents = corners.tangents;
    split(primitive, &tangents);
    Ok(())
}

/// Normalises a file's tangents and sets their signs to -1 or 1. A tangent without a direction becomes an arbitrary one
/// perpendicular to the normal.
pub(super) fn repair(primitive: &mut Primitive) {
    for (tangent, normal) in primitive.tangents.iter_mut().zip(&primitive.normals) {
        let sign = if tangent.w < 0.0 { -1.0 } else { 1.0 };
        *tangent = match normals::direction(tangent.truncate()) {
            Some(direction) => direction.extend(sign),
            None => any_tangent(*normal),
        };
    }
}

fn any_tangent(normal: Vec3) -> Vec4 {
    normal.any_orthonormal_vector().extend(1.0)
}

/// Assigns tangents to the corners of `primitive`, with one vertex for each distinct pair of old vertex and tangent.
/// Equal tangents have equal bits, as MikkTSpace computes a tangent once per group of corners.
fn split(primitive: &mut Primitive, corner_tangents: &[Vec4]) {
    let vertex_count = primitive.positions.len();
    // Linked lists of the new vertices of each old one: `first` is indexed by old vertex, `next` by new vertex.
    let mut first = vec![NONE; vertex_count];
    let mut next: Vec<u32> = Vec::with_capacity(vertex_count);
    let mut sources: Vec<u32> = Vec::with_capacity(vertex_count);
    let mut tangents: Vec<Vec4> = Vec::with_capacity(vertex_count);
    for (index, tangent) in primitive.indices.iter_mut().zip(corner_tangents) {
        let old = *index as usize;
        let mut new = first[old];
        while new != NONE && tangents[new as usize] != *tangent {
            new = next[new as usize];
        }
        if new == NONE {
            new = sources.len() as u32;
            sources.push(old as u32);
            tangents.push(*tangent);
            next.push(std::mem::replace(&mut first[old], new));
        }
        *index = new;
    }
    vertices::select(primitive, &sources);
    primitive.tangents = tangents;
}

/// The primitive and texture coordinates that MikkTSpace reads, and the tangents that it writes.
struct Corners<'a> {
    primitive: &'a Primitive,
    uv: &'a [Vec2],
    /// Tangents of the corners, one per index of the primitive.
    tangents: Vec<Vec4>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.primitive.indices[3 * face + corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.primitive.indices.len() / 3
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        self.primitive.positions[self.vertex(face, vert)].into()
    }

    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        self.primitive.normals[self.vertex(face, vert)].into()
    }

    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        self.uv[self.vertex(face, vert)].into()
    }

    fn set_tangent(&mut self, tangent_space: Option<TangentSpace>, face: usize, vert: usize) {
        let normal = self.primitive.normals[self.vertex(face, vert)];
        let generated = tangent_space.and_then(|space| {
            let [x, y, z, sign] = space.tangent_encoded();
            // v points up in MikkTSpace and down in glTF: the sign of the bitangent flips.
            Some(normals::direction(Vec3::new(x, y, z))?.extend(-sign))
        });
        self.tangents[3 * face + vert] = generated.unwrap_or_else(|| any_tangent(normal));
    }
}
