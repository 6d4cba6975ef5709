//! Builds trees on the host, or on a graphics card where there are many triangles (`lanternfish-bvh`). A software adapter has no more
//! cores than the host, whose builder does less work.
//!
//! The host follows the indices of a tree, so it checks those that a card has built: each primitive is in one leaf, children are behind
//! their parent, and no path is too long for the traversal's stack. It refits the boxes. If a tree fails the check, the host builds it.
//! The host also builds the trees of meshes below instances, all at once.

use lanternfish_bvh::{BvhBuilder, DeviceBvh, Primitives};
use lanternfish_gpu::{Frame, GpuError, Pool, Profiler, checked, read_back, storage_buffer_of};
use lanternfish_scene::{
    Bounds,
    bvh::{self, Effort, MAX_DEPTH, depth},
};
use obvhs::{
    aabb::Aabb,
    cwbvh::{BRANCHING, CwBvh, node::CwBvhNode},
};

use super::refit::refit;

/// Fewest primitives that a card builds a tree over: the host needs some milliseconds for them.
const LEAST: usize = 1 << 15;
/// Words of a level in [`DeviceBvh::levels`].
const LEVEL_WORDS: usize = 8;
/// Number of nodes of a level among its words.
const NODE_COUNT: usize = 3;
/// First node of a level among its words.
const FIRST_NODE: usize = 4;

/// Where trees are built.
#[derive(Debug)]
pub struct Builder<'a>(Option<(&'a wgpu::Device, &'a wgpu::Queue)>);

impl<'a> Builder<'a> {
    /// The host.
    #[cfg(test)]
    pub const HOST: Self = Self(None);

    /// This device for the trees that it builds faster, and the host for the others.
    pub fn of(device: &'a wgpu::Device, queue: &'a wgpu::Queue) -> Self {
        Self(Some((device, queue)))
    }

    /// Builds a tree over boxes with finite corners.
    pub fn build(&self, boxes: &[Aabb]) -> CwBvh {
        let of_card = self.0.filter(|(device, _)| builds(device, boxes.len()));
        of_card
            .and_then(|(device, queue)| on_device(device, queue, boxes))
            .unwrap_or_else(|| bvh::build(boxes, Effort::High))
    }
}

/// True if the device builds a tree over so many triangles faster than the host. A browser's program cannot wait for it.
fn builds(device: &wgpu::Device, count: usize) -> bool {
    #[cfg(test)]
    if IS_FORCED.get() {
        return true;
    }
    let is_card = |kind| matches!(kind, wgpu::DeviceType::DiscreteGpu | wgpu::DeviceType::IntegratedGpu);
    !cfg!(target_arch = "wasm32") && count >= LEAST && is_card(device.adapter_info().device_type)
}

/// A tree over boxes, built on a device; none, with a warning, if it has built none.
fn on_device(device: &wgpu::Device, queue: &wgpu::Queue, boxes: &[Aabb]) -> Option<CwBvh> {
    let built = checked(device, "BVH", || try_on_device(device, queue, boxes));
    let failed = |error: &GpuError| tracing::warn!("a BVH is built on the host: {error}");
    let built = built.inspect_err(failed).ok()?;
    if built.is_none() {
        tracing::warn!("a BVH is built on the host: what the device has built is no tree");
    }
    built
}

fn try_on_device(device: &wgpu::Device, queue: &wgpu::Queue, boxes: &[Aabb]) -> Result<Option<CwBvh>, GpuError> {
    let corners: Vec<[[f32; 4]; 2]> =
        boxes.iter().map(|own| [own.min, own.max].map(|corner| [corner.x, corner.y, corner.z, 0.0])).collect();
    let corners = storage_buffer_of(device, "scene/boxes", &corners, wgpu::BufferUsages::empty())?;
    let mut tree = DeviceBvh::new(device, boxes.len() as u32)?;
    let (mut profiler, mut pool) = (Profiler::new(device, queue), Pool::new(device));
    let mut frame = Frame::pooled(device, queue, &mut profiler, &mut pool);
    BvhBuilder::new(device)?.build(&mut frame, Primitives::Boxes(&corners), boxes.len() as u32, &mut tree)?;
    frame.submit();
    let levels = read_back(device, queue, &tree.levels, tree.levels.size() as usize / 4)?;
    let count = node_count(&levels);
    if count as u64 > tree.nodes.size() / size_of::<CwBvhNode>() as u64 {
        return Ok(None);
    }
    let nodes = read_back(device, queue, &tree.nodes, count)?;
    let Some(mut tree) = whole_tree(nodes, read_back(device, queue, &tree.indices, boxes.len())?) else {
        return Ok(None);
    };
    let box_of = |index: usize| {
        let own = boxes[tree.primitive_indices[index] as usize];
        Bounds { min: own.min.into(), max: own.max.into() }
    };
    refit(&mut tree.nodes, box_of);
    Ok(Some(tree))
}

/// Number of nodes that a device has built. `levels`: words of [`DeviceBvh::levels`].
fn node_count(levels: &[u32]) -> usize {
    let ends = levels.chunks_exact(LEVEL_WORDS).map(|level| level[FIRST_NODE].wrapping_add(level[NODE_COUNT]));
    ends.max().unwrap_or_default() as usize
}

