//! Command buffers of a frame, submitted a few at a time.

use std::{
    collections::VecDeque,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

/// The command buffers of a frame that were not submitted, and the state of the last submission.
#[derive(Debug, Default)]
pub struct Slices {
    left: VecDeque<wgpu::CommandBuffer>,
    /// Becomes true when the device has ended the last submission and was polled.
    is_done: Option<Arc<AtomicBool>>,
}

impl Slices {
    /// The command buffers of a frame, in order.
    pub fn new(all: Vec<wgpu::CommandBuffer>) -> Self {
        Self { left: all.into(), is_done: None }
    }

    /// Number of command buffers that were not submitted.
    pub fn left(&self) -> usize {
        self.left.len()
    }

    /// True if the device has ended the last submission. The device must be polled.
    pub fn is_idle(&self) -> bool {
        self.is_done.as_ref().is_none_or(|is_done| is_done.load(Ordering::Relaxed))
    }

    /// Submits the next `count` command buffers. Returns true if none is left.
    pub fn submit(&mut self, queue: &wgpu::Queue, count: usize) -> bool {
        queue.submit(self.left.drain(..count.min(self.left.len())));
        let is_done = Arc::new(AtomicBool::new(false));
        self.is_done = Some(Arc::clone(&is_done));
        queue.on_submitted_work_done(move || is_done.store(true, Ordering::Relaxed));
        self.left.is_empty()
    }
}
