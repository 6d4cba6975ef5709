//! Transient buffers that frames reuse.

use std::{cmp::Reverse, collections::HashMap};

use super::HostMemory;
use crate::{GpuError, buffer::STORAGE, made};

/// The use of a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Use {
    /// Storage with undefined content at first.
    Scratch,
    /// Storage that the host writes before any command of the frame runs.
    Uploaded,
    /// Storage that is zeroed at first, also for arguments of indirect dispatches.
    Zeroed,
    /// Readback by the host.
    Read,
}

impl Use {
    fn usages(self) -> wgpu::BufferUsages {
        match self {
            Self::Scratch | Self::Uploaded => STORAGE,
            Self::Zeroed => STORAGE | wgpu::BufferUsages::INDIRECT,
            Self::Read => wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        }
    }
}

#[derive(Debug)]
struct Slot {
    buffer: wgpu::Buffer,
    used_for: Use,
    /// The last frame that used it.
    last_frame: u64,
    /// True if a further request of that frame may have it.
    is_released: bool,
    /// True if it may have been written since it was last cleared.
    is_written: bool,
}

impl Slot {
    /// True if it is free and suits a request: neither too small nor much too large.
    fn fits(&self, used_for: Use, bytes: u64, frame: u64) -> bool {
        let size = self.buffer.size();
        (self.last_frame < frame || self.is_released)
            && self.used_for == used_for
            && size >= bytes
            && size <= (2 * bytes).max(LEAST_BYTES)
    }
}

/// Buffers up to this size suit every smaller request, bytes.
const LEAST_BYTES: u64 = 256;

#[derive(Debug)]
pub(crate) struct Buffers {
    device: wgpu::Device,
    slots: HashMap<String, Vec<Slot>>,
    frame: u64,
}

impl Buffers {
    pub fn new(device: &wgpu::Device) -> Self {
        Self { device: device.clone(), slots: HashMap::new(), frame: 0 }
    }

    /// A buffer of at least `bytes`; it may be longer. `memory` counts a new one.
    pub fn get(
        &mut self,
        memory: &mut HostMemory,
        used_for: Use,
        label: &str,
        bytes: u64,
    ) -> Result<wgpu::Buffer, GpuError> {
        let bytes = bytes.max(16).next_multiple_of(16);
        let limits = self.device.limits();
        let limit = match used_for {
            Use::Read => limits.max_buffer_size,
            _ => limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
        };
        if bytes > limit {
            return Err(GpuError::TooLarge { what: label.to_owned(), needed: bytes, limit });
        }
        if !self.slots.contains_key(label) {
            self.slots.insert(label.to_owned(), Vec::new());
        }
        let slots = self.slots.get_mut(label).expect("inserted above if it was missing");
        // One of the last frame, so that a list whose length varies keeps the buffer that is long enough for each of them. Among those the
        // smallest one, and the first of equal size: the same requests in the same order get the same buffers.
        let fitting = slots.iter_mut().filter(|slot| slot.fits(used_for, bytes, self.frame));
        if let Some(slot) = fitting.min_by_key(|slot| (Reverse(slot.last_frame), slot.buffer.size())) {
            slot.last_frame = self.frame;
            slot.is_released = false;
            slot.is_written = true;
            return Ok(slot.buffer.clone());
        }
        let size = with_slack(bytes).min(limit - limit % 16);
        memory.take(label, size)?;
        made::count(|made| made.buffers += 1);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage: used_for.usages(),
            mapped_at_creation: false,
        });
        let (last_frame, buffer_of_slot) = (self.frame, buffer.clone());
        slots.push(Slot { buffer: buffer_of_slot, used_for, last_frame, is_released: false, is_written: true });
        Ok(buffer)
    }

    /// Lets later requests of the frame have this buffer, which is neither zeroed nor read back.
    pub fn release(&mut self, buffer: &wgpu::Buffer) {
        let mut slots = self.slots.values_mut().flatten();
        if let Some(slot) = slots.find(|slot| slot.used_for == Use::Scratch && slot.buffer == *buffer) {
            slot.is_released = true;
        }
    }

    pub fn begin(&mut self, frame: u64, oldest: u64, commands: &mut wgpu::CommandEncoder) {
        self.frame = frame;
        for slots in self.slots.values_mut() {
            slots.retain(|slot| slot.last_frame >= oldest);
            for slot in slots.iter().filter(|slot| slot.used_for == Use::Zeroed && slot.is_written) {
                commands.clear_buffer(&slot.buffer, 0, None);
            }
        }
        self.slots.retain(|_, slots| !slots.is_empty());
    }

    /// Marks the buffers that the frame did not use as zero: they are once the frame's commands have run.
    pub fn submitting(&mut self) {
        let slots = self.slots.values_mut().flatten();
        slots.filter(|slot| slot.last_frame < self.frame).for_each(|slot| slot.is_written = false);
    }

    pub fn bytes(&self) -> u64 {
        self.slots.values().flatten().map(|slot| slot.buffer.size()).sum()
    }
}

/// Adds up to 1/8, so that a list that varies a little in length keeps its buffer.
fn with_slack(bytes: u64) -> u64 {
    let step = (bytes.next_power_of_two() / 16).max(16);
    bytes.next_multiple_of(step)
}

#[test]
fn slack_is_at_most_an_eighth() {
    for bytes in [16u64, 32, 48, 4096, 4112, 100_000, 1 << 27] {
        let capacity = with_slack(bytes);
        assert!(capacity >= bytes && capacity <= (bytes + bytes / 8).max(bytes + 15), "{bytes}: {capacity}");
        assert_eq!(capacity % 16, 0);
        assert_eq!(with_slack(capacity), capacity);
    }
    assert_eq!(with_slack(4112), 4608);
}
