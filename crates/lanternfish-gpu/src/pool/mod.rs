//! Transient resources that frames reuse: buffers, textures, uniform memory, bind groups.
//!
//! A frame requests a resource by label and size, and gets one that no other request of the same frame has. When the
//! next frame begins, all resources are free again. A frame with the same requests in the same order as the previous
//! one gets the same resources and creates none. A resource without a request in the last few frames is dropped.

mod bind_groups;
mod buffers;
mod host_memory;
#[cfg(all(test, feature = "testing"))]
mod tests;
mod textures;
mod uniforms;

pub use self::bind_groups::BindGroups;
pub(crate) use self::{
    buffers::{Buffers, Use},
    host_memory::HostMemory,
    textures::Textures,
    uniforms::Uniforms,
};

use crate::{Arrived, GpuError, Growth, Outcome, capacity_policy::CapacityPolicy};

/// Number of frames that an unused resource is kept. A higher number avoids allocations when a view changes back and
/// forth, and holds more memory.
const KEPT_FRAMES: u64 = 4;

/// Transient resources that frames reuse. A frame's resources are valid until the next frame of the pool begins.
#[derive(Debug)]
pub struct Pool {
    pub(crate) buffers: Buffers,
    pub(crate) textures: Textures,
    pub(crate) uniforms: Uniforms,
    pub(crate) bind_groups: BindGroups,
    pub(crate) capacity_policy: CapacityPolicy,
    pub(crate) memory: HostMemory,
    /// Number of frames so far.
    pub(crate) frame: u64,
    /// See [`crate::AcrossFrames`].
    pub(crate) epoch: u64,
    pub(crate) waits: u64,
}

impl Pool {
    /// An empty pool for frames of this device.
    pub fn new(device: &wgpu::Device) -> Self {
        Self {
            buffers: Buffers::new(device),
            textures: Textures::default(),
            uniforms: Uniforms::new(device),
            bind_groups: BindGroups::new(device),
            capacity_policy: CapacityPolicy::default(),
            memory: HostMemory::new(device),
            frame: 0,
            epoch: 0,
            waits: 0,
        }
    }

    /// Size of its buffers and textures, bytes.
    pub fn bytes(&self) -> u64 {
        self.buffers.bytes() + self.textures.bytes() + self.uniforms.bytes()
    }

    /// Capacity, elements, of every list counted so far, by name.
    pub fn capacities(&self) -> Vec<(&'static str, u64)> {
        self.capacity_policy.capacities()
    }

    /// Sets when the capacity of lists grows, from the next frame on, and discards what earlier frames left for later
    /// ones ([`crate::AcrossFrames`]). The default is [`Growth::Blocking`].
    pub fn set_growth(&mut self, device: &wgpu::Device, growth: Growth) -> Result<(), GpuError> {
        self.epoch += 1;
        self.capacity_policy.set_growth(device, growth)
    }

    /// When the capacity of lists grows.
    pub fn growth(&self) -> Growth {
        self.capacity_policy.growth()
    }

    /// Takes the outcome of the oldest frame with deferred readback. `None` while the device is still busy with it.
    /// Never waits; returns each outcome once.
    pub fn outcome(&mut self, device: &wgpu::Device) -> Option<Outcome> {
        self.capacity_policy.collect(device);
        self.capacity_policy.outcome()
    }

    /// With deferred readback: the buffer of [`crate::Frame::completeness_buffer`].
    pub fn completeness_buffer(&self) -> Option<wgpu::Buffer> {
        self.capacity_policy.completeness_buffer()
    }

    /// Numbers of frames with deferred readback that have arrived.
    pub fn arrived(&self) -> Arrived {
        self.capacity_policy.arrived()
    }

    /// Number of blocking readbacks in all frames so far.
    pub fn waits(&self) -> u64 {
        self.waits
    }

    /// Drops all cached bind groups. They keep their resources alive, for example those of a dropped scene.
    pub fn forget_bind_groups(&mut self) {
        self.bind_groups.all.clear();
    }

    /// Drops everything except the capacities of lists, for use after an error: the pool may hold resources that the
    /// device rejected. Discards what earlier frames left for later ones, too ([`crate::AcrossFrames`]).
    pub fn empty(&mut self, device: &wgpu::Device) {
        self.epoch += 1;
        self.buffers = Buffers::new(device);
        self.textures = Textures::default();
        self.uniforms = Uniforms::new(device);
        self.bind_groups = BindGroups::new(device);
    }

    /// A buffer of at least `bytes`; it may be longer.
    pub(crate) fn buffer(&mut self, used_for: Use, label: &str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        self.buffers.get(&mut self.memory, used_for, label, bytes)
    }

    /// A view of all levels and layers of a texture with undefined content at first.
    pub(crate) fn texture(&mut self, device: &wgpu::Device, wanted: &wgpu::TextureDescriptor<'_>) -> wgpu::TextureView {
        self.textures.get(device, &mut self.memory, wanted)
    }

    /// Begins a frame: all resources are free again. Records clears of the written zeroed buffers at the start of
    /// `commands`.
    pub(crate) fn begin(&mut self, commands: &mut wgpu::CommandEncoder) {
        self.frame += 1;
        self.memory.begin();
        let oldest = self.frame.saturating_sub(KEPT_FRAMES);
        self.buffers.begin(self.frame, oldest, commands);
        self.textures.begin(self.frame, oldest);
        self.uniforms.begin(self.frame, oldest);
        self.bind_groups.begin(self.frame, oldest);
    }

    /// Prepares a submission. The frame's first submission contains the commands of [`Self::begin`].
    pub(crate) fn submitting(&mut self, queue: &wgpu::Queue) {
        self.uniforms.write(queue);
        self.buffers.submitting();
    }
}
