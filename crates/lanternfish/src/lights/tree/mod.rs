//! The trees of [`lanternfish_scene::light_tree`] on the device: emissive triangles, lights with a position, and the list of directional
//! lights, in one buffer (`light_tree.wesl`). The host builds the tree over triangles, the device that over lights (`build.wesl`).

mod build;
#[cfg(test)]
mod tests;

use glam::Vec3;
use lanternfish_gpu::{Bindings, GpuError, gpu_struct, storage_buffer, uniform_buffer_of};
use lanternfish_scene::light_tree::{Bound, Emitter, LightTree};

use self::build::{TreeBuilder, bytes_of, depth_over};
use crate::lights::LightSet;

pub use self::build::{BuiltTree, Emitters};

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

/// The trees of a scene on the device, and the inputs that do not come from the lights.
#[derive(Debug)]
pub(crate) struct SceneLightTrees {
    triangles: Vec<EmissiveTriangle>,
    tree: LightTree,
    layout: LightTrees,
    nodes: wgpu::Buffer,
    trees: wgpu::Buffer,
    builder: TreeBuilder,
}

impl SceneLightTrees {
    /// Builds the trees over the lights of a scene and over these triangles. The lights are on the host, too.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        lights: &LightSet,
        triangles: Vec<EmissiveTriangle>,
    ) -> Result<Self, GpuError> {
        let builder = TreeBuilder::new(device, queue)?;
        let layout = LightTrees::default();
        let trees = uniform_buffer_of(device, "scene/light_trees", &layout);
        let nodes = storage_buffer(device, "scene/light_nodes", bytes_of(1))?;
        let mut all = Self { triangles: Vec::new(), tree: LightTree::default(), layout, nodes, trees, builder };
        all.replace_triangles(device, queue, lights, triangles)?;
        Ok(all)
    }

    /// Rebuilds the trees over other triangles; the lights may have changed, too.
    pub fn replace_triangles(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        lights: &LightSet,
        triangles: Vec<EmissiveTriangle>,
    ) -> Result<(), GpuError> {
        let emitters: Vec<Emitter> = triangles.iter().map(|triangle| triangle.emitter).collect();
        (self.tree, self.triangles) = (LightTree::new(&emitters), triangles);
        self.place(device, lights)?;
        self.write_triangles(queue);
        self.build(device, queue, lights)
    }

    /// Rebuilds the parts that depend on the lights, whose number and positions may have changed.
    pub fn update_lights(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        lights: &LightSet,
    ) -> Result<(), GpuError> {
        if self.place(device, lights)? {
            self.write_triangles(queue);
        }
        self.build(device, queue, lights)
    }

    /// Renumbers the triangles: `new_index` holds the new index of each.
    pub fn renumber(&mut self, queue: &wgpu::Queue, new_index: &[u32]) {
        self.triangles.iter_mut().for_each(|triangle| triangle.triangle = new_index[triangle.triangle as usize]);
        self.write_triangles(queue);
    }

    /// Lays out the trees, in another buffer if their sizes have changed. True if the triangles' nodes must be written again.
    fn place(&mut self, device: &wgpu::Device, lights: &LightSet) -> Result<bool, GpuError> {
        let placed_count = lights.on_host.iter().filter(|light| light.is_placed()).count() as u32;
        let first_light = self.tree.nodes().len() as u32;
        let sun_count = lights.on_host.iter().filter(|light| light.is_sun()).count() as u32;
        let limits = device.limits();
        let most_nodes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / bytes_of(1);
        let light_depth = depth_over(placed_count, most_nodes.saturating_sub((first_light + sun_count).into()));
        let light_nodes = if placed_count == 0 { 0 } else { (2 << light_depth) - 1 };
        let layout = LightTrees {
            triangle_count: self.triangles.len() as u32,
            triangle_depth: self.tree.depth(),
            first_light,
            light_count: placed_count,
            light_depth,
            first_sun: first_light + light_nodes,
            sun_count,
            ..LightTrees::default()
        };
        if layout == self.layout {
            return Ok(false);
        }
        // Bindings cannot be empty.
        let node_count = (layout.first_sun + layout.sun_count).max(1);
        self.nodes = storage_buffer(device, "scene/light_nodes", bytes_of(node_count as usize))?;
        self.trees = uniform_buffer_of(device, "scene/light_trees", &layout);
        self.layout = layout;
        Ok(true)
    }

    /// Writes the nodes of the emissive triangles, which come first.
    fn write_triangles(&self, queue: &wgpu::Queue) {
        let nodes = packed(&self.tree, |i| self.triangles[i as usize].triangle);
        queue.write_buffer(&self.nodes, 0, bytemuck::cast_slice(&nodes));
    }

    /// Writes the list of directional lights, and builds the tree over the others on the device.
    fn build(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, lights: &LightSet) -> Result<(), GpuError> {
        let suns = lights.on_host.iter().zip(0..).filter(|(light, _)| light.is_sun());
        let suns: Vec<LightNode> = suns.map(|(_, link)| LightNode { link, ..LightNode::default() }).collect();
        queue.write_buffer(&self.nodes, bytes_of(self.layout.first_sun as usize), bytemuck::cast_slice(&suns));
        self.builder.build(device, queue, lights, &self.nodes, &self.layout)
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

/// The nodes of a tree in the device's layout; `link_of` gives the link of an emitter.
fn packed(tree: &LightTree, link_of: impl Fn(u32) -> u32) -> Vec<LightNode> {
    let first_leaf = (1 << tree.depth()) - 1;
    let pack = |(i, node): (usize, &lanternfish_scene::light_tree::Node)| {
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
    };
    tree.nodes().iter().enumerate().map(pack).collect()
}
