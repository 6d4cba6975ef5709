//! Rasterization of a scene: the pipelines of a pass over its geometry, and the loop over its draws.

use std::{collections::HashMap, sync::Arc};

use lanternfish_gpu::{BindGroups, Bindings, Feature, LinkedShader, RasterPipeline, RasterState};

use super::{
    scene::GpuScene,
    upload::{
        geometry::{Draw, DrawAlpha, Facing, Side, vertex_layouts},
        materials::MATERIAL_OF_DRAW,
    },
};
use crate::{error::RenderError, lights::AREA_LIGHTS, shaders::Shaders};

/// Discards fragments that an alpha mask excludes.
pub const MASKED: Feature = Feature::new("masked");
/// Surfaces have a clear coat.
pub const LAYERED: Feature = Feature::new("layered");
/// Rays pass panes in part.
pub const PANES: Feature = Feature::new("panes");
/// Textures are one array, indexed by the shader.
pub(crate) const BINDING_ARRAYS: Feature = Feature::new("binding_arrays");

/// The variants of texture bindings.
pub const TEXTURES: &[&[Feature]] = &[&[], &[BINDING_ARRAYS]];

/// A pass over a scene's geometry with one shader, entry points `vertex` and `fragment`. It has the variants that the draws require:
/// `masked`, `layered`, `area_lights` and `panes` if the technique uses them, winding, texture arrays.
#[derive(Debug)]
pub struct SceneRaster {
    label: &'static str,
    declared: Shaders,
    module: &'static str,
    features: Vec<Feature>,
    /// True if masked draws use the `masked` variant.
    distinguish_masked: bool,
    /// True if layered draws use the `layered` variant.
    distinguish_layered: bool,
    /// True if scenes with area lights use the `area_lights` variant.
    distinguish_area_lights: bool,
    /// True if scenes with panes use the `panes` variant.
    distinguish_panes: bool,
    state: PassState,
    shaders: HashMap<Vec<Feature>, Arc<LinkedShader>>,
    pipelines: HashMap<Key, RasterPipeline>,
}

/// Render state of a pass over the geometry.
#[derive(Clone, Debug)]
pub struct PassState {
    /// Depth test and depth write.
    pub depth: wgpu::DepthStencilState,
    /// By location; none: depth alone, or the shader writes storage itself.
    pub targets: Vec<wgpu::ColorTargetState>,
    /// Samples per pixel.
    pub samples: u32,
    /// The faces that are drawn.
    pub faces: Faces,
}

/// The faces that a pass draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Faces {
    /// Those that the material shows.
    Shown,
    /// Both sides of single-sided materials too, as rays hit them.
    Both,
    /// The backs alone, of every material.
    Backs,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Key {
    features: Vec<Feature>,
    facing: Facing,
    array_lengths: [u32; 2],
}

/// The lower groups belong to the view, the scene and the pass; group 3 holds the material's textures.
const TEXTURE_GROUP: usize = 3;

impl SceneRaster {
    /// Compiles the shader `module` of a folder for the scene's draws. `label`: of the pass.
    pub fn new(
        label: &'static str,
        declared: Shaders,
        module: &'static str,
        features: &[Feature],
        distinguish_masked: bool,
        state: PassState,
    ) -> Self {
        Self {
            label,
            declared,
            module,
            features: features.to_vec(),
            distinguish_masked,
            distinguish_layered: false,
            distinguish_area_lights: false,
            distinguish_panes: false,
            state,
            shaders: HashMap::new(),
            pipelines: HashMap::new(),
        }
    }

    /// Adds a variant of the shader for layered materials.
    pub fn with_layers(self) -> Self {
        Self { distinguish_layered: true, ..self }
    }

    /// Adds a variant of the shader for scenes with area lights.
    pub fn lit_by_areas(self) -> Self {
        Self { distinguish_area_lights: true, ..self }
    }

    /// Adds a variant of the shader for scenes with panes.
    pub fn lit_through_panes(self) -> Self {
        Self { distinguish_panes: true, ..self }
    }

