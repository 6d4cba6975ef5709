//! Moving instances and deformed meshes on the device: transforms the triangles and refits the BVH's boxes. The host uploads only
//! transforms, joints and weights.
//!
//! ```text
//! joints, weights ─▶ bend.wesl ─▶ vertices ─┐
//! transforms ───────────────────────────────┴▶ pose.wesl ─▶ bvh_triangles, hit_triangles, corners of the adapter's own structure ─▶ refit.wesl, a level a pass
//! ```
//!
//! `instances.rs` moves instances, `bending.rs` holds the data of deformation, `animate.rs` applies an animation at a time, `rebuild.rs`
//! builds another BVH when this one has become costly.

mod animate;
mod bending;
mod instances;
mod rebuild;
#[cfg(test)]
pub(super) mod tests;

use std::ops::Range;

use glam::{Affine3A, UVec4, Vec3, Vec4};
use lanternfish_gpu::{
    Bindings, ComputeKernel, Feature, Frame, SharedStruct, gpu_struct, storage_buffer, storage_buffer_of,
};
use obvhs::cwbvh::{BRANCHING, CwBvh, node::CwBvhNode};

pub use self::bending::Bending;
use self::{
    bending::{BendParameters, BentPrimitive, Influence},
    rebuild::{Built, CostParameters, PermuteParameters, Rebuild, Watched},
};
use super::{BvhTriangle, GpuScene, HitTriangle, bvh::Bvh, geometry::mirrors};
use crate::{
    common::workgroups,
    error::RenderError,
    shaders::{Root, Shaders},
};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::new("gpu_scene/moving/bend"),
        Root::new("gpu_scene/moving/cost"),
        Root::new("gpu_scene/moving/permute"),
        Root::computed("gpu_scene/moving/pose", variants),
        Root::new("gpu_scene/moving/refit"),
    ],
    &[
        SharedStruct::of::<BentPrimitive>(),
        SharedStruct::of::<Influence>(),
        SharedStruct::of::<BendParameters>(),
        SharedStruct::of::<Moved>(),
        SharedStruct::of::<MovingParameters>(),
        SharedStruct::of::<CostParameters>(),
        SharedStruct::of::<PermuteParameters>(),
    ],
);

/// Transforms the BVH's triangles.
const BVH: Feature = Feature::new("bvh");
/// Transforms the normals of hit shading.
const HITS: Feature = Feature::new("hits");
/// Transforms the corners of the adapter's own structure.
const TLAS: Feature = Feature::new("tlas");

fn variants() -> Vec<Vec<Feature>> {
    vec![vec![BVH], vec![BVH, HITS], vec![TLAS], vec![BVH, TLAS], vec![BVH, HITS, TLAS]]
}

gpu_struct! {
    /// An instance that has moved.
    pub struct Moved {
        /// Row of the affine world_from_object.
        row_x: Vec4,
        /// Row of the affine world_from_object.
        row_y: Vec4,
        /// Row of the affine world_from_object.
        row_z: Vec4,
        /// Index of the scene's instance; ascending.
        instance: u32,
        /// −1 where the transform mirrors, else 1.
        handedness: f32,
        /// Unused.
        _pad: glam::UVec2,
    }
}

gpu_struct! {
    /// Parameters of a pass over moved instances or nodes.
    pub struct MovingParameters {
        /// Number of traced triangles.
        triangle_count: u32,
        /// Number of instances that have moved.
        moved_count: u32,
        /// Index of the level's first node in the list of all nodes.
        first_node: u32,
        /// Number of nodes of the level.
        node_count: u32,
    }
}

/// Resources of moves on the device; created at the first move.
#[derive(Debug)]
pub struct Moving {
    pose: ComputeKernel,
    refit: ComputeKernel,
    /// [`UVec4`]s: instance, first index and first vertex of each traced triangle.
    sources: wgpu::Buffer,
    tree: Option<Tree>,
    /// None: there is no BVH.
    rebuild: Option<Rebuild>,
}

/// The BVH's nodes by level.
#[derive(Debug)]
struct Tree {
    /// Least and greatest corner of each node.
    boxes: wgpu::Buffer,
    /// Indices of nodes.
    order: wgpu::Buffer,
    /// Ranges of `order`, the deepest level first.
    levels: Vec<Range<u32>>,
}

