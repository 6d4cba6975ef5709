//! Updates a scene on the device.
//!
//! 1. `upload_signature.rs` compares the data that are costly to upload with those of the last upload. If they differ
//!    (meshes, instances, textures, kinds of materials), the scene is uploaded again, except the images and the
//!    environment that are unchanged. Another environment replaces the last one. In two levels the scene is also
//!    uploaded again in these cases: a mesh's only instance moves for the first time, and the mesh gets a tree; a mesh
//!    that has a tree bends; a surface begins or ends to emit, and hits are shaded; an instance becomes flat. Else:
//! 2. Lights, the background and materials are written; if the emission of triangles has changed, so is the tree over
//!    them.
//! 3. If any instance or vertex has changed: writes the draw instances, and the vertices of deformed meshes; transforms
//!    the traced triangles, in leaf order; refits the BVH, or builds the adapter's own structure again.

mod one;
pub(super) mod placed;
pub(super) mod previous;
#[cfg(test)]
pub(super) mod tests;
mod upload_signature;

use std::collections::BTreeSet;

use glam::{Affine3A, Vec3};
use lanternfish_scene::{Environment, Scene};

use self::{
    placed::{Unchanged, next_number, transforms},
    upload_signature::UploadSignature,
};
use super::{
    scene::{DRAWS, ENVIRONMENT_BYTES, GpuScene, NODES},
    tracing::{
        emissive::{self, Shining},
        levels::{Decided, can_have_tree},
        pose,
        tlas::Tlas,
        upper::Upper,
    },
    upload::{
        geometry::standing,
        light_unit::{StoredLight, stored_environment},
        lights::{LIGHTS, has_area_lights, light_bounds, light_set, packed_lights},
        lobes::MaterialStorage,
    },
};
use crate::{
    environment_light::{EnvironmentImage, EnvironmentLight},
    error::RenderError,
    lights::tree::SceneLightTrees,
};

impl GpuScene {
    /// Identifies the state of the triangles: it changes with every [`crate::Renderer::update`] that moved any, and is
    /// unique among all uploads. Lights do not change it.
    #[doc(hidden)]
    pub fn generation(&self) -> u64 {
        self.placed.generation
    }

    /// Identifies the state of the scene: it changes with every [`crate::Renderer::update`], whatever it changed, and
    /// is unique among all uploads.
    #[doc(hidden)]
    pub fn revision(&self) -> u64 {
        self.placed.revision
    }

    /// Identifies the order of the triangles: it changes with another tree, and is unique among all uploads.
    #[doc(hidden)]
    pub fn triangle_order(&self) -> u64 {
        self.placed.triangle_order
    }

