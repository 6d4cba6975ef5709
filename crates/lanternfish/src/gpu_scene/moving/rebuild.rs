//! A tree that is built again, in the background, where moves have made the one on the device costly.
//!
//! 1. `refit.wesl` leaves beside each node's box what rays spend on its children; `cost.wesl` adds that up, and the sums come to the host.
//! 2. Where they are more than [`LIMIT`] times what the tree cost when it was built, the triangles come to the host, and a thread builds a
//!    tree over them.
//! 3. All lists in the order of the leaves are put into the new tree's order (`permute.wesl`), its nodes take the place of the old ones,
//!    and get the boxes of where things are by then.
//!
//! No step waits for the device or the thread: each is taken by the first call after the one before it is done.

use super::DECLARED;
use std::sync::{
    Arc, OnceLock,
    atomic::{AtomicU8, Ordering},
};

use lanternfish_gpu::{Bindings, ComputeKernel, Frame, gpu_struct, storage_buffer};
use lanternfish_scene::{
    Bounds,
    bvh::{self, Effort},
};
use obvhs::{aabb::Aabb, cwbvh::CwBvh};

use super::super::{
    BvhTriangle,
    refit::{box_of, cost},
};
use crate::{
    common::{WORKGROUP, workgroups},
    error::RenderError,
};

/// A tree that is so many times as costly as when it was built is built again. Sponza's parts, a thousand of them moved by a hundredth of
/// its size, make rays cost 1.4 times as much by the heuristic, and 1.3 to 1.6 times by the clock.
pub const LIMIT: f64 = 1.2;
/// Sums of costs: the shader's `SUMS`.
const SUMS: u32 = 1024;

gpu_struct! {
    /// What a pass over nodes is of.
    pub struct CostParameters {
        /// Nodes of the tree.
        node_count: u32,
    }
}

gpu_struct! {
    /// What list is put into another order.
    pub struct PermuteParameters {
        /// Records.
        record_count: u32,
        /// Words of a record.
        record_words: u32,
    }
}

/// What comes back from the device.
#[derive(Debug)]
struct Expected {
    buffer: wgpu::Buffer,
    state: Arc<AtomicU8>,
}

const ON_ITS_WAY: u8 = 0;
const THERE: u8 = 1;
const LOST: u8 = 2;

impl Expected {
    /// Copies the whole of a buffer, when these commands run.
    fn of(device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder, source: &wgpu::Buffer) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("scene/read_back"),
            size: source.size(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_buffer_to_buffer(source, 0, &buffer, 0, source.size());
        let state = Arc::new(AtomicU8::new(ON_ITS_WAY));
        let told = state.clone();
        encoder.map_buffer_on_submit(&buffer, wgpu::MapMode::Read, .., move |result| {
            told.store(if result.is_ok() { THERE } else { LOST }, Ordering::Release);
        });
        Self { buffer, state }
    }

    fn state(&self) -> u8 {
        self.state.load(Ordering::Acquire)
    }

    /// What has come; none where the device was lost.
    fn take<T: bytemuck::Pod>(&self) -> Option<Vec<T>> {
        self.buffer.get_mapped_range(..).ok().map(|data| bytemuck::pod_collect_to_vec(&data))
    }
}

/// A tree that was built.
#[derive(Debug)]
pub struct Built {
    pub tree: CwBvh,
    /// What rays spend on it: see [`cost`].
    pub cost: f64,
}

/// What is under way.
#[derive(Debug)]
enum Stage {
    /// Nothing.
    Resting,
    /// What rays spend on the tree comes to the host.
    Costing(Expected),
    /// The triangles come to the host.
    Reading(Expected),
    /// A thread builds a tree.
    Building(Arc<OnceLock<Built>>),
}

/// What watches a tree's cost, and builds another.
#[derive(Debug)]
pub struct Rebuild {
    sum: ComputeKernel,
    permute: ComputeKernel,
    sums: wgpu::Buffer,
    stage: Stage,
    /// True if anything has moved since what rays spend was last found.
    is_behind: bool,
}

/// The tree that is watched.
#[derive(Clone, Copy, Debug)]
pub struct Watched<'a> {
    /// Boxes of its nodes, as `refit.wesl` leaves them.
    pub boxes: &'a wgpu::Buffer,
    /// Number of nodes.
    pub node_count: u32,
    /// What it cost when it was built.
    pub cost_when_built: f64,
    /// [`BvhTriangle`]s.
    pub triangles: &'a wgpu::Buffer,
    /// Their number.
    pub triangle_count: u32,
}