impl Tree {
    fn new(device: &wgpu::Device, bvh: &Bvh) -> Result<Self, RenderError> {
        let (order, levels) = levels(bvh.tree());
        let boxes = storage_buffer(device, "scene/node_boxes", 32 * bvh.tree().len() as u64)?;
        let order = storage_buffer_of(device, "scene/refit_order", &order, wgpu::BufferUsages::empty())?;
        Ok(Self { boxes, order, levels })
    }
}

/// Nodes level by level, the deepest first.
fn levels(tree: &[CwBvhNode]) -> (Vec<u32>, Vec<Range<u32>>) {
    let mut by_depth: Vec<Vec<u32>> = Vec::new();
    let mut level = vec![0];
    while !level.is_empty() {
        let inner = |index: &u32| {
            let node = tree[*index as usize];
            let is_inner = move |child: &usize| !node.is_child_empty(*child) && !node.is_leaf(*child);
            (0..BRANCHING).filter(is_inner).map(move |child| node.child_node_index(child))
        };
        let next = level.iter().flat_map(inner).collect();
        by_depth.push(std::mem::replace(&mut level, next));
    }
    let (mut order, mut ranges) = (Vec::new(), Vec::new());
    for level in by_depth.into_iter().rev() {
        let first = order.len() as u32;
        order.extend(level);
        ranges.push(first..order.len() as u32);
    }
    (order, ranges)
}

