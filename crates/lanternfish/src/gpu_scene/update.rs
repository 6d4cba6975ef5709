//! Updates a scene on the device.
//!
//! 1. `outline.rs` compares the data that are costly to upload with those of the last upload. If they differ (meshes, instances, textures,
//!    kinds of materials), the scene is uploaded again, except the images and the environment that are unchanged. Another environment
//!    replaces the last one. Else:
//! 2. Lights, the background and materials are written; if the emission of triangles has changed, so is the tree over them.
//! 3. If any instance or vertex has changed: writes the draw instances, and the vertices of deformed meshes; transforms the traced
//!    triangles, in leaf order; refits the BVH, or builds the adapter's own structure again.

mod one;
mod outline;
#[cfg(test)]
mod tests;

use std::{
    collections::BTreeSet,
    sync::atomic::{AtomicU64, Ordering},
};

use glam::{Affine3A, UVec4};
use lanternfish_scene::{Environment, Scene, SceneFault};

use self::outline::Outline;
use super::{
    DRAWS, ENVIRONMENT_BYTES, GpuScene, LIGHTS, NODES, emissive,
    geometry::{Geometry, mirrors, standing},
    has_area_lights, light_bounds, light_set, packed_lights,
    textures::Images,
    tlas::Tlas,
    tracing::{Part, Source, Tracing, pose},
    validate,
};
use crate::{
    environment_light::{EnvironmentImage, EnvironmentLight},
    error::RenderError,
    lights::tree::SceneLightTrees,
};

/// State of an uploaded scene: transforms, and data that must not change.
#[derive(Debug)]
pub(super) struct Placed {
    outline: Outline,
    /// World from object, of each instance.
    transforms: Vec<Affine3A>,
    /// A hash of each mesh's vertices; none: the device has deformed them.
    vertices: Vec<Option<u64>>,
    /// Sources of the traced triangles: the scene's parts, and the source of each triangle, in leaf order.
    parts: Vec<Part>,
    sources: Vec<Source>,
    /// True if the device may have failed to transform what has moved.
    is_unsure: bool,
    /// True if the device has reported an error.
    is_distrusted: bool,
    /// The emission of each material.
    shining: Vec<emissive::Shining>,
    /// See [`GpuScene::generation`].
    generation: u64,
    /// See [`GpuScene::revision`].
    revision: u64,
    /// See [`GpuScene::triangle_order`].
    triangle_order: u64,
}

impl Placed {
    /// The state of a scene that was just uploaded.
    pub fn new(scene: &Scene, tracing: Tracing) -> Self {
        Self {
            outline: Outline::of(scene),
            transforms: transforms(scene).collect(),
            vertices: outline::vertices(scene).into_iter().map(Some).collect(),
            is_unsure: false,
            is_distrusted: false,
            shining: emissive::shining(scene),
            sources: tracing.triangles.iter().map(|triangle| triangle.source).collect(),
            parts: tracing.parts,
            generation: next_number(),
            revision: next_number(),
            triangle_order: next_number(),
        }
    }
}

/// Data that an upload keeps from an earlier one.
#[derive(Debug, Default)]
pub(super) struct Unchanged {
    /// Images that are unchanged.
    pub images: Images,
    /// The environment, if it is unchanged.
    pub environment: Option<EnvironmentImage>,
    /// Light of the environment.
    pub environment_light: Option<EnvironmentLight>,
}

impl Placed {
    /// True if an instance's transform on the device may differ from this one.
    pub fn may_have_moved(&self, instance: usize, transform: &Affine3A) -> bool {
        self.is_unsure || self.transforms[instance] != *transform
    }