impl Rebuild {
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let kernel = |file: &str, entry: &str| {
            let label = format!("gpu_scene/moving/{file}");
            let shader = DECLARED.link(&label, &[])?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, &label))
        };
        Ok(Self {
            sum: kernel("cost", "sum")?,
            permute: kernel("permute", "permute")?,
            sums: storage_buffer(device, "scene/cost_sums", u64::from(SUMS) * 4)?,
            stage: Stage::Resting,
            is_behind: false,
        })
    }

    /// True if a step is still to be taken, though nothing moves any more.
    pub fn is_under_way(&self) -> bool {
        self.is_behind || !matches!(self.stage, Stage::Resting)
    }

    /// A tree that was built, once.
    pub fn built(&mut self) -> Option<Built> {
        let Stage::Building(slot) = &mut self.stage else { return None };
        let built = match Arc::get_mut(slot) {
            // The thread is done with it.
            Some(slot) => slot.take(),
            None => return None,
        };
        self.stage = Stage::Resting;
        built
    }

    /// Takes the next step, where it can be taken, and returns the number of dispatches. `has_moved`: since the last time.
    pub fn go_on(&mut self, frame: &mut Frame<'_>, watched: Watched<'_>, has_moved: bool) -> u32 {
        self.is_behind |= has_moved;
        let stage = std::mem::replace(&mut self.stage, Stage::Resting);
        let has_come = |expected: &Expected| expected.state() != ON_ITS_WAY;
        match stage {
            Stage::Costing(expected) if has_come(&expected) => {
                let cost: f64 = expected.take::<f32>().unwrap_or_default().into_iter().map(f64::from).sum();
                let ratio = cost / watched.cost_when_built;
                tracing::debug!("rays through the BVH cost {ratio:.2} times as much as when it was built");
                if ratio.is_finite() && ratio > LIMIT {
                    self.stage = Stage::Reading(Expected::of(frame.device, frame.encoder(), watched.triangles));
                    return 0;
                }
            }
            Stage::Reading(expected) if has_come(&expected) => {
                let slot = Arc::new(OnceLock::new());
                self.stage = Stage::Building(slot.clone());
                let count = watched.triangle_count as usize;
                rayon::spawn(move || {
                    // Without triangles the stage ends without a tree.
                    let Some(triangles) = expected.take::<BvhTriangle>() else { return };
                    // A panic here would end the program.
                    match std::panic::catch_unwind(|| build(&triangles[..count])) {
                        Ok(built) => drop(slot.set(built)),
                        Err(_) => tracing::warn!("no other tree could be built: rays stay as slow as they are"),
                    }
                });
                return 0;
            }
            Stage::Resting => {}
            waiting => {
                self.stage = waiting;
                return 0;
            }
        }
        if !std::mem::take(&mut self.is_behind) {
            return 0;
        }
        let uniform = frame.uniform(&CostParameters { node_count: watched.node_count });
        let bindings = Bindings::new()
            .part("costed", &uniform)
            .buffer("costed_boxes", watched.boxes)
            .buffer("cost_sums", &self.sums);
        frame.dispatch(&self.sum, &bindings, [SUMS / WORKGROUP, 1, 1]);
        self.stage = Stage::Costing(Expected::of(frame.device, frame.encoder(), &self.sums));
        1
    }

    /// Adds the pass that puts a list of records of so many words into this order.
    pub fn permute(
        &self,
        frame: &mut Frame<'_>,
        order: (&wgpu::Buffer, u32),
        list: &wgpu::Buffer,
        record_words: u32,
    ) -> Result<(), RenderError> {
        let (order, record_count) = order;
        let bytes = 4 * u64::from(record_count) * u64::from(record_words);
        let before = frame.scratch("scene/records_before", bytes)?;
        frame.encoder().copy_buffer_to_buffer(list, 0, &before, 0, bytes);
        let uniform = frame.uniform(&PermuteParameters { record_count, record_words });
        let bindings = Bindings::new()
            .part("permuted", &uniform)
            .buffer("new_order", order)
            .buffer("records_before", &before)
            .buffer("records", list);
        frame.dispatch(&self.permute, &bindings, workgroups(record_count));
        Ok(())
    }
}

/// The tree over triangles where they stood.
fn build(triangles: &[BvhTriangle]) -> Built {
    let bounds = |triangle: &BvhTriangle| box_of(&[triangle.a, triangle.b, triangle.c]);
    let boxes: Vec<Bounds> = triangles.iter().map(bounds).collect();
    let aabbs: Vec<Aabb> = boxes.iter().map(|b| Aabb::new(b.min.into(), b.max.into())).collect();
    let tree = bvh::build(&aabbs, Effort::High);
    let cost = cost(&tree.nodes, |place| boxes[tree.primitive_indices[place] as usize]);
    Built { tree, cost }
}
