//! The shaders of this folder, and the data that they share with the host.

use glam::{Affine3A, UVec2, UVec4, Vec3, Vec4};
use lanternfish_gpu::{Feature, SharedStruct, gpu_struct};

use super::super::upload::geometry::mirrors;
use crate::shaders::{Root, Shaders};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::new("gpu_scene/moving/bend"),
        Root::new("gpu_scene/moving/cost"),
        Root::new("gpu_scene/moving/permute"),
        Root::computed("gpu_scene/moving/pose", variants),
        Root::new("gpu_scene/moving/refit"),
    ],
    &[
        SharedStruct::of::<BentPrimitive>(),
        SharedStruct::of::<Influence>(),
        SharedStruct::of::<BendParameters>(),
        SharedStruct::of::<Moved>(),
        SharedStruct::of::<MovingParameters>(),
        SharedStruct::of::<CostParameters>(),
        SharedStruct::of::<PermuteParameters>(),
    ],
);

/// Transforms the BVH's triangles.
pub const BVH: Feature = Feature::new("bvh");
/// Transforms the normals of hit shading.
pub const HITS: Feature = Feature::new("hits");
/// Transforms the corners of the adapter's own structure.
pub const TLAS: Feature = Feature::new("tlas");

fn variants() -> Vec<Vec<Feature>> {
    vec![vec![BVH], vec![BVH, HITS], vec![TLAS], vec![BVH, TLAS], vec![BVH, HITS, TLAS]]
}

gpu_struct! {
    /// An instance that has moved.
    pub struct Moved {
        /// Row of the affine world_from_object.
        row_x: Vec4,
        /// Row of the affine world_from_object.
        row_y: Vec4,
        /// Row of the affine world_from_object.
        row_z: Vec4,
        /// Index of the scene's instance; ascending.
        instance: u32,
        /// −1 where the transform mirrors, else 1.
        handedness: f32,
        /// Unused.
        _pad: glam::UVec2,
    }
}

gpu_struct! {
    /// Parameters of a pass over moved instances or nodes.
    pub struct MovingParameters {
        /// Number of traced triangles.
        triangle_count: u32,
        /// Number of instances that have moved.
        moved_count: u32,
        /// Index of the level's first node in the list of all nodes.
        first_node: u32,
        /// Number of nodes of the level.
        node_count: u32,
    }
}

gpu_struct! {
    /// A primitive with deformed vertices.
    pub struct BentPrimitive {
        /// Index of its first vertex among all deformed vertices.
        first: u32,
        /// Number of its vertices.
        vertex_count: u32,
        /// Its first vertex in the scene's buffers.
        first_vertex: u32,
        /// Sets of four joints per vertex; 0: no skin.
        set_count: u32,
        /// Its first [`Influence`]; the sets of a vertex are adjacent.
        first_influence: u32,
        /// Index of the skin's first joint among all joints.
        first_joint: u32,
        /// Number of its morph targets.
        target_count: u32,
        /// Index in `target_weights` of its first target's weight.
        first_weight: u32,
        /// Index of its first float in `displacements`: target by target, vertex by vertex.
        first_displacement: u32,
        /// Floats per vertex and target: 3: position; 6: position and normal; 9: position, normal and tangent.
        displacement_width: u32,
        /// 1: normals are those of the triangles; three vertices per triangle.
        has_flat_normals: u32,
        /// 1: its tangents are deformed.
        has_tangents: u32,
    }
}

gpu_struct! {
    /// Four joints of a vertex.
    pub struct Influence {
        /// Indices of the joints in the skin.
        joints: UVec4,
        /// Weights of the four joints; weights not above 0 are ignored.
        weights: Vec4,
    }
}

gpu_struct! {
    /// Parameters of a pass over deformed vertices.
    pub struct BendParameters {
        /// Number of deformed primitives.
        primitive_count: u32,
        /// Number of their vertices.
        vertex_count: u32,
        /// Unused.
        _pad: UVec2,
    }
}

gpu_struct! {
    /// Parameters of a pass over nodes.
    pub struct CostParameters {
        /// Number of nodes of the tree.
        node_count: u32,
    }
}

gpu_struct! {
    /// Parameters of the reordering of a list.
    pub struct PermuteParameters {
        /// Number of records.
        record_count: u32,
        /// Words per record.
        record_words: u32,
    }
}

/// The rows of a transform.
pub fn rows(transform: &Affine3A) -> [Vec4; 3] {
    let (m, t) = (transform.matrix3, transform.translation);
    [0, 1, 2].map(|i| Vec3::from(m.row(i)).extend(t[i]))
}

impl Moved {
    /// An instance that has moved to a transform.
    pub fn new(instance: usize, transform: &Affine3A) -> Self {
        let [row_x, row_y, row_z] = rows(transform);
        Self {
            row_x,
            row_y,
            row_z,
            instance: instance as u32,
            handedness: if mirrors(transform) { -1.0 } else { 1.0 },
            ..Self::default()
        }
    }
}
