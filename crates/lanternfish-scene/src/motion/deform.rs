//! Deformation of vertices: morph targets, then skinning [glTF 2.0, 3.7.2.2 and 3.7.3.3].

use glam::{Affine3A, Mat3, Vec3, Vec4};
use rayon::prelude::*;

use crate::Primitive;

/// Deformation of a primitive: its vertices at rest, morph targets and joint influences. Lists are as long as the primitive's positions;
/// those whose documentation says so may be empty.
#[derive(Clone, Debug, Default)]
pub struct Deformation {
    /// Positions at rest, object space, m.
    pub positions: Vec<Vec3>,
    /// Normals at rest, unit length.
    pub normals: Vec<Vec3>,
    /// Tangents at rest, as [`Primitive::tangents`]; may be empty.
    pub tangents: Vec<Vec4>,
    /// Joint influences of each vertex, four per set; empty without a skin. The weights of all sets sum to 1.
    pub influences: Vec<Influences>,
    /// Morph targets, in the order of their weights.
    pub targets: Vec<MorphTarget>,
    /// True if normals are recomputed from the deformed triangles. Triangles then have no common vertices.
    pub has_flat_normals: bool,
}

/// Four joint influences of each vertex.
#[derive(Clone, Debug, Default)]
pub struct Influences {
    /// Indices into the skin's joints.
    pub joints: Vec<[u16; 4]>,
    /// Weights of the four joints.
    pub weights: Vec<Vec4>,
}

/// Displacements of the vertices at weight 1. Lists are as long as the primitive's positions, or empty.
#[derive(Clone, Debug, Default)]
pub struct MorphTarget {
    /// Displacements of positions, m.
    pub positions: Vec<Vec3>,
    /// Added to normals before normalisation.
    pub normals: Vec<Vec3>,
    /// Added to tangents before normalisation.
    pub tangents: Vec<Vec3>,
}

/// A deformed vertex.
#[derive(Clone, Copy)]
struct Vertex {
    position: Vec3,
    normal: Vec3,
    tangent: Vec3,
}

impl Deformation {
    /// The largest joint index with a positive weight.
    #[doc(hidden)]
    pub fn greatest_joint(&self) -> Option<u16> {
        let sets = self.influences.iter().flat_map(|set| set.joints.iter().zip(&set.weights));
        let used = sets.flat_map(|(joints, weights)| joints.iter().copied().zip(weights.to_array()));
        used.filter(|(_, weight)| *weight > 0.0).map(|(joint, _)| joint).max()
    }

    /// Writes the deformed vertices to `primitive`. `weights` are those of the morph targets; missing ones are 0. `world_from_object`
    /// are the joints' transforms; empty without a skin.
    #[doc(hidden)]
    pub fn apply(&self, primitive: &mut Primitive, weights: &[f32], world_from_object: &[Affine3A]) {
        let moved: Vec<Vertex> =
            (0..self.positions.len()).into_par_iter().map(|i| self.vertex(i, weights, world_from_object)).collect();
        primitive.positions = moved.iter().map(|vertex| vertex.position).collect();
        primitive.normals = moved.iter().map(|vertex| vertex.normal).collect();
        let tangents = moved.iter().zip(&self.tangents);
        primitive.tangents = tangents.map(|(vertex, rest)| vertex.tangent.extend(rest.w)).collect();
        if self.has_flat_normals {
            let (triangles, _) = primitive.positions.as_chunks::<3>();
            let flat = |[a, b, c]: &[Vec3; 3]| (*b - *a).cross(*c - *a).try_normalize();
            for (corners, normals) in triangles.iter().zip(primitive.normals.as_chunks_mut::<3>().0) {
                *normals = flat(corners).map_or(*normals, |normal| [normal; 3]);
            }
        }
    }

    fn vertex(&self, i: usize, weights: &[f32], world_from_object: &[Affine3A]) -> Vertex {
        let rest = Vertex {
            position: self.positions[i],
            normal: self.normals[i],
            tangent: self.tangents.get(i).map_or(Vec3::X, |tangent| tangent.truncate()),
        };
        let mut vertex = rest;
        for (target, weight) in self.targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            let add = |to: &mut Vec3, list: &[Vec3]| *to += *weight * list.get(i).copied().unwrap_or(Vec3::ZERO);
            add(&mut vertex.position, &target.positions);
            add(&mut vertex.normal, &target.normals);
            add(&mut vertex.tangent, &target.tangents);
        }
        if !self.influences.is_empty() && !world_from_object.is_empty() {
            let mut blend = Affine3A::ZERO;
            for set in &self.influences {
                for (joint, weight) in set.joints[i].iter().zip(set.weights[i].to_array()).filter(|(_, w)| *w > 0.0) {
                    blend.matrix3 += world_from_object[usize::from(*joint)].matrix3 * weight;
                    blend.translation += world_from_object[usize::from(*joint)].translation * weight;
                }
            }
            vertex.position = blend.transform_point3(vertex.position);
            vertex.normal = cofactors(blend) * vertex.normal;
            vertex.tangent = blend.transform_vector3(vertex.tangent);
        }
        vertex.normal = vertex.normal.try_normalize().unwrap_or(rest.normal);
        vertex.tangent = vertex.tangent.try_normalize().unwrap_or(rest.tangent);
        vertex
    }
}

/// The cofactor matrix, which transforms normals: the inverse transpose up to scale, defined for singular transforms too. Mirroring
/// flips normals, as it flips the winding of triangles.
fn cofactors(transform: Affine3A) -> Mat3 {
    let m = Mat3::from(transform.matrix3);
    Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}
