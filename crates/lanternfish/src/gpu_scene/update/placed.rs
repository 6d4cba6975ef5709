//! The state of an uploaded scene, and what another upload keeps of it.

use std::{
    collections::BTreeSet,
    sync::atomic::{AtomicU64, Ordering},
};

use glam::{Affine3A, UVec4};
use lanternfish_scene::{Scene, SceneFault};

use super::{
    super::{
        tracing::{Part, Source, Tracing, emissive, levels::Decided},
        upload::{
            geometry::{Geometry, mirrors},
            textures::Images,
        },
    },
    upload_signature::{self, UploadSignature},
};
use crate::{
    environment_light::{EnvironmentImage, EnvironmentLight},
    error::RenderError,
};

/// State of an uploaded scene: transforms, and data that must not change.
#[derive(Debug)]
pub struct Placed {
    pub(super) signature: UploadSignature,
    /// World from object, of each instance.
    pub(super) transforms: Vec<Affine3A>,
    /// A hash of each mesh's vertices; none: the device has deformed them.
    pub(super) vertices: Vec<Option<u64>>,
    /// Sources of the traced triangles: the scene's parts, and the source of each triangle, in leaf order.
    pub(super) parts: Vec<Part>,
    pub(super) sources: Vec<Source>,
    /// True if the device may have failed to transform what has moved.
    pub(super) is_unsure: bool,
    /// True if the device has reported an error.
    pub(super) is_distrusted: bool,
    /// If the BVH has two levels.
    pub(super) decided: Decided,
    /// Levels of all textures that were left out.
    pub(super) skipped_levels: u32,
    /// The emission of each material.
    pub(super) shining: Vec<emissive::Shining>,
    /// See [`crate::GpuScene::generation`].
    pub(super) generation: u64,
    /// See [`crate::GpuScene::revision`].
    pub(super) revision: u64,
    /// See [`crate::GpuScene::triangle_order`].
    pub(super) triangle_order: u64,
}

impl Placed {
    /// The state of a scene that was just uploaded.
    pub fn new(scene: &Scene, tracing: Tracing, decided: Decided, skipped_levels: u32) -> Self {
        Self {
            signature: UploadSignature::of(scene),
            transforms: transforms(scene).collect(),
            vertices: upload_signature::vertices(scene).into_iter().map(Some).collect(),
            is_unsure: false,
            is_distrusted: false,
            shining: emissive::shining(scene),
            sources: tracing.triangles.iter().map(|triangle| triangle.source).collect(),
            parts: tracing.parts,
            decided,
            skipped_levels,
            generation: next_number(),
            revision: next_number(),
            triangle_order: next_number(),
        }
    }
}

/// Data that an upload keeps from an earlier one.
#[derive(Debug, Default)]
pub struct Unchanged {
    /// Images that are unchanged.
    pub images: Images,
    /// The environment, if it is unchanged.
    pub environment: Option<EnvironmentImage>,
    /// Light of the environment.
    pub environment_light: Option<EnvironmentLight>,
    /// See [`Decided`].
    pub decided: Decided,
    /// See [`Placed`].
    pub skipped_levels: Option<u32>,
}

impl Placed {
    /// True if an instance's transform on the device may differ from this one.
    pub fn may_have_moved(&self, instance: usize, transform: &Affine3A) -> bool {
        self.is_unsure || self.transforms[instance] != *transform
    }

    /// True if vertices of these meshes may differ from the device's last deformation.
    pub fn may_have_bent(&self, mut meshes: impl Iterator<Item = usize>) -> bool {
        self.is_unsure || meshes.any(|mesh| self.vertices[mesh].is_some())
    }

    /// Notes that the device deforms the vertices of these meshes.
    pub fn forget_vertices(&mut self, meshes: impl Iterator<Item = usize>) {
        meshes.for_each(|mesh| self.vertices[mesh] = None);
    }

    /// The instances of these meshes, and their transforms.
    pub fn instances_of(&self, meshes: impl Iterator<Item = usize>) -> Vec<(usize, Affine3A)> {
        let meshes: BTreeSet<usize> = meshes.collect();
        let of_them = self.stands().enumerate().filter(|(_, (mesh, _))| meshes.contains(mesh));
        of_them.map(|(instance, (_, transform))| (instance, transform)).collect()
    }

