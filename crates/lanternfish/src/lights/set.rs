//! Sets of lights that culling makes lists of: a scene's own, and those that a technique makes on the device.

use lanternfish_gpu::{Bindings, gpu_struct, uniform_buffer_of};
use lanternfish_scene::Bounds;

gpu_struct! {
    /// How many lights a set has.
    pub struct LightCount {
        /// Those in use are the first of its buffer.
        count: u32,
    }
}

/// Lights on the device, of which any scheme of light culling makes lists.
#[derive(Clone, Debug)]
pub struct LightSet {
    /// The lights ([`Light`](super::Light)), bound as `lights`.
    pub(crate) lights: wgpu::Buffer,
    /// A [`LightCount`], bound as the uniform `light_count`.
    pub(crate) count: wgpu::Buffer,
    /// Where the device has counted them, if it did: one u32, which the host does not know.
    pub(crate) counted: Option<wgpu::Buffer>,
    /// How many there are at most; as many as there are, where the host knows.
    pub(crate) capacity: u32,
    /// World-space box that holds the centres of all that have one.
    pub(crate) bounds: Bounds,
    /// Name of the lists of light indices that are made of it: those of one name have the same room.
    pub(crate) list: &'static str,
}

impl LightSet {
    /// A set of lights whose number the host knows. `lights`: [`Light`](super::Light), so many of them at least.
    pub(crate) fn new(device: &wgpu::Device, lights: wgpu::Buffer, count: u32, bounds: Bounds) -> Self {
        let header = LightCount { count };
        let count_buffer = uniform_buffer_of(device, "lights/count", &header);
        Self { lights, count: count_buffer, counted: None, capacity: count, bounds, list: "light_culling/indices" }
    }

    /// Bindings under the names that the shaders use.
    pub(crate) fn bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("lights", &self.lights).buffer("light_count", &self.count)
    }
}
