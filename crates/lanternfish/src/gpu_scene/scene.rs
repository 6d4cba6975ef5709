//! A scene on the device: its upload, and the bindings of its parts.

use glam::Vec3;
use lanternfish_gpu::{Bindings, storage_buffer_of, uniform_buffer_of};
use lanternfish_limits::memory::Budget;
use lanternfish_scene::{Bounds, Scene};

use super::{
    moving::{bending::Bending, passes::Moving},
    shaders::SoftShadows,
    tracing::{
        Tracing,
        bvh::{self, Bvh},
        emissive,
        hits::Hits,
        levels::MOST_IDS,
        panes::Pane,
        tlas::Tlas,
        upper::Upper,
    },
    update::{
        placed::{Placed, Unchanged},
        previous::Previous,
    },
    upload::{
        cost,
        geometry::{Geometry, ImageBehind},
        light_unit::{StoredLight, stored_environment},
        lights::{LIGHTS, has_area_lights, light_set, packed_lights},
        lobes::MaterialStorage,
        materials::Materials,
        needs::SceneRequirements,
        textures::Textures,
    },
};
use crate::{
    environment_light::{EnvironmentImage, EnvironmentLight},
    error::RenderError,
    lights::{
        LightSet,
        tree::{EmissiveTriangle, SceneLightTrees},
    },
};

/// Name of the counter.
pub const DRAWS: &str = "scene/draws";
/// Name of the counter.
pub const ENVIRONMENT_BYTES: &str = "scene/environment_bytes";
/// Name of the counter.
pub const NODES: &str = "scene/bvh_nodes";

/// A scene on the device, which can be rendered any number of times with the settings of its upload.
#[derive(Debug)]
pub struct GpuScene {
    pub(crate) geometry: Geometry,
    pub(crate) textures: Textures,
    /// The scene's lights.
    pub(crate) lights: LightSet,
    /// True if any of them is a disk or rectangle.
    pub(crate) has_area_lights: bool,
    /// Triangles that rays are traced through.
    pub(crate) traced_triangles: u32,
    /// Radiance of the background, nits.
    pub(crate) sky: Vec3,
    /// Unit of stored light: see `upload/light_unit.rs`.
    pub(super) stored: StoredLight,
    /// The background as an image, if the scene has one.
    pub(crate) environment: Option<EnvironmentImage>,
    /// Light of the environment, if the settings require it.
    pub(super) environment_light: Option<EnvironmentLight>,
    /// World-space box of all geometry.
    pub(crate) bounds: Bounds,
    pub(super) materials: Materials,
    pub(super) soft_shadows: wgpu::Buffer,
    pub(super) bvh: Option<Bvh>,
    /// The tree over instances, if the BVH has two levels.
    pub(super) upper: Option<Upper>,
    /// Where instances are among the BVH's triangles.
    pub(super) traced_levels: wgpu::Buffer,
    pub(super) tlas: Option<Tlas>,
    pub(super) masks: wgpu::Buffer,
    /// Thin surfaces through which shadow rays pass in part.
    pub(super) panes: Vec<Pane>,
    /// Shading data of hits, if hits are shaded.
    pub(super) hits: Option<Hits>,
    /// Light trees, if a technique draws lights from them.
    pub(super) light_trees: Option<SceneLightTrees>,
    pub(super) placed: Placed,
    /// Passes that move instances on the device; created at the first move.
    pub(super) moving: Option<Moving>,
    /// Passes that deform vertices on the device; created at the first deformation.
    pub(super) bending: Option<Bending>,
    /// Geometry of the previous frame, if a frame has requested motion.
    pub(super) previous: Previous,
    pub(super) device: wgpu::Device,
    /// The requirements for which it was uploaded.
    pub(super) needs: SceneRequirements,
    pub(super) counters: Vec<(String, u64)>,
}

