//! What a renderer needs of a scene on the device, and what it says where a scene does not have it.

#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicU64, Ordering};

use lanternfish_gpu::is_same_device;

use crate::{
    error::RenderError,
    settings::{Attenuation, Indirect, Settings},
};

use super::{GpuScene, Shading};

/// The exact structures that rays are traced through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Traced {
    /// The BVH.
    pub bvh: bool,
    /// The adapter's own.
    pub ray_query: bool,
}

/// What of the settings goes into a scene on the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Needs {
    /// Whose they are: a number that no other renderer has.
    renderer: u64,
    /// Which parts of materials were packed.
    pub shading: Shading,
    /// Whether textures are one array, where they fit.
    pub texture_arrays: bool,
    /// Samples along a footprint's long axis.
    pub anisotropy: u16,
    /// What lights were packed with: the settings of these names.
    lights: (Attenuation, f32, f32, u32),
    /// Something is traced through the BVH, or made of its triangles.
    pub bvh: bool,
    /// Something is traced through the adapter's own structure.
    pub ray_query: bool,
    /// Ends of rays are shaded.
    pub hits: bool,
    /// The surroundings light by occlusion.
    pub open_surroundings: bool,
}

impl Needs {
    /// What a renderer with these settings needs, whose rays go through `traced`.
    pub fn new(settings: &Settings, traced: Traced, texture_arrays: bool, anisotropy: u16) -> Self {
        // Deep images are drawn from the BVH's triangles, and hits shaded on them, whatever traces shadows.
        let has_images = settings.occlusion.uses_deep_images();
        let Settings { attenuation, range_threshold, light_radius, shadow_rays, .. } = *settings;
        static RENDERERS: AtomicU64 = AtomicU64::new(0);
        Self {
            renderer: RENDERERS.fetch_add(1, Ordering::Relaxed),
            shading: Shading::of(settings),
            texture_arrays,
            anisotropy,
            lights: (attenuation, range_threshold, light_radius, shadow_rays),
            bvh: traced.bvh || settings.indirect != Indirect::None || has_images,
            ray_query: traced.ray_query,
            hits: settings.indirect.shades_hits(),
            open_surroundings: settings.finds_openness(),
        }
    }

    /// Whether rays are traced.
    pub fn rays(&self) -> bool {
        self.bvh || self.ray_query
    }
}

/// The scene has no BVH.
const NO_BVH: &str = "it has no BVH";
/// The scene has no structure for ray queries.
const NO_RAY_QUERY: &str = "it has no acceleration structure of the adapter's own";

impl GpuScene {
    /// An error unless it lies on this device and was uploaded for all that is needed of it.
    pub(crate) fn check(&self, device: &wgpu::Device, needed: &Needs) -> Result<(), RenderError> {
        let has = &self.needs;
        // Its own it has seen on its device.
        if has.renderer != needed.renderer {
            self.check_device(device)?;
        }
        let faults = [
            (has.shading != needed.shading, "its materials are for another `Settings::materials`, or a debug view"),
            (has.texture_arrays != needed.texture_arrays, "its textures are for another `Settings::textures`"),
            (has.anisotropy != needed.anisotropy, "its samplers are for another `Settings::anisotropy`"),
            (
                has.lights != needed.lights,
                "its lights are for another attenuation, range threshold, light radius or number of shadow rays",
            ),
            (needed.bvh && !has.bvh, NO_BVH),
            (needed.ray_query && !has.ray_query, NO_RAY_QUERY),
            (needed.hits && !has.hits, "it has nothing to shade the ends of indirect rays with"),
            (needed.open_surroundings && !has.open_surroundings, "it has no surroundings to light by occlusion"),
        ];
        lacks(faults.iter().find(|(is_fault, _)| *is_fault).map(|(_, what)| *what))
    }

    /// An error unless it lies on this device and has a BVH.
    pub(crate) fn check_bvh(&self, device: &wgpu::Device) -> Result<(), RenderError> {
        self.check_device(device)?;
        lacks((!self.needs.bvh).then_some(NO_BVH))
    }

    /// An error unless it lies on this device and has the adapter's own acceleration structure.
    pub(crate) fn check_ray_query(&self, device: &wgpu::Device) -> Result<(), RenderError> {
        self.check_device(device)?;
        lacks((!self.needs.ray_query).then_some(NO_RAY_QUERY))
    }

    fn check_device(&self, device: &wgpu::Device) -> Result<(), RenderError> {
        if is_same_device(&self.device, device) { Ok(()) } else { Err(RenderError::OtherDevice) }
    }
}

fn lacks(fault: Option<&'static str>) -> Result<(), RenderError> {
    fault.map_or(Ok(()), |what| Err(RenderError::OtherSettings { what }))
}
