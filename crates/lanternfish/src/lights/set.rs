//! Sets of lights that culling makes lists of: a scene's own, and those that a technique makes on the device.

use std::sync::Arc;

use lanternfish_gpu::{Bindings, gpu_struct, uniform_buffer_of};
use lanternfish_scene::Bounds;

use super::Light;

gpu_struct! {
    /// Number of lights a set has.
    pub struct LightCount {
        /// How many of `lights` there are; the buffer may be longer.
        count: u32,
    }
}

/// Lights on the device, of which any scheme of light culling makes lists.
#[derive(Clone, Debug)]
pub struct LightSet {
    /// The lights ([`Light`]), bound as `lights`.
    pub lights: wgpu::Buffer,
    /// A [`LightCount`], bound as the uniform `light_count`.
    pub count: wgpu::Buffer,
    /// Where the device has counted them, if it did: one u32, which the host does not know.
    pub counted: Option<wgpu::Buffer>,
    /// The same on the host, where it has them.
    pub on_host: Arc<[Light]>,
    /// How many there are at most; as many as there are, where the host knows.
    pub capacity: u32,
    /// World-space box that holds the centres of all that have one.
    pub bounds: Bounds,
    /// Name of the lists of light indices that are made of it: those of one name have the same room.
    pub list: &'static str,
    /// What helps where these lists have no room, if it is not what helps with a scene's lights.
    pub remedy: Option<&'static str>,
}

impl LightSet {
    /// A set of lights that the host knows: at least these are in the buffer.
    pub(crate) fn new(device: &wgpu::Device, buffer: wgpu::Buffer, lights: Vec<Light>, bounds: Bounds) -> Self {
        let count = lights.len() as u32;
        Self {
            lights: buffer,
            count: uniform_buffer_of(device, "lights/count", &LightCount { count }),
            counted: None,
            on_host: lights.into(),
            capacity: count,
            bounds,
            list: "light_culling/indices",
            remedy: None,
        }
    }

    /// Largest number of lights: exact if the host knows it.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("lights", &self.lights).buffer("light_count", &self.count)
    }
}
