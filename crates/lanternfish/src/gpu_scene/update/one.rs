//! Replaces one element of a scene: a light or a material.

use std::sync::Arc;

use lanternfish_gpu::GpuError;
use lanternfish_scene::{Bounds, Light as SceneLight, Material, Scene, SceneFault};

use super::{
    super::{
        moving::sent::Sent,
        scene::GpuScene,
        tracing::{emissive, panes::Pane},
    },
    placed::next_number,
};
use crate::{error::RenderError, lights::Light};

impl GpuScene {
    /// See [`crate::Renderer::set_light`].
    pub(crate) fn set_light(
        &mut self,
        queue: &wgpu::Queue,
        index: usize,
        light: &SceneLight,
    ) -> Result<Sent, RenderError> {
        self.check_light(index, Some(light))?;
        if self.stored.is_outshone(Some(light), None) {
            return Err(RenderError::NeedsUpdate {
                what: format!("light {index}: it is too bright for the unit of light"),
            });
        }
        let bytes =
            self.write_lights(queue, &[(index, Light::new(light, &self.needs.lights).in_unit(self.light_unit()))])?;
        Ok(Sent { bytes, ..Sent::default() })
    }

    /// An error for a light that does not exist or is not valid. `None`: a light without emission.
    pub(in crate::gpu_scene) fn check_light(
        &self,
        index: usize,
        light: Option<&SceneLight>,
    ) -> Result<(), RenderError> {
        if let Some(light) = light {
            let invalid = |what: &str| SceneFault::Light { index, name: light.name.clone(), what: what.to_owned() };
            light.validate().map_err(invalid)?;
            if light.position.abs().max_element() > Scene::FARTHEST {
                return Err(invalid("it is too far from the origin").into());
            }
        }
        let count = self.lights.on_host.len();
        if index >= count {
            return Err(RenderError::NeedsUpdate {
                what: format!("{count} lights were uploaded, and none is {index}"),
            });
        }
        Ok(())
    }

    /// Replaces lights, rebuilds the tree over them, and returns their size, bytes.
    pub(in crate::gpu_scene) fn write_lights(
        &mut self,
        queue: &wgpu::Queue,
        changed: &[(usize, Light)],
    ) -> Result<u64, GpuError> {
        if changed.is_empty() {
            return Ok(0);
        }
        for (index, light) in changed {
            let bytes = bytemuck::bytes_of(light);
            queue.write_buffer(&self.lights.lights, (index * bytes.len()) as u64, bytes);
            Arc::make_mut(&mut self.lights.on_host)[*index] = *light;
        }
        let mut bounds = Bounds::EMPTY;
        let placed = self.lights.on_host.iter().filter(|light| !light.is_directional());
        placed.for_each(|light| bounds.add_point(light.position()));
        self.lights.bounds = bounds;
        self.has_area_lights = self.lights.on_host.iter().any(Light::is_area);
        if let Some(trees) = &mut self.light_trees {
            trees.update_lights(&self.device, queue, &self.lights)?;
        }
        self.placed.revision = next_number();
        Ok((changed.len() * size_of::<Light>()) as u64)
    }

    /// Writes what the panes of these materials let pass, and returns its size, bytes.
    pub(super) fn write_panes<'m>(&self, queue: &wgpu::Queue, changed: impl Fn(usize) -> Option<&'m Material>) -> u64 {
        let changed = self.panes.iter().filter_map(|pane| Some((pane, changed(pane.material)?)));
        let write = |(pane, material): (&Pane, &Material)| {
            let block = pane.block(material, self.needs.shading);
            queue.write_buffer(&self.masks, 4 * u64::from(pane.address), bytemuck::cast_slice(&block));
            size_of_val(&block) as u64
        };
        changed.map(write).sum()
    }

    /// See [`crate::Renderer::set_material`].
    pub(crate) fn set_material(
        &mut self,
        queue: &wgpu::Queue,
        index: usize,
        material: &Material,
    ) -> Result<Sent, RenderError> {
        let needs_update = |what: &str| Err(RenderError::NeedsUpdate { what: format!("material {index}: {what}") });
        let invalid = |what| SceneFault::Material { index, name: material.name.clone(), what };
        material.validate(self.placed.signature.texture_count()).map_err(invalid)?;
        match self.placed.signature.has_shape_of(index, material) {
            None => return needs_update("so many were not uploaded"),
            Some(false) => {
                return needs_update("it has other textures, another alpha mode, other sides, transmission or volume");
            }
            Some(true) => {}
        }
        if self.stored.is_outshone(None, Some(material)) {
            return needs_update("its emission is too bright for the unit of light");
        }
        let shining = emissive::shining_of(material);
        if self.needs.parts.hits && shining != self.placed.shining[index] {
            return needs_update("emissive triangles are in a light tree");
        }
        self.geometry.set_materials(self.needs.shading, |other| (other == index).then_some(material));
        let mut bytes = self.materials.set(queue, index, material, self.material_storage(), &self.textures);
        if let Some(hits) = &self.hits {
            bytes += hits.set_material(queue, index, material, self.material_storage());
        }
        bytes += self.write_panes(queue, |pane| (pane == index).then_some(material));
        self.placed.shining[index] = shining;
        self.placed.revision = next_number();
        Ok(Sent { bytes, ..Sent::default() })
    }
}
