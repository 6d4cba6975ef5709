//! The error of a scene that lacks a requirement.

use lanternfish_gpu::is_same_device;

use super::{
    super::{super::scene::GpuScene, parts::Parts},
    SceneRequirements,
};
use crate::error::RenderError;

impl GpuScene {
    /// An error unless the scene is on this device and was uploaded for these requirements.
    pub(crate) fn check(&self, device: &wgpu::Device, needed: &SceneRequirements) -> Result<(), RenderError> {
        let has = &self.needs;
        // A scene of the same renderer is on its device.
        if has.renderer != needed.renderer {
            self.check_device(device)?;
        }
        lacks(has.lacks(needed))
    }

    /// An error unless the scene is on this device and has these parts.
    #[doc(hidden)]
    pub fn check_parts(&self, device: &wgpu::Device, needed: Parts) -> Result<(), RenderError> {
        self.check_device(device)?;
        lacks(self.needs.parts.lacks(needed))
    }

    fn check_device(&self, device: &wgpu::Device) -> Result<(), RenderError> {
        if is_same_device(&self.device, device) { Ok(()) } else { Err(RenderError::OtherDevice) }
    }
}

fn lacks(fault: Option<&'static str>) -> Result<(), RenderError> {
    fault.map_or(Ok(()), |what| Err(RenderError::OtherSettings { what }))
}
