//! Light that comes evenly from all around, and less of it from below: what a room of indirect light has, and no more.

#[cfg(test)]
mod tests;
#[cfg(test)]
mod twin;

use lanternfish_gpu::{ComputeKernel, Frame, SharedStruct, gpu_struct, uniform_buffer_of};

use super::{IndirectPasses, IndirectRoom, IndirectSums, layers_target};
use crate::{
    context::ViewContext,
    error::RenderError,
    prepass::Surface,
    rays::Tracer,
    rooms::{Knob, Range, Room},
    settings::Settings,
    shaders::{Root, Shaders},
};

/// Light that comes evenly from all around, and less of it from below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewRoom {
    /// Radiance from above, nits, > 0. Higher: brighter.
    pub radiance: f32,
}

impl Default for NewRoom {
    fn default() -> Self {
        Self { radiance: 1.0 }
    }
}

impl Room for NewRoom {
    const NAME: &'static str = "new-room";
    const WORDS: &'static str = "Light that comes evenly from all around, and less of it from below";
    const KNOBS: &'static [Knob<Self>] = &[Knob::new(
        "new-room-radiance",
        "NITS",
        Range::Positive,
        "Radiance from above, nits. Higher: brighter",
        |room| &mut room.radiance,
    )];
    const SHADERS: Shaders =
        Shaders::new(&[Root::new("indirect/new_room/find")], &[SharedStruct::of::<NewRoomParameters>()]);
}

impl IndirectRoom for NewRoom {
    fn build(
        &self,
        device: &wgpu::Device,
        _settings: &Settings,
        _tracer: Option<Tracer>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError> {
        let shader = <NewRoom as Room>::SHADERS.link("indirect/new_room/find", &[])?;
        let parameters = NewRoomParameters { radiance: self.radiance };
        Ok(Box::new(NewRoomPasses {
            find: ComputeKernel::new(device, &shader, "find", "indirect/new_room/find"),
            parameters: uniform_buffer_of(device, "indirect/new_room", &parameters),
        }))
    }
}

gpu_struct! {
    /// What the pass is told.
    pub struct NewRoomParameters {
        /// Radiance from above, nits.
        radiance: f32,
    }
}

/// The pass.
#[derive(Debug)]
struct NewRoomPasses {
    find: ComputeKernel,
    parameters: wgpu::Buffer,
}

impl IndirectPasses for NewRoomPasses {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<IndirectSums, RenderError> {
        let layers = layers_target(frame, surface.size);
        let [width, height, _] = self.find.workgroup_size();
        let groups = [surface.size.x.div_ceil(width), surface.size.y.div_ceil(height), 1];
        let view_bindings = view.buffer.bindings();
        let bindings = view_bindings.with(&surface.bindings());
        let bindings = bindings.buffer("parameters", &self.parameters).texture("found_layers", &layers);
        frame.dispatch(&self.find, &bindings, groups);
        Ok(IndirectSums { layers, counters: Vec::new() })
    }
}
