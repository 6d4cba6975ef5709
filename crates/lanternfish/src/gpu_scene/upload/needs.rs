//! Scene requirements of a renderer. `check.rs` returns the error of a scene that lacks one.

mod check;
#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicU64, Ordering};

use super::{lobes::Shading, parts::Parts};
use crate::lights::LightStorage;

/// The settings and scene parts that determine a scene on the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SceneRequirements {
    /// Number that identifies the renderer.
    renderer: u64,
    /// The parts of materials that were packed.
    pub shading: Shading,
    /// True if textures are one array, if they fit.
    pub texture_arrays: bool,
    /// Greatest number of anisotropic samples.
    pub anisotropy: u16,
    /// The settings with which lights were packed.
    pub lights: LightStorage,
    /// The parts that techniques read.
    pub parts: Parts,
}

impl SceneRequirements {
    /// The requirements of a new renderer whose techniques read `parts`.
    pub fn new(shading: Shading, lights: LightStorage, parts: Parts, texture_arrays: bool, anisotropy: u16) -> Self {
        static RENDERERS: AtomicU64 = AtomicU64::new(0);
        Self { renderer: RENDERERS.fetch_add(1, Ordering::Relaxed), shading, texture_arrays, anisotropy, lights, parts }
    }

    /// The same requirements, for the renderer that had `before`.
    pub fn of_renderer(self, before: &Self) -> Self {
        Self { renderer: before.renderer, ..self }
    }

    /// What a scene uploaded for these requirements lacks for others; none: nothing.
    pub fn lacks(&self, needed: &Self) -> Option<&'static str> {
        let faults = [
            (self.shading != needed.shading, "its materials are for another value of `materials`, or a debug view"),
            (self.texture_arrays != needed.texture_arrays, "its textures are for another value of `textures`"),
            (self.anisotropy != needed.anisotropy, "its samplers are for another value of `anisotropy`"),
            (
                self.lights != needed.lights,
                "its lights are for another attenuation or parameters of it, range threshold, light radius, sun diameter or \
                 number of shadow rays",
            ),
        ];
        let fault = faults.iter().find(|(is_fault, _)| *is_fault).map(|(_, what)| *what);
        fault.or_else(|| self.parts.lacks(needed.parts))
    }
}
