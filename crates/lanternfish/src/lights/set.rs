//! Sets of lights for which culling makes lists: a scene's own lights, and those that a technique makes on the device.

use std::sync::Arc;

use lanternfish_gpu::{Bindings, gpu_struct, uniform_buffer_of};
use lanternfish_scene::Bounds;

use super::{Light, LightStorage};

gpu_struct! {
    /// The number of lights of a set, and how they fall off.
    pub struct LightCount {
        /// Number of lights in `lights`; the buffer may be longer.
        count: u32,
        /// Near radius R0 of the attenuation, m.
        near_radius: f32,
        /// Coefficients of the attenuation `clq`: c0.
        constant: f32,
        /// c1, 1/m.
        linear: f32,
        /// c2, 1/m².
        quadratic: f32,
    }
}

impl LightCount {
    /// The first `count` lights of a buffer that were packed with these settings.
    pub fn new(count: u32, settings: &LightStorage) -> Self {
        let [constant, linear, quadratic] = settings.falloff.coefficients.0;
        Self { count, near_radius: settings.falloff.near_radius, constant, linear, quadratic }
    }
}

/// Lights on the device; every technique of light culling takes them.
#[derive(Clone, Debug)]
pub struct LightSet {
    /// The lights ([`Light`]), bound as `lights`.
    pub lights: wgpu::Buffer,
    /// A [`LightCount`], bound as the uniform `light_count`.
    pub count: wgpu::Buffer,
    /// The device's count, if the device counted them: one u32, unknown to the host.
    pub counted: Option<wgpu::Buffer>,
    /// Copies on the host, if it has them.
    pub on_host: Arc<[Light]>,
    /// Greatest number of lights; the exact number if the host has it.
    pub capacity: u32,
    /// World-space box around the centres of all lights that have one.
    pub bounds: Bounds,
    /// Name of the lists of light indices made of this set; lists of the same name have the same capacity.
    pub list: &'static str,
    /// Remedy in the error for a full list, if it differs from that of a scene's lights.
    pub remedy: Option<&'static str>,
}

impl LightSet {
    /// A set of lights that are also on the host and were packed with these settings; the buffer holds these, and may be longer.
    pub(crate) fn new(
        device: &wgpu::Device,
        buffer: wgpu::Buffer,
        lights: Vec<Light>,
        bounds: Bounds,
        settings: &LightStorage,
    ) -> Self {
        let count = lights.len() as u32;
        Self {
            lights: buffer,
            count: uniform_buffer_of(device, "lights/count", &LightCount::new(count, settings)),
            counted: None,
            on_host: lights.into(),
            capacity: count,
            bounds,
            list: "light_culling/indices",
            remedy: None,
        }
    }

    /// Greatest number of lights; the exact number if the host has it.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("lights", &self.lights).buffer("light_count", &self.count)
    }
}