    /// Notes that the triangles may not match the instances' transforms.
    pub fn forget(&mut self) {
        self.is_unsure = true;
        self.moved();
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

    /// See [`Outline::check_counts`].
    pub fn check_counts(&self, scene: &Scene) -> Result<(), RenderError> {
        self.outline.check_counts(scene)
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
        self.outline.meshes().zip(self.transforms.iter().copied())
    }

    /// The instance, the first index and the primitive's first vertex of each traced triangle.
    pub fn triangle_sources(&self, geometry: &Geometry) -> impl Iterator<Item = UVec4> + '_ {
        let (primitives, first_of_mesh) = geometry.primitives();
        let meshes: Vec<usize> = self.outline.meshes().collect();
        self.sources.iter().map(move |source| {
            let Part { instance, primitive } = self.parts[source.part as usize];
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
        let meshes: Vec<usize> = self.outline.meshes().collect();
        let is_emissive = |instance: &usize| {
            let first = first_of_mesh.get(meshes[*instance]).copied().unwrap_or(primitives.len());
            let end = first_of_mesh.get(meshes[*instance] + 1).copied().unwrap_or(primitives.len());
            primitives[first..end].iter().any(|[.., material]| self.shining[*material as usize].0.max_element() > 0.0)
        };
        moved.iter().map(|(instance, _)| *instance).find(is_emissive)
    }
}

impl GpuScene {
    /// Identifies the state of the triangles: it changes with every [`crate::Renderer::update`] that moved any, and is unique among all
    /// uploads. Lights do not change it.
    #[cfg_attr(feature = "unstable", visibility::make(pub))]
    pub(crate) fn generation(&self) -> u64 {
        self.placed.generation
    }

    /// Identifies the state of the scene: it changes with every [`crate::Renderer::update`], whatever it changed, and is unique among all
    /// uploads.
    #[cfg_attr(feature = "unstable", visibility::make(pub))]
    pub(crate) fn revision(&self) -> u64 {
        self.placed.revision
    }

    /// Identifies the order of the triangles: it changes with another tree, and is unique among all uploads.
    #[cfg_attr(feature = "unstable", visibility::make(pub))]
    pub(crate) fn triangle_order(&self) -> u64 {
        self.placed.triangle_order
    }

    /// See [`crate::Renderer::update`].
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
    ) -> Result<(), RenderError> {
        validate(scene)?;
        let outline = Outline::of(scene);
        if let (Some(_), Some(environment)) = (&self.environment, &scene.environment)
            && !self.placed.outline.has_environment_of(&outline)
        {
            self.replace_environment(device, queue, environment)?;
            self.placed.outline.take_environment_of(&outline);
        }
        if self.placed.is_distrusted || outline != self.placed.outline {
            let unchanged = if self.placed.is_distrusted { Unchanged::default() } else { self.unchanged(&outline) };
            *self = Self::with(device, queue, scene, self.needs, unchanged)?;
            return Ok(());
        }
        self.placed.revision = next_number();
        self.update_lights(device, queue, scene)?;
        self.sky = scene.sky;
        self.materials.update(queue, scene, self.needs.shading, &self.textures);
        self.geometry.set_materials(self.needs.shading, |material| scene.materials.get(material));
        if let Some(hits) = &self.hits {
            hits.update_materials(queue, scene, self.needs.shading);
        }
        let shining = emissive::shining(scene);
        let shines_as_before = !self.needs.parts.hits || shining == self.placed.shining;
        let vertices: Vec<Option<u64>> = outline::vertices(scene).into_iter().map(Some).collect();
        let bent: Vec<usize> =
            (0..vertices.len()).filter(|mesh| vertices[*mesh] != self.placed.vertices[*mesh]).collect();
        let stands_still =
            !self.placed.is_unsure && bent.is_empty() && transforms(scene).eq(self.placed.transforms.iter().copied());
        if shines_as_before && stands_still {
            if let Some(trees) = &mut self.light_trees {
                trees.update_lights(device, queue, &self.lights)?;
            }
            return Ok(());
        }
        let triangles = pose(scene, &self.placed.parts, &self.placed.sources);
        if let Some(trees) = &mut self.light_trees {
            let emissive = match self.needs.parts.hits {
                true => emissive::triangles(scene, self.needs.shading, &self.placed.parts, &triangles),
                false => Vec::new(),
            };
            trees.replace_triangles(device, queue, &self.lights, emissive)?;
        }
        self.placed.shining = shining;
        let leaves: Vec<_> = self.light_trees.iter().flat_map(SceneLightTrees::leaves).collect();
        if stands_still {
            self.bvh.iter().for_each(|bvh| bvh.update_light_leaves(queue, &triangles, &leaves));
            return Ok(());
        }
        match bent.is_empty() {
            true => self.before_instances_move(queue),
            false => self.before_vertices_bend(queue),
        }
        if self.placed.mirrors_others(transforms(scene).enumerate()) {
            self.forget_previous();
        }
        self.geometry.update_vertices(queue, scene, &bent);
        self.geometry.place(queue, standing(scene));
        self.has_placed();
        if let Some(bvh) = &mut self.bvh {
            bvh.update(queue, &triangles, &leaves);
        }
        if let Some(hits) = &self.hits {
            hits.update(queue, scene, &self.placed.parts, &self.placed.sources);
        }
        if let Some(tlas) = &mut self.tlas {
            *tlas = Tlas::new(device, queue, &triangles)?;
        }
        self.placed.transforms = transforms(scene).collect();
        self.placed.vertices = vertices;
        self.placed.is_unsure = false;
        self.placed.generation = next_number();
        Ok(())
    }

    /// Updates everything that depends on the draws.
    pub(super) fn has_placed(&mut self) {
        self.bounds = self.geometry.bounds();
        let counter = self.counters.iter_mut().find(|(name, _)| name == DRAWS);
        counter.into_iter().for_each(|(_, count)| *count = self.geometry.draws.len() as u64);
    }

    /// Notes that another tree holds the triangles, and returns its number of nodes.
    pub(super) fn has_rebuilt(&mut self) -> usize {
        self.placed.triangle_order = next_number();
        let nodes = self.bvh.as_ref().map_or(0, |bvh| bvh.tree().len());
        let counter = self.counters.iter_mut().find(|(name, _)| name == NODES);
        counter.into_iter().for_each(|(_, count)| *count = nodes as u64);
        nodes
    }

    /// Notes that the device has reported an error: the next update uploads the complete scene.
    pub(crate) fn distrust(&mut self) {
        self.placed.is_distrusted = true;
        self.placed.forget();
    }

    fn replace_environment(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        environment: &Environment,
    ) -> Result<(), RenderError> {
        let image = EnvironmentImage::new(device, queue, environment)?;
        if self.environment_light.is_some() {
            self.environment_light = Some(EnvironmentLight::new(device, queue, Some((environment, &image)))?);
        }
        let counter = self.counters.iter_mut().find(|(name, _)| name == ENVIRONMENT_BYTES);
        counter.into_iter().for_each(|(_, bytes)| *bytes = image.bytes);
        self.environment = Some(image);
        Ok(())
    }

    /// The data that a scene of this outline can keep.
    fn unchanged(&self, now: &Outline) -> Unchanged {
        let was = &self.placed.outline;
        let images = self.textures.images(|image| was.has_image_of(now, image));
        if !was.has_environment_of(now) {
            return Unchanged { images, ..Unchanged::default() };
        }
        Unchanged { images, environment: self.environment.clone(), environment_light: self.environment_light.clone() }
    }

    fn update_lights(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Result<(), RenderError> {
        let lights = packed_lights(scene, &self.needs.lights, &device.limits())?;
        if lights.len() == self.lights.capacity as usize {
            queue.write_buffer(&self.lights.lights, 0, bytemuck::cast_slice(&lights));
            self.lights.bounds = light_bounds(scene);
            self.lights.on_host = lights.into();
        } else {
            let counter = self.counters.iter_mut().find(|(name, _)| name == LIGHTS);
            counter.into_iter().for_each(|(_, count)| *count = lights.len() as u64);
            self.lights = light_set(device, scene, lights, &self.needs.lights)?;
        }
        self.has_area_lights = has_area_lights(scene);
        Ok(())
    }
}

fn transforms(scene: &Scene) -> impl Iterator<Item = Affine3A> + '_ {
    scene.instances.iter().map(|instance| instance.world_from_object)
}

/// A number that was never returned before.
fn next_number() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    LAST.fetch_add(1, Ordering::Relaxed) + 1
}
