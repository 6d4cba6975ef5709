//! Contiguous sorted lists in one array, with surfaces merged: gather, scan, fill, sort, merge, compact.

use lanternfish::{RenderError, common::workgroups};
use lanternfish_gpu::{
    ComputeKernel, Feature, Frame, Growth, primitives::Scan, storage_buffer, storage_buffer_of, uniform_buffer_of,
};

use super::{
    super::{
        images::Chunk,
        settings::{DeepImageSettings, DeepSort},
        shaders::{BLOCK_SORT, DECLARED, DeepGrid, PAYLOAD},
    },
    SLOTS, Slots, Source, check_capacity, counted_slots, first_guess, most_fragments, with_capacity,
};

#[derive(Debug)]
pub(crate) struct LinearArray {
    scan: Scan,
    fill: ComputeKernel,
    sort: ComputeKernel,
    compact: ComputeKernel,
    payload: bool,
    /// Fragments of the fullest chunk so far.
    capacity: u64,
}

/// The feature of `store/sort.wesl` that chooses a sort.
pub(crate) fn sort_feature(sort: DeepSort) -> Option<Feature> {
    (sort == DeepSort::Blocks).then_some(BLOCK_SORT)
}

impl LinearArray {
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        let features: &[Feature] = if settings.payload { &[PAYLOAD] } else { &[] };
        let fill = DECLARED.link("deep_images/store/fill", features)?;
        let sort: Vec<_> = features.iter().copied().chain(sort_feature(settings.sort)).collect();
        let sort = DECLARED.link("deep_images/store/sort", &sort)?;
        Ok(Self {
            scan: Scan::new(device, "deep_images")?,
            fill: ComputeKernel::new(device, &fill, "fill", "deep_images/fill"),
            sort: ComputeKernel::new(device, &sort, "sort", "deep_images/sort"),
            compact: ComputeKernel::new(device, &sort, "compact", "deep_images/compact"),
            payload: settings.payload,
            capacity: 0,
        })
    }

    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        mut grid: DeepGrid,
        source: &mut Source<'_>,
    ) -> Result<Chunk, RenderError> {
        let device = frame.device;
        let lists = grid.list_count();
        let list_bytes = 4 * (u64::from(lists) + 2);
        let triangles_of =
            |label, count: u64| self.payload.then(|| storage_buffer(device, label, 4 * count)).transpose();

        // Gather and scan; where the frame waits, again where there was no room.
        // Number of fragments, and of images.
        let counted = [0, grid.image_count, 0, 0];
        let counted = storage_buffer_of(device, "deep_images/counted", &counted, wgpu::BufferUsages::empty())?;
        let limit = most_fragments(&device.limits());
        let (slots, filled_starts) = loop {
            let guess = self.capacity.max(first_guess(&device.limits(), lists));
            let capacity = frame.planned_capacity(SLOTS, guess, limit);
            let grid_buffer = with_capacity(&mut grid, device, capacity);
            let slots = Slots::new(device, capacity, self.payload)?;
            let filled_starts = storage_buffer(device, "deep_images/filled_starts", list_bytes)?;
            let bindings = slots.bind(&source.bindings).buffer("deep_grid", &grid_buffer);
            (source.gather)(frame, &grid, &bindings.buffer("list_counters", &filled_starts))?;
            // The number of taken slots becomes the end of the last list.
            let taken = 4 * (u64::from(lists) + 1);
            frame.encoder().copy_buffer_to_buffer(&filled_starts, taken, &counted, 0, 4);
            self.scan.record(frame, &filled_starts, lists + 2)?;
            let counts = frame.counted_capacity(&counted_slots(&counted, guess, limit), capacity)?;
            // With deferred readback, the count may be of larger chunks, before they were divided.
            if frame.growth() == Growth::Blocking || counts.words[1] <= grid.image_count {
                check_capacity(counts.elements, limit)?;
            }
            match frame.growth() {
                Growth::Blocking if counts.elements > capacity => self.capacity = counts.elements,
                Growth::Blocking => {
                    grid.capacity = counts.elements as u32;
                    break (slots, filled_starts);
                }
                Growth::Deferred => break (slots, filled_starts),
            }
        };
        let drawn = u64::from(grid.capacity);
        let grid_buffer = uniform_buffer_of(device, "deep_images/grid", &grid);

        // Fill, sort, merge.
        let filled_depths = storage_buffer(device, "deep_images/filled_depths", 4 * drawn)?;
        let filled_triangles = triangles_of("deep_images/filled_triangles", drawn)?;
        let shared = source.bindings.clone().buffer("deep_grid", &grid_buffer);
        let mut shared = shared.buffer("list_counters", &filled_starts).buffer("filled_depths", &filled_depths);
        if let Some(triangles) = &filled_triangles {
            shared = shared.buffer("filled_triangles", triangles);
        }
        frame.dispatch(&self.fill, &slots.bind(&shared), workgroups(grid.capacity));
        let kept = storage_buffer(device, "deep_images/list_starts", list_bytes)?;
        let sorting = shared.buffer("filled_starts", &filled_starts).buffer("kept", &kept);
        // Filling has emptied the slots.
        let mut in_blocks = sorting.clone().buffer("block_depths", &slots.depths);
        if let Some(triangles) = &slots.triangles {
            in_blocks = in_blocks.buffer("block_triangles", triangles);
        }
        frame.dispatch(&self.sort, &in_blocks, workgroups(lists));

        // Compact: `kept` becomes the starts of the remaining fragments, in the same form as `filled_starts`.
        let total = self.scan.record(frame, &kept, lists + 2)?;
        let fragments = match frame.growth() {
            Growth::Blocking => u64::from(frame.read_now::<u32>(&total, 1)?[0]),
            // An upper bound.
            Growth::Deferred => drawn,
        };
        let depths = storage_buffer(device, "deep_images/depths", 4 * fragments)?;
        let triangles = triangles_of("deep_images/triangles", fragments)?;
        let mut compacting = sorting.buffer("compact_depths", &depths);
        if let Some(triangles) = &triangles {
            compacting = compacting.buffer("compact_triangles", triangles);
        }
        frame.dispatch(&self.compact, &compacting, workgroups(lists));
        Ok(Chunk {
            grid,
            grid_buffer,
            list_starts: kept,
            next: None,
            depths,
            triangles,
            fragments,
            drawn,
            counted: Some(counted),
        })
    }
}