    /// See [`UploadSignature::check_counts`].
    pub fn check_counts(&self, scene: &Scene) -> Result<(), RenderError> {
        self.signature.check_counts(scene)
    }

    /// True if the handedness of any of these instances changes: the order of draws then changes.
    pub fn mirrors_others(&self, mut transforms: impl Iterator<Item = (usize, Affine3A)>) -> bool {
        transforms.any(|(instance, transform)| mirrors(&transform) != mirrors(&self.transforms[instance]))
    }

    /// Reorders the traced triangles; `order` gives the old index of each.
    pub fn reorder(&mut self, order: &[u32]) {
        self.sources = order.iter().map(|i| self.sources[*i as usize]).collect();
    }

    /// The parts to which sources refer.
    #[cfg(test)]
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The source of each traced triangle, in leaf order.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// Stores the transform of an instance.
    pub fn set_transform(&mut self, instance: usize, transform: Affine3A) {
        self.transforms[instance] = transform;
    }

    /// Notes that triangles have moved.
    pub fn moved(&mut self) {
        self.generation = next_number();
        self.revision = next_number();
    }

    /// The mesh and the transform of each instance.
    pub fn stands(&self) -> impl Iterator<Item = (usize, Affine3A)> + '_ {
        self.signature.meshes().zip(self.transforms.iter().copied())
    }

    /// The instance, the first index and the primitive's first vertex of each traced triangle.
    pub fn triangle_sources(&self, geometry: &Geometry) -> impl Iterator<Item = UVec4> + '_ {
        let (primitives, first_of_mesh) = geometry.primitives();
        let meshes: Vec<usize> = self.signature.meshes().collect();
        self.sources.iter().map(move |source| {
            let Part { instance, primitive, .. } = self.parts[source.part as usize];
            let [first_index, first_vertex, _] =
                primitives[first_of_mesh[meshes[instance as usize]] + primitive as usize];
            UVec4::new(instance, first_index + 3 * source.triangle, first_vertex, 0)
        })
    }

    /// An error for instances that do not exist, and for invalid transforms.
    pub fn check_moves(&self, moved: &[(usize, Affine3A)]) -> Result<(), RenderError> {
        for (instance, transform) in moved {
            let count = self.transforms.len();
            if *instance >= count {
                return Err(RenderError::NeedsUpdate {
                    what: format!("{count} instances were uploaded, and none is {instance}"),
                });
            }
            let reach = transform.to_cols_array().map(f32::abs).into_iter().fold(0.0, f32::max);
            if !transform.is_finite() || reach > Scene::FARTHEST {
                let what =
                    format!("instance {instance}: its transform is not finite, or beyond {:e} m", Scene::FARTHEST);
                return Err(SceneFault::Motion { what }.into());
            }
        }
        Ok(())
    }

    /// The first of these instances that has an emissive surface.
    pub fn first_shining(&self, moved: &[(usize, Affine3A)], geometry: &Geometry) -> Option<usize> {
        let (primitives, first_of_mesh) = geometry.primitives();
        let meshes: Vec<usize> = self.signature.meshes().collect();
        let is_emissive = |instance: &usize| {
            let first = first_of_mesh.get(meshes[*instance]).copied().unwrap_or(primitives.len());
            let end = first_of_mesh.get(meshes[*instance] + 1).copied().unwrap_or(primitives.len());
            primitives[first..end].iter().any(|[.., material]| self.shining[*material as usize].0.max_element() > 0.0)
        };
        moved.iter().map(|(instance, _)| *instance).find(is_emissive)
    }
}

/// World from object, of each instance.
pub fn transforms(scene: &Scene) -> impl Iterator<Item = Affine3A> + '_ {
    scene.instances.iter().map(|instance| instance.world_from_object)
}

/// A number that was never returned before.
pub fn next_number() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    LAST.fetch_add(1, Ordering::Relaxed) + 1
}
