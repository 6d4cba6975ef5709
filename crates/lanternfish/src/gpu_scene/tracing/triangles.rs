//! Traced triangles, and the parts of a scene that they are of.

use glam::Vec3;
use lanternfish_scene::{Instance, Primitive, Scene};
use rayon::prelude::*;

/// A triangle in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracedTriangle {
    /// Corners in world space, m.
    pub corners: [Vec3; 3],
    /// The scene's triangle that it is.
    pub source: Source,
}

/// The scene's triangle that a traced triangle is: all that is needed to transform it again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// Index into [`super::Tracing::parts`].
    pub part: u32,
    /// Index of the triangle in the part's primitive.
    pub triangle: u32,
    /// 0: solid; else the index of its mask record plus one.
    pub record: u32,
    /// 0: no opacity micromap; else its address in [`super::Tracing::masks`] and its level (`gpu_scene/mask.wesl`).
    pub opacity: u32,
}

/// A primitive of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Index into [`Scene::instances`].
    pub instance: u32,
    /// Index of the primitive in the instance's mesh.
    pub primitive: u32,
    /// The mesh, if its triangles are in its own space: the part stands for those of all its instances.
    pub mesh: Option<u32>,
}

impl Part {
    /// The corners of a triangle, in the space of the tree that it is in.
    pub fn corners(&self, scene: &Scene, triangle: usize) -> [Vec3; 3] {
        let (instance, primitive) = self.of(scene);
        let corner = |i: usize| primitive.positions[primitive.indices[3 * triangle + i] as usize];
        [0, 1, 2].map(corner).map(|corner| match self.mesh {
            None => instance.world_from_object.transform_point3(corner),
            Some(_) => corner,
        })
    }

    /// The instance and the primitive.
    pub fn of<'s>(&self, scene: &'s Scene) -> (&'s Instance, &'s Primitive) {
        let instance = &scene.instances[self.instance as usize];
        (instance, &scene.meshes[instance.mesh].primitives[self.primitive as usize])
    }
}

/// Triangles of these sources with the scene's current transforms, world space, in the same order. A triangle whose
/// corners are not finite becomes a point: no ray hits it; so does an instance's box, which is of no part.
pub fn pose(scene: &Scene, parts: &[Part], sources: &[Source]) -> Vec<TracedTriangle> {
    let pose_triangle = |source: &Source| {
        let corners = parts.get(source.part as usize).map(|part| part.corners(scene, source.triangle as usize));
        let finite = corners.filter(|corners| corners.iter().all(|corner| corner.is_finite()));
        TracedTriangle { corners: finite.unwrap_or_default(), source: *source }
    };
    sources.par_iter().map(pose_triangle).collect()
}
