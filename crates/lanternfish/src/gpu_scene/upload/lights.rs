//! The lights of a scene in the layout that shaders read.

use lanternfish_gpu::storage_buffer_of;
use lanternfish_scene::{Bounds, LightKind, Scene};

use crate::{
    error::RenderError,
    lights::{Light, LightSet, LightStorage},
};

/// Name of the buffer and of its counter.
pub const LIGHTS: &str = "scene/lights";

/// Lights in the layout that shaders read. An error if there are more than the device can bind.
pub fn packed_lights(
    scene: &Scene,
    settings: &LightStorage,
    light_unit: f32,
    limits: &wgpu::Limits,
) -> Result<Vec<Light>, RenderError> {
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let (needed, limit) = (scene.lights.len() as u64, bytes / size_of::<Light>() as u64);
    if needed > limit {
        let remedy = "give the scene fewer (`lights`, `point`, and its own)";
        return Err(RenderError::Overflow { list: "lights", needed, limit, remedy });
    }
    Ok(scene.lights.iter().map(|light| Light::new(light, settings).in_unit(light_unit)).collect())
}

/// A scene's lights on the device.
pub fn light_set(
    device: &wgpu::Device,
    scene: &Scene,
    lights: Vec<Light>,
    settings: &LightStorage,
) -> Result<LightSet, RenderError> {
    let buffer = storage_buffer_of(device, LIGHTS, &lights, wgpu::BufferUsages::empty())?;
    Ok(LightSet::new(device, buffer, lights, light_bounds(scene), settings))
}

/// True if any light is a disk or rectangle.
pub fn has_area_lights(scene: &Scene) -> bool {
    scene.lights.iter().any(|light| light.area().is_some())
}

/// Box around the positions of the lights that have one, m.
pub fn light_bounds(scene: &Scene) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    let placed = scene.lights.iter().filter(|light| light.kind != LightKind::Directional);
    placed.for_each(|light| bounds.add_point(light.position));
    bounds
}
