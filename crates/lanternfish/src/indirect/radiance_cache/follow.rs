//! Direct light of entries follows lights that change (`follow.wesl`).

use lanternfish_gpu::{BufferPart, ComputeKernel, Frame, storage_buffer};

use super::Table;
use crate::{common::workgroups, context::ViewContext, error::RenderError};

impl Table {
    /// Stores the lights for the next frame. `kernel`: if entries keep a history, multiplies the parts of their direct
    /// light by what the lights became since the last frame. Lights are told apart by their number: if there are more
    /// or fewer than before, nothing follows.
    pub fn follow_lights(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer, .. }: &ViewContext<'_>,
        kernel: Option<&ComputeKernel>,
        parameters: &BufferPart,
        planes: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        let now = &scene.lights().lights;
        let bytes = now.size();
        let before = self.lights.take().filter(|(lights, _)| lights.size() == 2 * bytes);
        if before.as_ref().is_some_and(|(_, revision)| *revision == scene.revision()) {
            self.lights = before;
            return Ok(());
        }
        let is_known = before.is_some();
        let lights = match before {
            Some((lights, _)) => lights,
            None => {
                // Bind groups keep the old buffer alive.
                frame.forget_bind_groups();
                storage_buffer(frame.device, "radiance_cache/lights", 2 * bytes)?
            }
        };
        if let Some(kernel) = kernel.filter(|_| is_known) {
            frame.encoder().copy_buffer_to_buffer(now, 0, &lights, bytes, bytes);
            let bindings = scene.bindings().with(&buffer.bindings()).with(&self.slots.bindings());
            let bindings = bindings.part("radiance_cache", parameters).buffer("triangle_planes", planes);
            frame.dispatch(kernel, &bindings.buffer("lights", &lights), workgroups(self.slots.count));
        }
        frame.encoder().copy_buffer_to_buffer(now, 0, &lights, 0, bytes);
        self.lights = Some((lights, scene.revision()));
        Ok(())
    }
}
