//! One list for the whole view, of the lights that reach what lies before the eye: what a scheme of light culling has, and no more.

#[cfg(test)]
mod tests;
#[cfg(test)]
mod twin;

use lanternfish_gpu::{ComputeKernel, Counted, Feature, Frame, SharedStruct, gpu_struct};

use super::{LightCullingPasses, LightCullingRoom, LightLists, Reach};
use crate::{
    context::ViewContext,
    error::RenderError,
    lights::LightSet,
    rooms::{Knob, Room},
    settings::Samples,
    shaders::{Root, Shaders},
};

/// One list for the whole view, of the lights that reach what lies before the eye.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NewRoom {}

impl Room for NewRoom {
    const NAME: &'static str = "new-room";
    const WORDS: &'static str = "One list for the whole view, of the lights that reach what lies before the eye";
    const KNOBS: &'static [Knob<Self>] = &[];
    const SHADERS: Shaders =
        Shaders::new(&[Root::new("light_culling/new_room/list")], &[SharedStruct::of::<NewRoomList>()]);
}

impl LightCullingRoom for NewRoom {
    fn feature(&self) -> Feature {
        Feature("culling_new_room")
    }

    fn tests_every_light(&self) -> bool {
        true
    }

    fn build(&self, device: &wgpu::Device, _samples: Samples) -> Result<Box<dyn LightCullingPasses>, RenderError> {
        let shader = <NewRoom as Room>::SHADERS.link("light_culling/new_room/list", &[])?;
        Ok(Box::new(NewRoomPasses {
            count: ComputeKernel::new(device, &shader, "count", "light_culling/new_room/count"),
            write: ComputeKernel::new(device, &shader, "write", "light_culling/new_room/write"),
        }))
    }
}

gpu_struct! {
    /// What the passes are told.
    pub struct NewRoomList {
        /// Entries that the list has room for.
        capacity: u32,
    }
}

/// The passes.
#[derive(Debug)]
struct NewRoomPasses {
    count: ComputeKernel,
    write: ComputeKernel,
}

impl LightCullingPasses for NewRoomPasses {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        views: &[ViewContext<'_>],
        _reach: Reach,
        lights: &LightSet,
    ) -> Result<Vec<LightLists>, RenderError> {
        views.iter().map(|view| self.record_view(frame, view, lights)).collect()
    }
}

impl NewRoomPasses {
    /// Count, make room, write.
    fn record_view(
        &self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: &LightSet,
    ) -> Result<LightLists, RenderError> {
        let light_count = lights.capacity;
        let limit = super::most_indices(frame.device);
        let counted = frame.zeroed("light_culling/counted", 16)?;
        let cells = frame.zeroed("light_culling/cells", 8)?;
        let shared = view.buffer.bindings();
        let shared = shared.with(&lights.bindings());
        let list = frame.uniform(&NewRoomList { capacity: 0 });
        let counting = shared.clone().part("new_room_list", &list).buffer("counted", &counted);
        frame.dispatch(&self.count, &counting.buffer("cell_starts", &cells), [1, 1, 1]);
        let room = frame.room_for(&Counted {
            list: lights.list,
            words: &counted,
            starts: (&cells, 2),
            may_wrap: &|_| false,
            guess: light_count.into(),
            limit,
        })?;
        super::check_room(&room, limit, lights, "give the lights a shorter range")?;
        let indices = frame.scratch("light_culling/indices", 4 * room.capacity)?;
        let list = frame.uniform(&NewRoomList { capacity: room.capacity as u32 });
        let writing = shared.part("new_room_list", &list).buffer("listed_lights", &indices);
        frame.dispatch(&self.write, &writing, [1, 1, 1]);
        Ok(LightLists {
            cells,
            indices,
            grid: None,
            listed: room.elements,
            tests: light_count.into(),
            clusters: None,
            fragments: None,
        })
    }
}
