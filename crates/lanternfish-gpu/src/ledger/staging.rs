//! Three buffers through which words reach the host without anybody waiting for them.

use std::sync::{
    Arc,
    atomic::{AtomicU8, Ordering},
};

use crate::made;

const FREE: u8 = 0;
/// Copied to, and not handed to the device yet.
const COPIED: u8 = 1;
const ON_THE_WAY: u8 = 2;
const THERE: u8 = 3;
const LOST: u8 = 4;

#[derive(Debug)]
struct Slot {
    buffer: wgpu::Buffer,
    state: Arc<AtomicU8>,
    lists: Vec<&'static str>,
}

/// As many frames as a device usually has in hand: what further ones count is not read.
#[derive(Debug)]
pub(super) struct Staging {
    slots: [Slot; 3],
    /// Whose turn it is: they arrive in the order in which they were sent.
    next: usize,
}

impl Staging {
    pub fn new(device: &wgpu::Device, bytes: u64) -> Self {
        let slot = || {
            made::count(|made| made.buffers += 1);
            let buffer = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("ledger/staging"),
                size: bytes,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            });
            Slot { buffer, state: Arc::new(AtomicU8::new(FREE)), lists: Vec::new() }
        };
        Self { slots: [slot(), slot(), slot()], next: 0 }
    }

    /// Copies the words of a frame with these lists, where one of the three is free.
    pub fn copy(&mut self, words: &wgpu::Buffer, lists: &[&'static str], encoder: &mut wgpu::CommandEncoder) {
        let slot = &mut self.slots[self.next];
        if [FREE, COPIED].contains(&slot.state.load(Ordering::Acquire)) {
            encoder.copy_buffer_to_buffer(words, 0, &slot.buffer, 0, slot.buffer.size());
            slot.lists = lists.to_vec();
            slot.state.store(COPIED, Ordering::Release);
        }
    }

    /// Asks for what was copied, once the commands were handed to the device.
    pub fn map(&mut self) {
        let slot = &mut self.slots[self.next];
        if slot.state.load(Ordering::Acquire) == COPIED {
            slot.state.store(ON_THE_WAY, Ordering::Release);
            let state = slot.state.clone();
            slot.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
                state.store(if result.is_ok() { THERE } else { LOST }, Ordering::Release);
            });
            self.next = (self.next + 1) % self.slots.len();
        }
    }

    /// Lists and words of the frames that have arrived, in their order.
    pub fn arrived(&mut self) -> Vec<(Vec<&'static str>, Vec<u32>)> {
        let mut found = Vec::new();
        for i in 0..self.slots.len() {
            let slot = &mut self.slots[(self.next + i) % 3];
            let state = slot.state.load(Ordering::Acquire);
            if state == THERE {
                if let Ok(data) = slot.buffer.get_mapped_range(..) {
                    found.push((std::mem::take(&mut slot.lists), bytemuck::pod_collect_to_vec(&data)));
                }
                slot.buffer.unmap();
            }
            if state == THERE || state == LOST {
                slot.state.store(FREE, Ordering::Release);
            }
        }
        found
    }
}
