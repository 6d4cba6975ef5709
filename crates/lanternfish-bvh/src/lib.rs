//! Builds a bounding volume hierarchy on the device: compressed wide nodes `[Ylitie2017]` from locally ordered clustering `[Meister2018]`,
//! and refits it. The host reads nothing back.
//!
//! ```no_run
//! # use lanternfish_bvh::{BvhBuilder, DeviceBvh, Primitives};
//! # fn example(device: &wgpu::Device, frame: &mut lanternfish_gpu::Frame<'_>, corners: wgpu::Buffer, count: u32)
//! # -> Result<(), lanternfish_gpu::GpuError> {
//! let builder = BvhBuilder::new(device)?;
//! let mut bvh = DeviceBvh::new(device, count)?;
//! builder.build(frame, Primitives::Triangles(&corners), count, &mut bvh)?;
//! // After the triangles have moved:
//! builder.refit(frame, Primitives::Triangles(&corners), &bvh)?;
//! # Ok(())
//! # }
//! ```
//!
//! See the crate's README for the steps.

#[cfg(test)]
#[macro_use]
extern crate lanternfish_gpu_test;

mod builder;
mod clustering;
mod parameters;
mod wide;

#[cfg(test)]
mod tests;

use lanternfish_gpu::{GpuError, ShaderLibrary, storage_buffer, storage_buffer_of};

pub use builder::BvhBuilder;
use parameters::{MAX_ITERATIONS, MAX_LEVELS, WORKGROUP};

/// Every `.wesl` file of this crate; the path of a module is the path of its file.
static SHADERS: ShaderLibrary = ShaderLibrary::new(include!(concat!(env!("OUT_DIR"), "/shaders.rs")));

/// Bytes of a node: five `vec4u`.
const NODE_BYTES: u64 = 80;
/// Bytes of the longest buffer for each primitive: two `vec4u`.
const BOX_BYTES: u64 = 32;
/// Most workgroups of a dispatch along an axis, by WebGPU.
const MAX_WORKGROUPS: u64 = 65_535;

/// What a tree is built over. An element with a coordinate that is not finite or beyond 10¹⁵, and a box that is inside out, has an empty
/// box: it is in the tree's leaves, and no ray reaches it except beside other primitives of its leaf.
#[derive(Clone, Copy, Debug)]
pub enum Primitives<'a> {
    /// Three `vec4f` a triangle: its corners; w is not read.
    Triangles(&'a wgpu::Buffer),
    /// Two `vec4f` a box: its least and greatest corner; w is not read.
    Boxes(&'a wgpu::Buffer),
}

impl<'a> Primitives<'a> {
    /// The buffer. Fails if a binding cannot hold it.
    ///
    /// # Panics
    ///
    /// If it is too short, which is a bug of the caller.
    fn buffer(self, device: &wgpu::Device, count: u32) -> Result<&'a wgpu::Buffer, GpuError> {
        let (Self::Triangles(buffer) | Self::Boxes(buffer)) = self;
        let bytes = if matches!(self, Self::Triangles(_)) { 48 } else { BOX_BYTES };
        let (needed, has) = (bytes * u64::from(count), buffer.size());
        assert!(needed <= has, "{count} primitives of a BVH need {needed} bytes, their buffer has {has}");
        let limit = device.limits().max_storage_buffer_binding_size;
        match has <= limit {
            true => Ok(buffer),
            false => Err(GpuError::TooLarge { what: "primitives of a BVH".to_owned(), needed: has, limit }),
        }
    }
}

/// A tree on the device, and the memory for it.
#[derive(Debug)]
pub struct DeviceBvh {
    /// Nodes, 80 bytes each: obvhs' `CwBvhNode`. The first one is the root; nodes of a level are contiguous. A tree without primitives is one
    /// node without children.
    pub nodes: wgpu::Buffer,
    /// The index of the primitive at each place in leaf order, u32.
    pub indices: wgpu::Buffer,
    /// 33 levels, also for indirect dispatches, eight u32 each: workgroups of 256 along x, y and z, number of nodes; first node, first place
    /// in leaf order, two zeros.
    pub levels: wgpu::Buffer,
    /// Lists of each iteration of clustering, for measurements: workgroups along x, y and z, number of clusters in the lowest 31 bits.
    #[doc(hidden)]
    pub iterations: wgpu::Buffer,
    capacity: u32,
    count: u32,
}

impl DeviceBvh {
    /// Memory for a tree over at most `capacity` primitives: 27 bytes each. Fails above the count that bindings of the device hold (32
    /// bytes a primitive; 4,194,304 primitives with WebGPU's default limits) and above 16,776,960.
    pub fn new(device: &wgpu::Device, capacity: u32) -> Result<Self, GpuError> {
        let limit =
            device.limits().max_storage_buffer_binding_size.min(MAX_WORKGROUPS * u64::from(WORKGROUP) * BOX_BYTES);
        let needed = u64::from(capacity) * BOX_BYTES;
        if needed > limit {
            let what = format!("BVH of {capacity} primitives, {BOX_BYTES} bytes each");
            return Err(GpuError::TooLarge { what, needed, limit });
        }
        let table = |label, rows: u32| {
            let zeros = vec![[0u32; 4]; rows as usize];
            storage_buffer_of(device, label, &zeros, wgpu::BufferUsages::INDIRECT)
        };
        Ok(Self {
            nodes: storage_buffer(device, "bvh/nodes", NODE_BYTES * most_nodes(capacity))?,
            indices: storage_buffer(device, "bvh/indices", 4 * u64::from(capacity))?,
            levels: table("bvh/levels", 2 * (MAX_LEVELS + 1))?,
            iterations: table("bvh/iterations", MAX_ITERATIONS + 1)?,
            capacity,
            count: 0,
        })
    }
}

/// Most nodes of a tree. A node with fewer than eight children has only leaves, of at least four primitives together.
fn most_nodes(count: u32) -> u64 {
    u64::from(count) * 2 / 7 + 1
}
