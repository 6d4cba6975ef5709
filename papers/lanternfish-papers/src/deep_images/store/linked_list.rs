//! Linked lists: the builder puts each fragment once, into the next slot. Unsorted, it becomes the head of its list immediately; sorted, a
//! pass over all fragments inserts each in order. Nothing is merged, since lists are never traversed completely during the build.

use lanternfish::{RenderError, common::workgroups};
use lanternfish_gpu::{ComputeKernel, Feature, Frame, storage_buffer};

use super::{
    super::{
        images::Chunk,
        settings::{DeepImageSettings, DeepStore},
        shaders::{DECLARED, DeepGrid, PAYLOAD},
    },
    Slots, Source, check_capacity, first_guess, most_fragments, with_capacity,
};

#[derive(Debug)]
pub(crate) struct LinkedLists {
    /// The sorting pass, for sorted lists.
    link: Option<ComputeKernel>,
    payload: bool,
    /// Fragments of the largest chunk so far.
    capacity: u64,
}

impl LinkedLists {
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        let features: &[Feature] = if settings.payload { &[PAYLOAD] } else { &[] };
        let link = || {
            let link = DECLARED.link("deep_images/store/link", features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &link, "link", "deep_images/link"))
        };
        let is_sorted = settings.store == DeepStore::SortedLinkedList;
        Ok(Self { link: is_sorted.then(link).transpose()?, payload: settings.payload, capacity: 0 })
    }

    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        mut grid: DeepGrid,
        source: &mut Source<'_>,
    ) -> Result<Chunk, RenderError> {
        let device = frame.device;
        let lists = grid.list_count();
        if self.capacity == 0 {
            self.capacity = first_guess(&device.limits(), lists);
        }
        loop {
            let grid_buffer = with_capacity(&mut grid, device, self.capacity);
            let list_starts = storage_buffer(device, "deep_images/list_starts", 4 * (u64::from(lists) + 1))?;
            let slots = Slots::new(device, self.capacity, self.payload)?;
            let bindings = slots.bind(&source.bindings).buffer("deep_grid", &grid_buffer);
            let bindings = bindings.buffer("list_counters", &list_starts);
            (source.gather)(frame, &grid, &bindings)?;
            let taken = frame.read_now::<u32>(&list_starts, 1)?[0];
            if u64::from(taken) > self.capacity {
                check_capacity(taken.into(), most_fragments(&device.limits()))?;
                self.capacity = taken.into();
                continue;
            }
            if let Some(link) = &self.link {
                let bindings = bindings.buffer("list_heads", &list_starts).buffer("links", &slots.links);
                frame.dispatch(link, &bindings, workgroups(taken));
            }
            let fragments = u64::from(taken);
            let Slots { depths, triangles, links } = slots;
            return Ok(Chunk {
                grid,
                grid_buffer,
                list_starts,
                next: Some(links),
                depths,
                triangles,
                fragments,
                drawn: fragments,
                counted: None,
            });
        }
    }
}