impl GpuScene {
    pub(crate) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        needs: SceneRequirements,
    ) -> Result<Self, RenderError> {
        scene.validate()?;
        Self::with(device, queue, scene, needs, StoredLight::of(scene), Unchanged::default())
    }

    /// What uploading a valid scene takes of the process's memory; an error if that does not fit.
    fn memory_plan(scene: &Scene, needs: &SceneRequirements) -> Result<cost::MemoryPlan, RenderError> {
        Ok(cost::plan(scene, needs.shading, needs.parts, &Budget::of_process())?)
    }

    /// An error if the process may not allocate what uploading a valid scene needs.
    pub(crate) fn check_memory(scene: &Scene, needs: &SceneRequirements) -> Result<(), RenderError> {
        Self::memory_plan(scene, needs).map(|_| ())
    }

    /// Uploads a valid scene, except what is kept of an earlier upload.
    pub(super) fn with(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        needs: SceneRequirements,
        light: StoredLight,
        unchanged: Unchanged,
    ) -> Result<Self, RenderError> {
        let SceneRequirements { shading, parts, .. } = needs;
        let plan = Self::memory_plan(scene, &needs)?;
        // Free memory differs between the uploads of a sequence; its images do not.
        let skipped_levels = unchanged.skipped_levels.unwrap_or(plan.skipped_levels);
        if skipped_levels > 0 {
            tracing::warn!("textures are read at 1/{} of their size: memory", 1 << skipped_levels);
        }
        let images = (unchanged.images, skipped_levels);
        let textures = Textures::new(device, queue, scene, shading, needs.texture_arrays, needs.anisotropy, images)?;
        let StoredLight { light_unit, .. } = light;
        let storage = MaterialStorage { shading, light_unit };
        let materials = Materials::new(device, scene, storage, &textures)?;
        let geometry = Geometry::new(device, scene, shading)?;

        let lights = packed_lights(scene, &needs.lights, light_unit, &device.limits())?;
        let lights = light_set(device, scene, lights, &needs.lights)?;
        let none = wgpu::BufferUsages::empty();

        // Surfaces that cast shadows, in the BVH's leaf order.
        let limits = device.limits();
        let mask_bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let mut tracing = match parts.rays() {
            true if parts.instances => Tracing::in_levels(scene, mask_bytes, parts.hits, &unchanged.decided),
            true => Tracing::new(scene, mask_bytes),
            false => Tracing::default(),
        };
        tracing.decide_opacity(mask_bytes);
        tracing.write_panes(scene, shading);
        let mut nodes = bvh::build(&mut tracing);
        let instance_count = tracing.levels.len() as u64;
        if parts.hits && tracing.id_count > MOST_IDS {
            let remedy = "render with `indirect none`, or fewer instances of large meshes";
            let list = "triangles of all instances";
            return Err(RenderError::Overflow { list, needed: tracing.id_count, limit: MOST_IDS, remedy });
        }
        let node_count = nodes.len() as u64;
        let triangles = &tracing.triangles;
        let light_trees = parts.light_trees.then(|| {
            let emissive = match parts.hits {
                true => emissive::triangles(scene, storage, &tracing.parts, triangles),
                false => Vec::new(),
            };
            SceneLightTrees::new(device, queue, &lights, emissive)
        });
        let light_trees = light_trees.transpose()?;
        let leaves: Vec<_> = light_trees.iter().flat_map(SceneLightTrees::leaves).collect();
        // A ray query has no triangle for the slope of a pane.
        let needs_bvh = parts.bvh || parts.instances || (parts.rays() && !tracing.panes.is_empty());
        let upper = Upper::of(&tracing, &mut nodes);
        let bvh = needs_bvh.then(|| Bvh::new(device, nodes, &tracing, &leaves)).transpose()?;
        let tlas = parts.ray_query.then(|| Tlas::new(device, queue, triangles)).transpose()?;

        let stored = scene.environment.as_ref().map(|environment| stored_environment(environment, light_unit));
        let environment = match (unchanged.environment, &stored) {
            (None, Some(environment)) => Some(EnvironmentImage::new(device, queue, environment)?),
            (kept, _) => kept,
        };

        let environment_and_image = stored.as_deref().zip(environment.as_ref());
        let refracts = scene.materials.iter().any(|m| ImageBehind::of(m, shading) == ImageBehind::Refracts);
        let needs_light = parts.environment_visibility || (parts.hits && environment_and_image.is_some()) || refracts;
        let environment_light = match unchanged.environment_light {
            None if needs_light => Some(EnvironmentLight::new(device, queue, environment_and_image)?),
            kept => kept,
        };

        let mut counters = vec![
            (DRAWS.to_owned(), geometry.draws.len() as u64),
            (LIGHTS.to_owned(), lights.capacity.into()),
            ("scene/textures_bytes".to_owned(), textures.bytes),
            ("scene/traced_triangles".to_owned(), triangles.len() as u64),
            (NODES.to_owned(), node_count),
            ("scene/traced_instances".to_owned(), instance_count),
        ];
        if let Some(environment) = &environment {
            counters.push((ENVIRONMENT_BYTES.to_owned(), environment.bytes));
        }
        Ok(Self {
            bounds: geometry.bounds(),
            stored: StoredLight { bounds: geometry.bounds(), ..light },
            geometry,
            textures,
            traced_triangles: triangles.len() as u32,
            sky: scene.sky / light_unit,
            environment,
            environment_light,
            materials,
            lights,
            has_area_lights: has_area_lights(scene),
            soft_shadows: uniform_buffer_of(
                device,
                "scene/soft_shadows",
                &SoftShadows { rays: needs.lights.shadow_rays },
            ),
            bvh,
            upper,
            traced_levels: uniform_buffer_of(device, "scene/traced_levels", &tracing.shader_levels()),
            tlas,
            masks: storage_buffer_of(device, "scene/masks", &tracing.masks, none)?,
            panes: std::mem::take(&mut tracing.panes),
            hits: match parts.hits {
                false => None,
                true => Some(Hits::new(device, queue, scene, storage, (&tracing.parts, &tracing.triangles))?),
            },
            light_trees,
            placed: Placed::new(scene, tracing, unchanged.decided, skipped_levels),
            moving: None,
            bending: None,
            previous: Previous::default(),
            device: device.clone(),
            needs,
            counters,
        })
    }

    /// Bindings of the scene's buffers, under the names that the shaders use.
    #[doc(hidden)]
    pub fn bindings(&self) -> Bindings<'_> {
        let mut bindings = self
            .materials
            .all()
            .buffer("draw_instances", &self.geometry.instances)
            .with(&self.lights.bindings())
            .buffer("soft_shadows", &self.soft_shadows)
            .buffer("traced_levels", &self.traced_levels)
            .buffer("masks", &self.masks);
        if let Some(bvh) = &self.bvh {
            bindings = bindings.buffer("bvh_nodes", &bvh.nodes).buffer("bvh_triangles", &bvh.triangles);
        }
        if let Some(hits) = &self.hits {
            bindings = bindings.with(&hits.bindings());
        }
        if let Some(trees) = &self.light_trees {
            bindings = bindings.with(&trees.bindings());
        }
        if let Some(light) = &self.environment_light {
            bindings = bindings.with(&light.bindings());
        }
        if let Some(tlas) = &self.tlas {
            bindings =
                bindings.resource("scene_tlas", tlas.tlas.as_binding()).buffer("tlas_triangles", &tlas.triangles);
        }
        bindings
    }

    /// True if shadow rays may pass a surface in part.
    pub(crate) fn has_panes(&self) -> bool {
        !self.panes.is_empty()
    }

    /// True if light arrives from around the scene: a constant sky, or an environment image.
    #[doc(hidden)]
    pub fn has_sky(&self) -> bool {
        self.sky != Vec3::ZERO || self.environment.is_some()
    }

    /// Nits that are stored as 1 on the device: see `upload/light_unit.rs`.
    #[doc(hidden)]
    pub fn light_unit(&self) -> f32 {
        self.stored.light_unit
    }

    /// World-space box around its geometry, m.
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Its lights.
    #[doc(hidden)]
    pub fn lights(&self) -> &LightSet {
        &self.lights
    }

    /// Triangles that rays can hit, each with the instance that it belongs to.
    #[doc(hidden)]
    pub fn traced_triangles(&self) -> u32 {
        self.traced_triangles
    }

    /// The environment as light.
    ///
    /// Panics if the scene was uploaded with settings that do not require it; a renderer checks that before it records
    /// a frame.
    #[doc(hidden)]
    pub fn environment_light(&self) -> &EnvironmentLight {
        self.environment_light.as_ref().expect("uploaded for a renderer without occlusion")
    }

    /// Emissive triangles that rays hit, if hits are shaded.
    #[doc(hidden)]
    pub fn emissive_triangles(&self) -> &[EmissiveTriangle] {
        self.light_trees.as_ref().map_or(&[], SceneLightTrees::triangles)
    }

    /// True if hits are shaded and rays hit any emissive triangle.
    #[doc(hidden)]
    pub fn has_emissive_triangles(&self) -> bool {
        self.light_trees.as_ref().is_some_and(|trees| trees.triangle_count() > 0)
    }

    /// Instances that have a tree of their mesh below them.
    pub(crate) fn instances_in_levels(&self) -> u64 {
        self.upper.as_ref().map_or(0, |upper| upper.levels.len() as u64)
    }

    /// The BVH's nodes, if there is a BVH.
    #[cfg(test)]
    pub(crate) fn bvh_nodes(&self) -> Option<&wgpu::Buffer> {
        self.bvh.as_ref().map(|bvh| &bvh.nodes)
    }

    /// The BVH's triangles, if there is a BVH.
    #[doc(hidden)]
    pub fn bvh_triangles(&self) -> Option<&wgpu::Buffer> {
        self.bvh.as_ref().map(|bvh| &bvh.triangles)
    }

    /// The textures of one material, if textures are not one array, and the first material's parameters.
    pub(crate) fn bindings_of_material(&self, material: u32) -> Bindings<'_> {
        self.textures.of_material(material).with(&self.materials.of_draw())
    }

    /// Distance of a material's parameters from the first's, bytes.
    pub(crate) fn offset_of_material(&self, material: u32) -> u32 {
        self.materials.offset(material)
    }

    /// Sizes of what was uploaded.
    pub fn counters(&self) -> &[(String, u64)] {
        &self.counters
    }
}
