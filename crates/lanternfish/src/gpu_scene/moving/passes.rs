//! The passes that transform triangles, refit the BVH and reorder it.

use std::ops::Range;

use glam::UVec4;
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame, storage_buffer, storage_buffer_of};
use obvhs::cwbvh::{BRANCHING, CwBvh, node::CwBvhNode};

use super::{
    super::{
        scene::GpuScene,
        shaders::{BvhTriangle, HitTriangle},
        tracing::bvh::Bvh,
    },
    rebuild::{Built, Rebuild, Watched},
    shaders::{BVH, DECLARED, HITS, Moved, MovingParameters, TLAS},
};
use crate::{common::workgroups, error::RenderError};

/// Resources of moves on the device; created at the first move.
#[derive(Debug)]
pub struct Moving {
    pose: ComputeKernel,
    refit: ComputeKernel,
    /// [`UVec4`]s: instance, first index and first vertex of each traced triangle.
    sources: wgpu::Buffer,
    pub(super) tree: Option<Tree>,
    /// None: there is no BVH.
    pub(super) rebuild: Option<Rebuild>,
}

/// The BVH's nodes by level.
#[derive(Debug)]
pub struct Tree {
    /// Least and greatest corner of each node.
    pub(super) boxes: wgpu::Buffer,
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
    /// The passes for the structures that the scene has.
    pub fn new(scene: &GpuScene) -> Result<Self, RenderError> {
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
    pub fn pose(&self, frame: &mut Frame<'_>, scene: &GpuScene, moved: &[Moved]) -> Result<(), RenderError> {
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
    pub fn refit(&self, frame: &mut Frame<'_>, scene: &GpuScene) -> u32 {
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
    pub fn watch(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, has_moved: bool) -> u32 {
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
    pub fn adopt(&mut self, frame: &mut Frame<'_>, scene: &mut GpuScene, built: Built) -> Result<u64, RenderError> {
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