    /// See [`crate::Renderer::update`].
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
    ) -> Result<(), RenderError> {
        scene.validate()?;
        let signature = UploadSignature::of(scene);
        let light = self.stored.next(scene, self.placed.signature.has_environment_of(&signature));
        if light.light_unit != self.stored.light_unit {
            // All but the images is stored in the unit.
            let unchanged = if self.placed.is_distrusted { Unchanged::default() } else { self.unchanged(&signature) };
            let unchanged = Unchanged { environment: None, environment_light: None, ..unchanged };
            *self = Self::with(device, queue, scene, self.needs, light, unchanged)?;
            return Ok(());
        }
        self.stored = light;
        if let (Some(_), Some(environment)) = (&self.environment, &scene.environment)
            && !self.placed.signature.has_environment_of(&signature)
        {
            self.replace_environment(device, queue, environment)?;
            self.placed.signature.take_environment_of(&signature);
        }
        if self.placed.is_distrusted || signature != self.placed.signature {
            let unchanged = if self.placed.is_distrusted { Unchanged::default() } else { self.unchanged(&signature) };
            *self = Self::with(device, queue, scene, self.needs, light, unchanged)?;
            return Ok(());
        }
        self.placed.revision = next_number();
        self.update_lights(device, queue, scene)?;
        self.sky = scene.sky / self.light_unit();
        self.materials.update(queue, scene, self.material_storage(), &self.textures);
        self.geometry.set_materials(self.needs.shading, |material| scene.materials.get(material));
        self.write_panes(queue, |material| scene.materials.get(material));
        if let Some(hits) = &self.hits {
            hits.update_materials(queue, scene, self.material_storage());
        }
        let shining = emissive::shining(scene);
        let shines_as_before = !self.needs.parts.hits || shining == self.placed.shining;
        let vertices: Vec<Option<u64>> = upload_signature::vertices(scene).into_iter().map(Some).collect();
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
        let moved: Vec<(usize, Affine3A)> = transforms(scene)
            .enumerate()
            .filter(|(instance, transform)| self.placed.may_have_moved(*instance, transform))
            .collect();
        if let Some(upper) = &self.upper {
            if shines_as_before && bent.is_empty() && self.check_levels(&moved).is_ok() {
                self.update_levels(queue, &moved);
                if let Some(trees) = &mut self.light_trees {
                    trees.update_lights(device, queue, &self.lights)?;
                }
                self.placed.is_unsure = false;
                return Ok(());
            }
            // With a tree of its own a mesh's only instance moves at little cost from then on; without one a mesh bends
            // so.
            let of_moved = moved.iter().map(|(instance, _)| scene.instances[*instance].mesh);
            let meshes: BTreeSet<usize> = of_moved.chain(bent.iter().copied()).collect();
            let decide = |mesh: usize| (mesh, bent.binary_search(&mesh).is_err());
            let is_other = |(mesh, has_tree): &(usize, bool)| {
                let can_change = *has_tree != upper.has_tree_of(*mesh) && !self.placed.decided.contains_key(mesh);
                can_change && (!has_tree || can_have_tree(scene, *mesh, self.needs.parts.hits))
            };
            let decided: Decided = meshes.into_iter().map(decide).filter(is_other).collect();
            let is_dark = |shining: &Shining| shining.0 == Vec3::ZERO;
            let emits_elsewhere = !shining.iter().map(is_dark).eq(self.placed.shining.iter().map(is_dark));
            if !decided.is_empty()
                || bent.iter().any(|mesh| upper.has_tree_of(*mesh))
                || (!shines_as_before && emits_elsewhere)
                || !moved.iter().all(|(instance, transform)| upper.takes(*instance, transform))
            {
                let mut unchanged = self.unchanged(&signature);
                unchanged.decided.extend(decided);
                unchanged.decided.extend(bent.iter().map(|mesh| (*mesh, false)));
                return self.upload_again(device, queue, scene, (light, unchanged), bent.is_empty());
            }
        }
        let storage = self.material_storage();
        // In two levels, those in world space.
        let count = self.upper.as_ref().map_or(self.placed.sources.len(), Upper::flat_count);
        let triangles = pose(scene, &self.placed.parts, &self.placed.sources[..count]);
        if let Some(trees) = &mut self.light_trees {
            let emissive = match self.needs.parts.hits {
                true => emissive::triangles(scene, storage, &self.placed.parts, &triangles),
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
        match (&mut self.upper, &mut self.bvh) {
            (Some(upper), Some(bvh)) => {
                moved.iter().for_each(|(instance, transform)| upper.set_transform(*instance, transform));
                upper.pose(queue, bvh, &triangles, &leaves);
                upper.send(queue, bvh, false);
            }
            (None, Some(bvh)) => bvh.update(queue, &triangles, &leaves),
            _ => {}
        }
        if let Some(hits) = &self.hits {
            hits.update(queue, scene, &self.placed.parts, &self.placed.sources[..count]);
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

    /// Uploads a scene that has the same signature. Transforms of the previous frame are kept for motion vectors, if
    /// the draws are as before.
    fn upload_again(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        (light, unchanged): (StoredLight, Unchanged),
        has_same_vertices: bool,
    ) -> Result<(), RenderError> {
        let has_same_draws = has_same_vertices && !self.placed.mirrors_others(transforms(scene).enumerate());
        self.before_instances_move(queue);
        let mut uploaded = Self::with(device, queue, scene, self.needs, light, unchanged)?;
        if has_same_draws {
            uploaded.previous = std::mem::take(&mut self.previous);
        }
        *self = uploaded;
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
        self.placed.is_unsure = true;
        self.placed.moved();
    }

    fn replace_environment(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        environment: &Environment,
    ) -> Result<(), RenderError> {
        let environment = &*stored_environment(environment, self.light_unit());
        let image = EnvironmentImage::new(device, queue, environment)?;
        if self.environment_light.is_some() {
            self.environment_light = Some(EnvironmentLight::new(device, queue, Some((environment, &image)))?);
        }
        let counter = self.counters.iter_mut().find(|(name, _)| name == ENVIRONMENT_BYTES);
        counter.into_iter().for_each(|(_, bytes)| *bytes = image.bytes);
        self.environment = Some(image);
        Ok(())
    }

    /// The data that a scene of this signature can keep.
    fn unchanged(&self, now: &UploadSignature) -> Unchanged {
        let was = &self.placed.signature;
        let images = self.textures.images(|image| was.has_image_of(now, image));
        let decided = if was == now { self.placed.decided.clone() } else { Decided::new() };
        let skipped_levels = was.has_images_of(now).then_some(self.placed.skipped_levels);
        if !was.has_environment_of(now) {
            return Unchanged { images, decided, skipped_levels, ..Unchanged::default() };
        }
        let (environment, environment_light) = (self.environment.clone(), self.environment_light.clone());
        Unchanged { images, environment, environment_light, decided, skipped_levels }
    }

    pub(super) fn material_storage(&self) -> MaterialStorage {
        MaterialStorage { shading: self.needs.shading, light_unit: self.light_unit() }
    }

    fn update_lights(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Result<(), RenderError> {
        let lights = packed_lights(scene, &self.needs.lights, self.light_unit(), &device.limits())?;
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