    /// The label of the pass.
    pub fn label(&self) -> &'static str {
        self.label
    }

    /// Compiles the missing pipelines for these draws.
    pub fn prepare(&mut self, device: &wgpu::Device, scene: &GpuScene, draws: &[&Draw]) -> Result<(), RenderError> {
        for draw in draws {
            let key = self.key(scene, draw);
            if self.pipelines.contains_key(&key) {
                continue;
            }
            if !self.shaders.contains_key(&key.features) {
                self.shaders.insert(key.features.clone(), self.declared.link(self.module, &key.features)?);
            }
            let pipeline = self.pipeline(device, scene, &key);
            self.pipelines.insert(key, pipeline);
        }
        Ok(())
    }

    fn key(&self, scene: &GpuScene, draw: &Draw) -> Key {
        let mut features = self.features.clone();
        if self.distinguish_masked && draw.alpha == DrawAlpha::Masked {
            features.push(MASKED);
        }
        if self.distinguish_layered && draw.lobes.are_layered() {
            features.push(LAYERED);
        }
        if self.distinguish_area_lights && scene.has_area_lights {
            features.push(AREA_LIGHTS);
        }
        if self.distinguish_panes && scene.has_panes() {
            features.push(PANES);
        }
        let mut array_lengths = [0; 2];
        if scene.textures.arrays {
            features.push(BINDING_ARRAYS);
            array_lengths = scene.textures.array_lengths().map(|(_, length)| length);
        }
        Key { features, facing: draw.facing, array_lengths }
    }

    fn pipeline(&self, device: &wgpu::Device, scene: &GpuScene, key: &Key) -> RasterPipeline {
        let targets: Vec<_> = self.state.targets.iter().cloned().map(Some).collect();
        let shader = &self.shaders[&key.features];
        // An unused vertex buffer is not fetched.
        let buffers = vertex_layouts();
        let read = match shader.vertex_locations("vertex").into_iter().max() {
            None | Some(0) => 1,
            Some(1..=4) => 2,
            Some(_) => 3,
        };
        let state = RasterState {
            vertex_buffers: &buffers[..read],
            primitive: wgpu::PrimitiveState {
                front_face: if key.facing.mirrored { wgpu::FrontFace::Cw } else { wgpu::FrontFace::Ccw },
                cull_mode: match (self.state.faces, key.facing.side) {
                    (Faces::Both, _) | (Faces::Shown, None) => None,
                    (Faces::Shown, Some(Side::Front)) => Some(wgpu::Face::Back),
                    (Faces::Shown, Some(Side::Back)) | (Faces::Backs, _) => Some(wgpu::Face::Front),
                },
                ..Default::default()
            },
            depth: Some(self.state.depth.clone()),
            targets: &targets,
            array_lengths: &scene.textures.array_lengths(),
            dynamic_uniform: Some(MATERIAL_OF_DRAW),
            samples: self.state.samples,
        };
        RasterPipeline::new(device, shader, "vertex", "fragment", self.label, &state)
    }

    /// Draws in the given order. [`SceneRaster::prepare`] must have been called with these draws. A shader that reads vertex positions of
    /// the previous frame reads vertex buffer 2, which the caller sets.
    pub fn draw(
        &self,
        groups: &mut BindGroups,
        pass: &mut wgpu::RenderPass<'_>,
        scene: &GpuScene,
        bindings: &Bindings<'_>,
        draws: &[&Draw],
    ) {
        pass.set_vertex_buffer(0, scene.geometry.positions.slice(..));
        pass.set_vertex_buffer(1, scene.geometry.attributes.slice(..));
        pass.set_index_buffer(scene.geometry.indices.slice(..), wgpu::IndexFormat::Uint32);
        let mut current: Option<Key> = None;
        // Materials with equal textures share a bind group: creating one takes the longer the more groups the buffer has.
        let mut textures: Option<(u32, wgpu::BindGroup)> = None;
        let mut material: Option<u32> = None;
        for draw in draws {
            let key = self.key(scene, draw);
            let pipeline = &self.pipelines[&key];
            if current.as_ref() != Some(&key) {
                pipeline.set(pass);
                pipeline.bind(groups, pass, bindings, TEXTURE_GROUP);
                if scene.textures.arrays {
                    let group =
                        scene.textures.with_arrays(|arrays| pipeline.bind_group_if_used(groups, arrays, TEXTURE_GROUP));
                    group.iter().for_each(|group| pipeline.set_group(pass, TEXTURE_GROUP, group, 0));
                }
                current = Some(key);
                (textures, material) = (None, None);
            }
            if !scene.textures.arrays && material != Some(draw.material) {
                let set = scene.textures.set_of_material(draw.material);
                if textures.as_ref().is_none_or(|(of, _)| *of != set) {
                    let bindings = scene.bindings_of_material(draw.material);
                    let group = pipeline.bind_group_if_used(groups, &bindings, TEXTURE_GROUP);
                    textures = group.map(|group| (set, group));
                }
                if let Some((_, group)) = &textures {
                    pipeline.set_group(pass, TEXTURE_GROUP, group, scene.offset_of_material(draw.material));
                }
                material = Some(draw.material);
            }
            pass.draw_indexed(draw.indices.clone(), draw.base_vertex, draw.instances.clone());
        }
    }
}