/// A tree as the traversal needs it, of what a device has built; none if it is not one.
fn whole_tree(nodes: Vec<CwBvhNode>, order: Vec<u32>) -> Option<CwBvh> {
    let mut is_child = vec![false; nodes.len()];
    let mut is_in_leaf = vec![false; order.len()];
    // Notes an index that was not there before.
    let takes =
        |seen: &mut [bool], index: usize| seen.get_mut(index).is_some_and(|seen| !std::mem::replace(seen, true));
    for (index, node) in nodes.iter().enumerate() {
        for slot in (0..BRANCHING).filter(|slot| !node.is_child_empty(*slot)) {
            // What obvhs expects of an inner node.
            if !node.is_leaf(slot) && node.child_meta[slot] & 31 != 24 + slot as u8 {
                return None;
            }
            if node.is_leaf(slot) {
                let (first, count) = node.child_primitives(slot);
                let mut own = (0..count as usize).map(|i| (first as usize).saturating_add(i));
                if !own.all(|place| takes(&mut is_in_leaf, place)) {
                    return None;
                }
            } else {
                let child = node.child_node_index(slot) as usize;
                if child <= index || !takes(&mut is_child, child) {
                    return None;
                }
            }
        }
    }
    let mut is_primitive = vec![false; order.len()];
    let is_whole = order.iter().all(|primitive| takes(&mut is_primitive, *primitive as usize))
        && is_in_leaf.iter().all(|is_in| *is_in)
        && is_child.iter().skip(1).all(|is_child| *is_child);
    (is_whole && !nodes.is_empty() && depth(&nodes) <= MAX_DEPTH).then(|| CwBvh {
        nodes,
        primitive_indices: order,
        ..CwBvh::default()
    })
}

#[cfg(test)]
thread_local! {
    /// True if every adapter builds trees on this thread.
    pub static IS_FORCED: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

#[cfg(test)]
mod tests {
    use lanternfish_gpu::testing;

    use super::{super::refit::cost, *};
    use crate::testing::Random;

    fn boxes(count: usize) -> Vec<Aabb> {
        let mut random = Random::new(3);
        let one = |_| {
            let corner = 20.0 * random.point();
            Aabb::new(corner.into(), (corner + 0.1 + random.point().abs()).into())
        };
        (0..count).map(one).collect()
    }

    #[gpu_test]
    fn gpu_a_tree_from_the_device_costs_about_as_much(gpu: &Gpu) {
        let boxes = boxes(3000);
        let of_host = bvh::build(&boxes, Effort::High);
        let of_device = on_device(&gpu.device, &gpu.queue, &boxes).unwrap();
        let cost = |tree: &CwBvh| {
            let box_of = |index: usize| &boxes[tree.primitive_indices[index] as usize];
            cost(&tree.nodes, |index| Bounds { min: box_of(index).min.into(), max: box_of(index).max.into() })
        };
        let [host, device] = [&of_host, &of_device].map(cost);
        println!("the device's tree costs {:.3} of the host's", device / host);
        // The crate's README: up to a twentieth more.
        assert!(device < 1.1 * host, "{device}, {host}");
    }

    /// Any index that is off would make the host, or a ray, read another node or triangle, or loop.
    #[test]
    fn a_tree_with_a_wrong_index_is_none() {
        let tree = bvh::build(&boxes(500), Effort::High);
        let check = |edit: &dyn Fn(&mut Vec<CwBvhNode>, &mut Vec<u32>)| {
            let (mut nodes, mut order) = (tree.nodes.clone(), tree.primitive_indices.clone());
            edit(&mut nodes, &mut order);
            whole_tree(nodes, order).is_some()
        };
        assert!(check(&|_, _| {}));
        assert!(!check(&|nodes, _| nodes.clear()));
        assert!(!check(&|nodes, _| nodes.push(CwBvhNode::default())));
        assert!(!check(&|nodes, _| nodes.truncate(nodes.len() - 1)));
        assert!(!check(&|_, order| order[3] = order[4]));
        assert!(!check(&|_, order| order[3] = u32::MAX));
        for node in 0..tree.nodes.len() {
            let has_leaf = (0..BRANCHING).any(|slot| tree.nodes[node].is_leaf(slot));
            for by in [1, u32::MAX] {
                let shift = |base: &mut u32| *base = base.wrapping_add(by);
                assert!(!check(&|nodes, _| shift(&mut nodes[node].primitive_base_idx)) || !has_leaf, "node {node}");
                let has_child = tree.nodes[node].imask > 0;
                assert!(!check(&|nodes, _| shift(&mut nodes[node].child_base_idx)) || !has_child, "node {node}");
            }
            for slot in (0..BRANCHING).filter(|slot| (tree.nodes[node].imask >> slot) & 1 == 1) {
                for bits in [7, 23, 24 + (slot as u8 + 1) % 8] {
                    let edit = |meta: &mut u8| *meta = (*meta & !31) | bits;
                    assert!(!check(&|nodes, _| edit(&mut nodes[node].child_meta[slot])), "node {node}");
                }
            }
        }
    }
}
