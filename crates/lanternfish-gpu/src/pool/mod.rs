//! Transient resources that frames reuse: buffers, textures, uniform memory, bind groups.
//!
//! A frame asks for a thing by its label and size, and gets one that no other request of the same frame has. When the next frame
//! begins all of them are free again: a steady frame asks for the same in the same order, gets the same, and makes nothing. What no
//! frame has asked for in the last few is dropped.

mod bind_groups;
mod buffers;
#[cfg(all(test, feature = "testing"))]
mod tests;
mod textures;
mod uniforms;

pub use self::bind_groups::BindGroups;
pub(crate) use self::{
    buffers::{Buffers, Use},
    textures::Textures,
    uniforms::Uniforms,
};

use crate::{Arrived, GpuError, Growth, Outcome, capacity_policy::CapacityPolicy};

/// Frames that a thing is kept for while nothing asks for it. More: less is made where a view changes back and forth, and more memory
/// waits.
const KEPT_FRAMES: u64 = 4;

/// Things that frames have used and that the next ones may. What a frame got from it holds until the next frame of the pool begins.
#[derive(Debug)]
pub struct Pool {
    pub(crate) buffers: Buffers,
    pub(crate) textures: Textures,
    pub(crate) uniforms: Uniforms,
    pub(crate) bind_groups: BindGroups,
    pub(crate) capacity_policy: CapacityPolicy,
    frame: u64,
    pub(crate) waits: u64,
}

impl Pool {
    /// An empty one, for frames of this device.
    pub fn new(device: &wgpu::Device) -> Self {
        Self {
            buffers: Buffers::new(device),
            textures: Textures::default(),
            uniforms: Uniforms::new(device),
            bind_groups: BindGroups::new(device),
            capacity_policy: CapacityPolicy::default(),
            frame: 0,
            waits: 0,
        }
    }

    /// Bytes of the buffers and textures that it holds.
    pub fn bytes(&self) -> u64 {
        self.buffers.bytes() + self.textures.bytes() + self.uniforms.bytes()
    }

    /// Every list that was ever counted, by name, and the elements that it has room for.
    pub fn capacities(&self) -> Vec<(&'static str, u64)> {
        self.capacity_policy.capacities()
    }

    /// When lists get more room from the next frame on: in the frame that needs it, unless something else is said here.
    pub fn set_growth(&mut self, device: &wgpu::Device, growth: Growth) -> Result<(), GpuError> {
        self.capacity_policy.set_growth(device, growth)
    }

    /// When lists get more room.
    pub fn growth(&self) -> Growth {
        self.capacity_policy.growth()
    }

    /// What has become of a frame that did not wait, each once, the oldest first; none while the device is still busy with it. It never
    /// waits.
    pub fn outcome(&mut self, device: &wgpu::Device) -> Option<Outcome> {
        self.capacity_policy.collect(device);
        self.capacity_policy.outcome()
    }

    /// Where frames do not wait: the words of [`crate::Frame::whole`].
    pub fn whole(&self) -> Option<wgpu::Buffer> {
        self.capacity_policy.whole()
    }

    /// What has arrived of frames that did not wait.
    pub fn arrived(&self) -> Arrived {
        self.capacity_policy.arrived()
    }

    /// How often frames have waited for the device while they were recorded.
    pub fn waits(&self) -> u64 {
        self.waits
    }

    /// Drops all bind groups. They hold what they bind, a scene that is gone among it.
    pub fn forget_bind_groups(&mut self) {
        self.bind_groups.forget();
    }

    /// Drops everything but what is known of lists: after an error, things that the device refused to make may be among it.
    pub fn empty(&mut self, device: &wgpu::Device) {
        self.buffers = Buffers::new(device);
        self.textures = Textures::default();
        self.uniforms = Uniforms::new(device);
        self.bind_groups = BindGroups::new(device);
    }

    /// Everything is free again; what a request may want to be zero becomes so at the start of these commands.
    pub(crate) fn begin(&mut self, commands: &mut wgpu::CommandEncoder) {
        self.frame += 1;
        let oldest = self.frame.saturating_sub(KEPT_FRAMES);
        self.buffers.begin(self.frame, oldest, commands);
        self.textures.begin(self.frame, oldest);
        self.uniforms.begin(self.frame, oldest);
        self.bind_groups.begin(self.frame, oldest);
    }

    /// What comes before commands are handed to the device. Those of [`Self::begin`] are among the first that are.
    pub(crate) fn submitting(&mut self, queue: &wgpu::Queue) {
        self.uniforms.write(queue);
        self.buffers.submitting();
    }
}
