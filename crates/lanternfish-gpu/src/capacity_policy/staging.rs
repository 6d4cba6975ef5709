//! Staging buffers for deferred readback.

use std::{
    collections::VecDeque,
    sync::{
        Arc,
        atomic::{AtomicU8, Ordering},
    },
};

use crate::{made, platform::ErrorScope};

const PENDING: u8 = 0;
const ARRIVED: u8 = 1;
const LOST: u8 = 2;

/// Number of buffers at the start: the usual number of frames in flight.
const INITIAL_BUFFERS: usize = 3;
/// Maximum number of frames in flight. The counts of further frames are not read.
pub(crate) const MOST_IN_FLIGHT: usize = 64;

/// The words of a frame in flight.
#[derive(Debug)]
struct Sent {
    frame: u64,
    buffer: wgpu::Buffer,
    state: Arc<AtomicU8>,
    lists: Vec<&'static str>,
}

/// The words of a frame that the device has finished.
#[derive(Debug)]
pub(super) struct Received {
    pub frame: u64,
    pub lists: Vec<&'static str>,
    /// `None` if mapping failed, most likely because the device is lost.
    pub words: Option<Vec<u32>>,
}

#[derive(Debug)]
pub(super) struct Staging {
    device: wgpu::Device,
    bytes: u64,
    free: Vec<wgpu::Buffer>,
    /// Words copied by commands that have not been submitted yet.
    copied: Option<Sent>,
    /// In order of submission, which is also the order of arrival.
    sent: VecDeque<Sent>,
}

impl Staging {
    pub fn new(device: &wgpu::Device, bytes: u64) -> Self {
        let free = (0..INITIAL_BUFFERS).map(|_| staging_buffer(device, bytes)).collect();
        Self { device: device.clone(), bytes, free, copied: None, sent: VecDeque::new() }
    }

    /// Copies the words of a frame with these lists. Discards those of an earlier frame that was not submitted.
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
        self.copied = Some(Sent { frame, buffer, state: Arc::new(AtomicU8::new(PENDING)), lists: lists.to_vec() });
    }

    /// Discards the copied words; their commands will not be submitted.
    pub fn give_up(&mut self) {
        self.free.extend(self.copied.take().map(|copied| copied.buffer));
    }

    /// Requests mapping of the copied words, after their commands were submitted.
    pub fn map(&mut self) {
        let Some(copied) = self.copied.take() else { return };
        let state = copied.state.clone();
        copied.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            state.store(if result.is_ok() { ARRIVED } else { LOST }, Ordering::Release);
        });
        self.sent.push_back(copied);
    }

    /// The oldest finished frame that was not returned yet.
    pub fn received(&mut self) -> Option<Received> {
        let state = self.sent.front()?.state.load(Ordering::Acquire);
        if state == PENDING {
            return None;
        }
        let Sent { frame, buffer, lists, .. } = self.sent.pop_front()?;
        if state == LOST {
            return Some(Received { frame, lists, words: None });
        }
        let words = buffer.get_mapped_range(..).ok().map(|data| bytemuck::pod_collect_to_vec(&data));
        // If the device was lost in between, this is an error, which is ignored: the loss shows elsewhere.
        let scope = ErrorScope::new(&self.device, wgpu::ErrorFilter::Validation);
        buffer.unmap();
        if scope.end().is_none() {
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
