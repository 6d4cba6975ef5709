//! Buffers through which words reach the host without anybody waiting for them.

use std::{
    collections::VecDeque,
    sync::{
        Arc,
        atomic::{AtomicU8, Ordering},
    },
};

use crate::made;

const ON_THE_WAY: u8 = 0;
const THERE: u8 = 1;
const LOST: u8 = 2;

/// Buffers that are there from the start: as many as there are frames that a device usually has in hand.
const USUALLY: usize = 3;
/// Frames on their way at most: what further ones count is not read.
pub(crate) const MOST_IN_FLIGHT: usize = 64;

/// The words of a frame, copied or on their way.
#[derive(Debug)]
struct Sent {
    frame: u64,
    buffer: wgpu::Buffer,
    state: Arc<AtomicU8>,
    lists: Vec<&'static str>,
}

/// The words of a frame that the device is done with.
#[derive(Debug)]
pub(super) struct Received {
    pub frame: u64,
    pub lists: Vec<&'static str>,
    /// None: the device has lost them.
    pub words: Option<Vec<u32>>,
}

#[derive(Debug)]
pub(super) struct Staging {
    device: wgpu::Device,
    bytes: u64,
    free: Vec<wgpu::Buffer>,
    /// Those that are copied by commands that have not been handed to the device yet.
    copied: Option<Sent>,
    /// In the order in which they were sent, which is that in which they arrive.
    sent: VecDeque<Sent>,
}

impl Staging {
    pub fn new(device: &wgpu::Device, bytes: u64) -> Self {
        let free = (0..USUALLY).map(|_| staging_buffer(device, bytes)).collect();
        Self { device: device.clone(), bytes, free, copied: None, sent: VecDeque::new() }
    }

    /// Copies the words of a frame with these lists. Those of a frame before it whose commands were not handed to the device are given up.
    pub fn copy(
        &mut self,
        frame: u64,
        words: &wgpu::Buffer,
        lists: &[&'static str],
        encoder: &mut wgpu::CommandEncoder,
    ) {
        self.give_up();
        if self.sent.len() >= MOST_IN_FLIGHT {
            return;
        }
        let buffer = self.free.pop().unwrap_or_else(|| staging_buffer(&self.device, self.bytes));
        encoder.copy_buffer_to_buffer(words, 0, &buffer, 0, buffer.size());
        self.copied = Some(Sent { frame, buffer, state: Arc::new(AtomicU8::new(ON_THE_WAY)), lists: lists.to_vec() });
    }

    /// The commands that copy will not be handed to the device.
    pub fn give_up(&mut self) {
        self.free.extend(self.copied.take().map(|copied| copied.buffer));
    }

    /// Asks for what was copied, once the commands were handed to the device.
    pub fn map(&mut self) {
        let Some(copied) = self.copied.take() else { return };
        let state = copied.state.clone();
        copied.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            state.store(if result.is_ok() { THERE } else { LOST }, Ordering::Release);
        });
        self.sent.push_back(copied);
    }

    /// The oldest of the frames that the device is done with.
    pub fn received(&mut self) -> Option<Received> {
        let state = self.sent.front()?.state.load(Ordering::Acquire);
        if state == ON_THE_WAY {
            return None;
        }
        let Sent { frame, buffer, lists, .. } = self.sent.pop_front()?;
        if state == LOST {
            return Some(Received { frame, lists, words: None });
        }
        let words = buffer.get_mapped_range(..).ok().map(|data| bytemuck::pod_collect_to_vec(&data));
        // On a device that was lost in between that is an error, which says nothing new.
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        buffer.unmap();
        if pollster::block_on(scope.pop()).is_none() {
            self.free.push(buffer);
        }
        Some(Received { frame, lists, words })
    }
}

fn staging_buffer(device: &wgpu::Device, bytes: u64) -> wgpu::Buffer {
    made::count(|made| made.buffers += 1);
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("capacity_policy/staging"),
        size: bytes,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    })
}
