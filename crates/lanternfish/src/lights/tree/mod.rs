//! The trees of [`lanternfish_scene::light_tree`] on the device: emissive triangles, lights with a place, and the list of
//! directional lights, in one buffer (`light_tree.wesl`).

#[cfg(test)]
mod tests;

use glam::Vec3;
use lanternfish_gpu::{Bindings, GpuError, gpu_struct, storage_buffer_of, uniform_buffer_of};
use lanternfish_scene::{
    LightKind, Scene,
    light_tree::{Emitter, LightTree},
};

use crate::settings::Settings;

gpu_struct! {
    /// A node of a tree over emitters; world space, m.
    pub struct LightNode {
        /// Of the box of what shines.
        min: Vec3,
        /// Radiant intensity, or radiance times area, of the brightest channel.
        power: f32,
        /// Of the box of what shines.
        max: Vec3,
        /// Nothing arrives farther from the box than this.
        range: f32,
        /// Of the cone that holds the normals, unit.
        axis: Vec3,
        /// Cosine of its half angle.
        cos_spread: f32,
        /// Cosine of the largest angle between a normal and the light that leaves.
        cos_reach: f32,
        /// Inner: the second child, the first being next; leaf: the light, or the triangle.
        link: u32,
        /// The node above; a root's is its own.
        parent: u32,
        /// 1: one emitter.
        is_leaf: u32,
    }
}

gpu_struct! {
    /// Where in the nodes which emitters are.
    pub struct LightTrees {
        /// Emissive triangles; their root is node 0.
        triangle_count: u32,
        /// Root of the lights with a place.
        first_light: u32,
        /// How many of them.
        light_count: u32,
        /// First leaf of the directional lights.
        first_sun: u32,
        /// How many of them.
        sun_count: u32,
        /// Unused.
        _pad_a: u32,
        /// Unused.
        _pad_b: u32,
        /// Unused.
        _pad_c: u32,
    }
}

/// An emissive triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EmissiveTriangle {
    /// In the order of the BVH's leaves.
    pub triangle: u32,
    /// What the tree knows of it.
    pub emitter: Emitter,
}

/// Nodes as they are uploaded.
#[derive(Debug)]
pub(crate) struct PackedTrees {
    nodes: Vec<LightNode>,
    trees: LightTrees,
}

/// On the device, and what of it does not come from the lights.
#[derive(Debug)]
pub(crate) struct SceneLightTrees {
    triangles: Vec<EmissiveTriangle>,
    tree: LightTree,
    nodes: wgpu::Buffer,
    trees: wgpu::Buffer,
}

impl SceneLightTrees {
    /// Over the lights of a scene and these triangles.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        settings: &Settings,
        triangles: Vec<EmissiveTriangle>,
    ) -> Result<Self, GpuError> {
        let emitters: Vec<Emitter> = triangles.iter().map(|triangle| triangle.emitter).collect();
        let tree = LightTree::new(&emitters);
        let (nodes, trees) = upload(device, &pack(scene, settings, &triangles, &tree))?;
        Ok(Self { triangles, tree, nodes, trees })
    }

    /// Brings lights that have moved, more or fewer too.
    pub fn update_lights(&mut self, device: &wgpu::Device, scene: &Scene, settings: &Settings) -> Result<(), GpuError> {
        (self.nodes, self.trees) = upload(device, &pack(scene, settings, &self.triangles, &self.tree))?;
        Ok(())
    }

    /// Emissive triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Each emissive triangle with its leaf.
    pub fn leaves(&self) -> impl Iterator<Item = (u32, u32)> {
        self.triangles.iter().map(|triangle| triangle.triangle).zip(self.tree.leaves().iter().copied())
    }

    /// What shaders call it.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("light_nodes", &self.nodes).buffer("light_trees", &self.trees)
    }
}

fn upload(device: &wgpu::Device, packed: &PackedTrees) -> Result<(wgpu::Buffer, wgpu::Buffer), GpuError> {
    let nodes = storage_buffer_of(device, "scene/light_nodes", &packed.nodes, wgpu::BufferUsages::empty())?;
    Ok((nodes, uniform_buffer_of(device, "scene/light_trees", &packed.trees)))
}

fn pack(scene: &Scene, settings: &Settings, triangles: &[EmissiveTriangle], tree: &LightTree) -> PackedTrees {
    let mut nodes = Vec::new();
    append(&mut nodes, tree, |i| triangles[i as usize].triangle);
    let first_light = nodes.len() as u32;
    let shine = |light: &lanternfish_scene::Light| light.intensity != Vec3::ZERO;
    let (suns, placed): (Vec<usize>, Vec<usize>) = (0..scene.lights.len())
        .filter(|i| shine(&scene.lights[*i]))
        .partition(|i| scene.lights[*i].kind == LightKind::Directional);
    let emitters: Vec<Emitter> = placed
        .iter()
        .map(|i| {
            let light = &scene.lights[*i];
            let range = light.effective_range(settings.attenuation, settings.range_threshold);
            Emitter::of_light(light, range, 0.0)
        })
        .collect();
    append(&mut nodes, &LightTree::new(&emitters), |i| placed[i as usize] as u32);
    let first_sun = nodes.len() as u32;
    nodes.extend(suns.iter().map(|i| LightNode { link: *i as u32, is_leaf: 1, ..LightNode::default() }));
    let trees = LightTrees {
        triangle_count: triangles.len() as u32,
        first_light,
        light_count: placed.len() as u32,
        first_sun,
        sun_count: suns.len() as u32,
        ..LightTrees::default()
    };
    PackedTrees { nodes, trees }
}

/// Puts a tree behind the nodes that are there; `link_of` an emitter.
fn append(nodes: &mut Vec<LightNode>, tree: &LightTree, link_of: impl Fn(u32) -> u32) {
    let first = nodes.len() as u32;
    nodes.extend(tree.nodes().iter().map(|node| {
        let Emitter { bounds, power, range, cone } = node.emitters;
        LightNode {
            min: bounds.min,
            power,
            max: bounds.max,
            range,
            axis: cone.axis,
            cos_spread: cone.cos_spread,
            cos_reach: cone.cos_reach,
            link: if node.is_leaf { link_of(node.link) } else { first + node.link },
            parent: first + node.parent,
            is_leaf: u32::from(node.is_leaf),
        }
    }));
}
