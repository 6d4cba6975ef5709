//! Background rebuild of the BVH after moves have made it costly.
//!
//! 1. `refit.wesl` writes the traversal cost of each node's children beside its box; `cost.wesl` sums the costs, and the sums are read
//!    back.
//! 2. If the total exceeds [`LIMIT`] times the tree's cost when it was built, the triangles are read back, and a thread builds a tree over
//!    them.
//! 3. All lists in leaf order are put into the new tree's order (`permute.wesl`); its nodes replace the old ones, and are refit to the
//!    current triangles.
//!
//! No step waits for the device or the thread: the first call after the previous step has finished takes the next one.

use std::sync::{
    Arc, OnceLock,
    atomic::{AtomicU8, Ordering},
};

use lanternfish_gpu::{Bindings, ComputeKernel, Frame, storage_buffer};
use lanternfish_scene::{
    Bounds,
    bvh::{self, Effort},
};
use obvhs::{aabb::Aabb, cwbvh::CwBvh};

use super::{
    super::{
        shaders::BvhTriangle,
        tracing::refit::{box_of, cost},
    },
    shaders::{CostParameters, DECLARED, PermuteParameters},
};
use crate::{
    common::{WORKGROUP, workgroups},
    error::RenderError,
    platform::in_background,
};

/// A tree whose cost exceeds its cost when built by this factor is rebuilt. For Sponza's parts, a thousand of them moved by a hundredth of
/// its size, the heuristic gives a factor of 1.4, and measured times give 1.3 to 1.6.
pub const LIMIT: f64 = 1.2;
/// Sums of costs: the shader's `SUMS`.
const SUMS: u32 = 1024;

/// A pending readback.
#[derive(Debug)]
struct Expected {
    buffer: wgpu::Buffer,
    state: Arc<AtomicU8>,
}

const ON_ITS_WAY: u8 = 0;
const THERE: u8 = 1;
const LOST: u8 = 2;

impl Expected {
    /// Copies a complete buffer when these commands run.
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

    /// The data that was read back; none if the device was lost.
    fn take<T: bytemuck::Pod>(&self) -> Option<Vec<T>> {
        self.buffer.get_mapped_range(..).ok().map(|data| bytemuck::pod_collect_to_vec(&data))
    }
}

/// A finished tree.
#[derive(Debug)]
pub struct Built {
    pub tree: CwBvh,
    /// Its traversal cost: see [`cost`].
    pub cost: f64,
}

/// Stage of a rebuild.
#[derive(Debug)]
enum Stage {
    /// No rebuild.
    Resting,
    /// The cost of the tree is being read back.
    Costing(Expected),
    /// The triangles are being read back.
    Reading(Expected),
    /// A thread builds a tree.
    Building(Arc<OnceLock<Built>>),
}

/// Monitors a tree's cost and rebuilds it.
#[derive(Debug)]
pub struct Rebuild {
    sum: ComputeKernel,
    permute: ComputeKernel,
    sums: wgpu::Buffer,
    stage: Stage,
    /// True if anything has moved since the cost was last measured.
    is_behind: bool,
}

/// The monitored tree.
#[derive(Clone, Copy, Debug)]
pub struct Watched<'a> {
    /// Boxes of its nodes, written by `refit.wesl`.
    pub boxes: &'a wgpu::Buffer,
    /// Number of nodes.
    pub node_count: u32,
    /// Its cost when it was built.
    pub cost_when_built: f64,
    /// [`BvhTriangle`]s.
    pub triangles: &'a wgpu::Buffer,
    /// Number of triangles.
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

    /// True if a step is pending although nothing moves.
    pub fn is_under_way(&self) -> bool {
        self.is_behind || !matches!(self.stage, Stage::Resting)
    }

    /// The finished tree; returned once.
    pub fn built(&mut self) -> Option<Built> {
        let Stage::Building(slot) = &mut self.stage else { return None };
        let built = match Arc::get_mut(slot) {
            // The thread has finished.
            Some(slot) => slot.take(),
            None => return None,
        };
        self.stage = Stage::Resting;
        built
    }

    /// Takes the next step if it is possible, and returns the number of dispatches. `has_moved`: since the last call.
    pub fn go_on(&mut self, frame: &mut Frame<'_>, watched: Watched<'_>, has_moved: bool) -> u32 {
        self.is_behind |= has_moved;
        let stage = std::mem::replace(&mut self.stage, Stage::Resting);
        let has_come = |expected: &Expected| expected.state() != ON_ITS_WAY;
        match stage {
            Stage::Costing(expected) if has_come(&expected) => {
                let cost: f64 = expected.take::<f32>().unwrap_or_default().into_iter().map(f64::from).sum();
                let ratio = cost / watched.cost_when_built;
                tracing::debug!("the traversal cost of the BVH is {ratio:.2} times the cost when it was built");
                if ratio.is_finite() && ratio > LIMIT {
                    self.stage = Stage::Reading(Expected::of(frame.device, frame.encoder(), watched.triangles));
                    return 0;
                }
            }
            Stage::Reading(expected) if has_come(&expected) => {
                let slot = Arc::new(OnceLock::new());
                self.stage = Stage::Building(slot.clone());
                let count = watched.triangle_count as usize;
                in_background(move || {
                    // Without triangles the rebuild ends without a tree.
                    let Some(triangles) = expected.take::<BvhTriangle>() else { return };
                    // A panic here would end the program.
                    match std::panic::catch_unwind(|| build(&triangles[..count])) {
                        Ok(built) => drop(slot.set(built)),
                        Err(_) => tracing::warn!("the BVH could not be rebuilt: rays through it remain slow"),
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

    /// Adds the pass that reorders a list of records of `words` words.
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

/// The tree over triangles at their positions at readback.
fn build(triangles: &[BvhTriangle]) -> Built {
    let bounds = |triangle: &BvhTriangle| box_of(&[triangle.a, triangle.b, triangle.c]);
    let boxes: Vec<Bounds> = triangles.iter().map(bounds).collect();
    let aabbs: Vec<Aabb> = boxes.iter().map(|b| Aabb::new(b.min.into(), b.max.into())).collect();
    let tree = bvh::build(&aabbs, Effort::High);
    let cost = cost(&tree.nodes, |index| boxes[tree.primitive_indices[index] as usize]);
    Built { tree, cost }
}
