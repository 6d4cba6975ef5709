//! Openness by the normal alone: what faces up sees all of the surroundings, what faces down a part: what a room of occlusion has, and no
//! more.

#[cfg(test)]
mod tests;
#[cfg(test)]
mod twin;

use lanternfish_gpu::{ComputeKernel, Frame, SharedStruct, gpu_struct, uniform_buffer_of};

use super::{OcclusionPasses, OcclusionRoom, Openness, by_normal::LightByNormal, openness_target};
use crate::{
    context::ViewContext,
    environment_light::sums_target,
    error::RenderError,
    prepass::Surface,
    rooms::{Knob, Range, Room},
    settings::Settings,
    shaders::{Root, Shaders},
};

/// Openness by the normal alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewRoom {
    /// Openness of what faces straight down, > 0. Higher: brighter.
    pub ground: f32,
}

impl Default for NewRoom {
    fn default() -> Self {
        Self { ground: 0.5 }
    }
}

impl Room for NewRoom {
    const NAME: &'static str = "new-room";
    const WORDS: &'static str = "By the normal alone: what faces down sees less";
    const KNOBS: &'static [Knob<Self>] = &[Knob::new(
        "new-room-ground",
        "SHARE",
        Range::Positive,
        "Openness of what faces straight down. Higher: brighter",
        |room| &mut room.ground,
    )];
    const SHADERS: Shaders =
        Shaders::new(&[Root::new("occlusion/new_room/find")], &[SharedStruct::of::<NewRoomOpenness>()]);
}

impl OcclusionRoom for NewRoom {
    fn max_distance(&self) -> Option<f32> {
        None
    }

    fn build(&self, device: &wgpu::Device, _settings: &Settings) -> Result<Box<dyn OcclusionPasses>, RenderError> {
        let shader = <NewRoom as Room>::SHADERS.link("occlusion/new_room/find", &[])?;
        let parameters = NewRoomOpenness { ground: self.ground };
        Ok(Box::new(NewRoomPasses {
            find: ComputeKernel::new(device, &shader, "find", "occlusion/new_room/find"),
            light: LightByNormal::new(device)?,
            parameters: uniform_buffer_of(device, "occlusion/new_room", &parameters),
        }))
    }
}

gpu_struct! {
    /// What the pass is told.
    pub struct NewRoomOpenness {
        /// Openness of what faces straight down.
        ground: f32,
    }
}

/// The passes.
#[derive(Debug)]
struct NewRoomPasses {
    find: ComputeKernel,
    light: LightByNormal,
    parameters: wgpu::Buffer,
}

impl OcclusionPasses for NewRoomPasses {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<Openness, RenderError> {
        let texture = openness_target(frame, surface.size);
        let environment_sums = sums_target(frame, surface.size);
        let [width, height, _] = self.find.workgroup_size();
        let groups = [surface.size.x.div_ceil(width), surface.size.y.div_ceil(height), 1];
        let view_bindings = view.buffer.bindings();
        let bindings = view_bindings.with(&surface.bindings());
        let bindings = bindings.buffer("new_room_openness", &self.parameters).texture("openness_target", &texture);
        frame.dispatch(&self.find, &bindings, groups);
        let openness = Openness { texture, environment_sums, images: None };
        self.light.record(frame, view, surface, &openness);
        Ok(openness)
    }
}