impl Moving {
    fn new(scene: &GpuScene) -> Result<Self, RenderError> {
        let device = &scene.device;
        let none = wgpu::BufferUsages::empty();
        scene.check_bindings()?;
        let features: Vec<Feature> =
            [(scene.bvh.is_some(), BVH), (scene.hits.is_some(), HITS), (scene.tlas.is_some(), TLAS)]
                .into_iter()
                .filter_map(|(evaluates, feature)| evaluates.then_some(feature))
                .collect();
        let kernel = |file: &str, features: &[Feature], entry: &str| {
            let label = format!("gpu_scene/moving/{file}");
            let shader = DECLARED.link(&label, features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, &label))
        };
        let tree = scene.bvh.as_ref().map(|bvh| Tree::new(device, bvh)).transpose()?;
        let rebuild = scene.bvh.as_ref().map(|_| Rebuild::new(device)).transpose()?;
        let sources: Vec<UVec4> = scene.placed.triangle_sources(&scene.geometry).collect();
        Ok(Self {
            pose: kernel("pose", &features, "pose")?,
            refit: kernel("refit", &[], "refit")?,
            sources: storage_buffer_of(device, "scene/triangle_sources", &sources, none)?,
            tree,
            rebuild,
        })
    }

    /// Adds the pass that transforms the triangles of these instances.
    fn pose(&self, frame: &mut Frame<'_>, scene: &GpuScene, moved: &[Moved]) -> Result<(), RenderError> {
        let parameters = MovingParameters {
            triangle_count: scene.traced_triangles,
            moved_count: moved.len() as u32,
            ..MovingParameters::default()
        };
        let moved = frame.storage_of("scene/moved_instances", moved)?;
        let uniform = frame.uniform(&parameters);
        let geometry = &scene.geometry;
        let mut posing = Bindings::new()
            .part("moving", &uniform)
            .buffer("moved_instances", &moved)
            .buffer("triangle_sources", &self.sources)
            .buffer("object_indices", &geometry.indices)
            .buffer("object_positions", &geometry.positions)
            .buffer("object_attributes", &geometry.attributes);
        if let Some(bvh) = &scene.bvh {
            posing = posing.buffer("posed_triangles", &bvh.triangles);
        }
        if let Some(hits) = &scene.hits {
            posing = posing.buffer("posed_hits", hits.triangles());
        }
        if let Some(tlas) = &scene.tlas {
            posing = posing.buffer("posed_corners", &tlas.vertices);
        }
        frame.dispatch(&self.pose, &posing, workgroups(scene.traced_triangles));
        Ok(())
    }

    /// Adds the passes that refit the boxes to the triangles, and returns their number.
    fn refit(&self, frame: &mut Frame<'_>, scene: &GpuScene) -> u32 {
        if let (Some(tree), Some(bvh)) = (&self.tree, &scene.bvh) {
            for level in &tree.levels {
                let parameters = MovingParameters {
                    first_node: level.start,
                    node_count: level.end - level.start,
                    ..MovingParameters::default()
                };
                let uniform = frame.uniform(&parameters);
                let refitting = Bindings::new()
                    .part("moving", &uniform)
                    .buffer("bvh_triangles", &bvh.triangles)
                    .buffer("refit_nodes", &bvh.nodes)
                    .buffer("node_boxes", &tree.boxes)
                    .buffer("refit_order", &tree.order);
                frame.dispatch(&self.refit, &refitting, workgroups(parameters.node_count));
            }
        }
        if let Some(tlas) = &scene.tlas {
            tlas.build(frame.encoder());
        }
        self.tree.as_ref().map_or(0, |tree| tree.levels.len() as u32)
    }

    /// Takes the next step of a rebuild if it is possible, and returns the number of dispatches.
    fn watch(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, has_moved: bool) -> u32 {
        let (Some(rebuild), Some(tree), Some(bvh)) = (&mut self.rebuild, &self.tree, &scene.bvh) else { return 0 };
        let watched = Watched {
            boxes: &tree.boxes,
            node_count: bvh.tree().len() as u32,
            cost_when_built: bvh.cost_when_built(),
            triangles: &bvh.triangles,
            triangle_count: scene.traced_triangles,
        };
        rebuild.go_on(frame, watched, has_moved)
    }

    /// Adds the passes that reorder everything to another tree's leaf order, and replaces the scene's tree. Its boxes must be refit
    /// afterwards. Returns the uploaded bytes.
    fn adopt(&mut self, frame: &mut Frame<'_>, scene: &mut GpuScene, built: Built) -> Result<u64, RenderError> {
        let (Some(rebuild), Some(bvh)) = (&self.rebuild, &mut scene.bvh) else { return Ok(0) };
        let Built { tree: CwBvh { nodes, primitive_indices: order, .. }, cost } = built;
        bvh.replace(frame.device, frame.queue, nodes, cost)?;
        self.tree = Some(Tree::new(frame.device, bvh)?);
        let on_device = frame.storage_of("scene/new_order", &order)?;
        let mut permute = |list: &wgpu::Buffer, words: usize| {
            rebuild.permute(frame, (&on_device, order.len() as u32), list, words as u32)
        };
        permute(&bvh.triangles, size_of::<BvhTriangle>() / 4)?;
        permute(&self.sources, size_of::<UVec4>() / 4)?;
        if let Some(hits) = &scene.hits {
            permute(hits.triangles(), size_of::<HitTriangle>() / 4)?;
        }
        if let Some(tlas) = &scene.tlas {
            permute(&tlas.vertices, 9)?;
        }
        scene.placed.reorder(&order);
        if let Some(tlas) = &scene.tlas {
            tlas.reorder(frame.queue, scene.placed.sources());
        }
        if let Some(trees) = &mut scene.light_trees {
            let mut new_index = vec![0; order.len()];
            order.iter().zip(0..).for_each(|(before, now)| new_index[*before as usize] = now);
            trees.renumber(frame.queue, &new_index);
        }
        let nodes = scene.has_rebuilt();
        let per_node = size_of::<CwBvhNode>() + size_of::<u32>();
        Ok((size_of_val(order.as_slice()) + nodes * per_node) as u64)
    }
}

/// The rows of a transform.
fn rows(transform: &Affine3A) -> [Vec4; 3] {
    let (m, t) = (transform.matrix3, transform.translation);
    [0, 1, 2].map(|i| Vec3::from(m.row(i)).extend(t[i]))
}

impl Moved {
    fn new(instance: usize, transform: &Affine3A) -> Self {
        let [row_x, row_y, row_z] = rows(transform);
        Self {
            row_x,
            row_y,
            row_z,
            instance: instance as u32,
            handedness: if mirrors(transform) { -1.0 } else { 1.0 },
            ..Self::default()
        }
    }
}

/// Work of a change of the scene on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sent {
    /// Bytes that the host uploaded.
    pub bytes: u64,
    /// Number of dispatches.
    pub dispatches: u32,
    /// True if a tree built in the background replaced the one that rays were traced through.
    pub has_rebuilt: bool,
}
