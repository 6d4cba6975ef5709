//! The trees of [`lanternfish_scene::light_tree`] on the device: emissive triangles, lights with a position, and the list of directional
//! lights, in one buffer (`light_tree.wesl`).

#[cfg(test)]
mod tests;

use glam::Vec3;
use lanternfish_gpu::{Bindings, GpuError, gpu_struct, storage_buffer_of, uniform_buffer_of};
use lanternfish_scene::{
    LightKind, Scene,
    light_tree::{Bound, Emitter, LightTree},
};

use crate::lights::LightSettings;

gpu_struct! {
    /// A node of a tree over emitters; world space, m.
    pub struct LightNode {
        /// Centre of the emitters' bounding box, world space, m.
        center: Vec3,
        /// Two floats of 16 bits: radiant intensity, or radiance times area, of the brightest channel (low; 0: no emission); 1/m, the
        /// reciprocal of the distance from the box beyond which nothing arrives (high).
        power_and_range: u32,
        /// Two floats of 16 bits: half the box's size, x (low), y (high).
        half_xy: u32,
        /// Two floats of 16 bits: half the box's size, z (low); sine of the half angle of the normals' cone (high).
        half_z_and_spread: u32,
        /// Four snorms: axis of the normals' cone (xyz; zero: all directions); cosine of the greatest angle between a normal and emitted
        /// light (w).
        cone: u32,
        /// Leaf: index of the light, or of the triangle in the order of the BVH's leaves.
        link: u32,
    }
}

gpu_struct! {
    /// Layout of the trees and of the list of directional lights in the node buffer.
    pub struct LightTrees {
        /// Emissive triangles; the root of their tree is node 0.
        triangle_count: u32,
        /// Levels of that tree below its root.
        triangle_depth: u32,
        /// Root of the tree over lights with a position.
        first_light: u32,
        /// Number of lights with a position.
        light_count: u32,
        /// Levels of their tree below its root.
        light_depth: u32,
        /// Node of the first directional light; the others follow it.
        first_sun: u32,
        /// Number of directional lights.
        sun_count: u32,
        /// Unused.
        _pad: u32,
    }
}

/// An emissive triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissiveTriangle {
    /// Index of the triangle, in the order of the BVH's leaves.
    pub triangle: u32,
    /// The triangle as an emitter of the tree.
    pub emitter: Emitter,
}

/// Nodes in the uploaded layout.
#[derive(Debug)]
pub(crate) struct PackedTrees {
    nodes: Vec<LightNode>,
    trees: LightTrees,
}

/// The trees of a scene on the device, and the inputs that do not come from the lights.
#[derive(Debug)]
pub(crate) struct SceneLightTrees {
    triangles: Vec<EmissiveTriangle>,
    tree: LightTree,
    nodes: wgpu::Buffer,
    trees: wgpu::Buffer,
}

impl SceneLightTrees {
    /// Builds the trees over the lights of a scene and over these triangles.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        settings: &LightSettings,
        triangles: Vec<EmissiveTriangle>,
    ) -> Result<Self, GpuError> {
        let emitters: Vec<Emitter> = triangles.iter().map(|triangle| triangle.emitter).collect();
        let tree = LightTree::new(&emitters);
        let (nodes, trees) = upload(device, &pack(scene, settings, &triangles, &tree))?;
        Ok(Self { triangles, tree, nodes, trees })
    }

    /// Rebuilds the parts that depend on the lights, whose number and positions may have changed.
    pub fn update_lights(
        &mut self,
        device: &wgpu::Device,
        scene: &Scene,
        settings: &LightSettings,
    ) -> Result<(), GpuError> {
        (self.nodes, self.trees) = upload(device, &pack(scene, settings, &self.triangles, &self.tree))?;
        Ok(())
    }

    /// Renumbers the triangles: `new_index` holds the new index of each.
    pub fn renumber(&mut self, queue: &wgpu::Queue, new_index: &[u32]) {
        self.triangles.iter_mut().for_each(|triangle| triangle.triangle = new_index[triangle.triangle as usize]);
        let mut nodes = Vec::new();
        append(&mut nodes, &self.tree, |i| self.triangles[i as usize].triangle);
        // The nodes of the emissive triangles come first.
        queue.write_buffer(&self.nodes, 0, bytemuck::cast_slice(&nodes));
    }

    /// Emissive triangles.
    pub fn triangles(&self) -> &[EmissiveTriangle] {
        &self.triangles
    }

    /// Number of emissive triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Each emissive triangle with its leaf.
    pub fn leaves(&self) -> impl Iterator<Item = (u32, u32)> {
        self.triangles.iter().map(|triangle| triangle.triangle).zip(self.tree.leaves().iter().copied())
    }

    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("light_nodes", &self.nodes).buffer("light_trees", &self.trees)
    }
}

fn upload(device: &wgpu::Device, packed: &PackedTrees) -> Result<(wgpu::Buffer, wgpu::Buffer), GpuError> {
    let nodes = storage_buffer_of(device, "scene/light_nodes", &packed.nodes, wgpu::BufferUsages::empty())?;
    Ok((nodes, uniform_buffer_of(device, "scene/light_trees", &packed.trees)))
}

fn pack(scene: &Scene, settings: &LightSettings, triangles: &[EmissiveTriangle], tree: &LightTree) -> PackedTrees {
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
            let range = light.effective_range(settings.falloff.attenuation, settings.range_threshold);
            Emitter::of_light(light, range, 0.0)
        })
        .collect();
    let lights = LightTree::new(&emitters);
    append(&mut nodes, &lights, |i| placed[i as usize] as u32);
    let first_sun = nodes.len() as u32;
    nodes.extend(suns.iter().map(|i| LightNode { link: *i as u32, ..LightNode::default() }));
    let trees = LightTrees {
        triangle_count: triangles.len() as u32,
        triangle_depth: tree.depth(),
        first_light,
        light_count: placed.len() as u32,
        light_depth: lights.depth(),
        first_sun,
        sun_count: suns.len() as u32,
        ..LightTrees::default()
    };
    PackedTrees { nodes, trees }
}

/// Appends a tree to the nodes; `link_of` gives the link of an emitter.
fn append(nodes: &mut Vec<LightNode>, tree: &LightTree, link_of: impl Fn(u32) -> u32) {
    let first_leaf = (1 << tree.depth()) - 1;
    nodes.extend(tree.nodes().iter().enumerate().map(|(i, node)| {
        let Bound { center, half, power, inverse_range, axis, cos_reach, sin_spread } = node.bound;
        let is_leaf = i >= first_leaf && power > 0.0;
        // The lower halves of these floats are zero.
        let together = |low: f32, high: f32| (low.to_bits() >> 16) | high.to_bits();
        let cone = axis.extend(cos_reach).to_array().map(|v| (v * 127.0).round() as i8 as u8);
        LightNode {
            center,
            power_and_range: together(power, inverse_range),
            half_xy: together(half.x, half.y),
            half_z_and_spread: together(half.z, sin_spread),
            cone: u32::from_le_bytes(cone),
            link: if is_leaf { link_of(node.link) } else { 0 },
        }
    }));
}
