//! The frame in flight: its command buffers, submitted a few at a time, and its end.

use std::{
    collections::VecDeque,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use super::Viewport;

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

    /// Submits the next `count` command buffers. Returns the submission if none is left.
    pub fn submit(&mut self, queue: &wgpu::Queue, count: usize) -> Option<wgpu::SubmissionIndex> {
        let submission = queue.submit(self.left.drain(..count.min(self.left.len())));
        let is_done = Arc::new(AtomicBool::new(false));
        self.is_done = Some(Arc::clone(&is_done));
        queue.on_submitted_work_done(move || is_done.store(true, Ordering::Relaxed));
        self.left.is_empty().then_some(submission)
    }
}

impl Viewport {
    /// Number of command buffers of the frame in flight that were not submitted.
    pub fn left(&self) -> usize {
        self.slices.left()
    }

    /// True if the device has ended all that was submitted of the frame in flight, as far as [`Self::poll`] knows.
    pub fn is_idle(&self) -> bool {
        self.slices.is_idle()
    }

    /// Submits the next `count` command buffers of the frame in flight.
    pub fn submit(&mut self, count: usize) {
        if self.in_flight.is_none() {
            return;
        }
        if let Some(submission) = self.slices.submit(&self.gpu.queue, count) {
            self.pending.take().map(|frame| self.renderer.submitted(frame));
            self.shown.submitted(submission);
        }
    }

    /// Polls submitted frames. Returns the time from recording to completion of a frame that has ended, ms.
    pub fn poll(&mut self) -> Option<f64> {
        if self.slices.left() > 0 {
            // Errors are reported by the frame.
            let _ = self.gpu.device.poll(wgpu::PollType::Poll);
        }
        let mut took = None;
        while let Some(report) = self.renderer.poll() {
            if let Some((_, since)) = self.in_flight.take_if(|(frame, _)| *frame == report.frame) {
                took = Some(1e3 * since.elapsed().as_secs_f64());
                self.last_ms = took;
                if report.is_complete {
                    self.shown.complete(&self.gpu, &self.renderings);
                }
            }
            if !report.is_complete {
                // An incomplete frame is not shown, so accumulation restarts.
                self.averaged = (0, None);
            }
            self.report = Some(report);
        }
        took
    }

    /// Submits all that is left of the frame in flight, because its scene or renderer changes.
    pub(super) fn flush(&mut self) {
        if self.slices.left() > 0 {
            self.submit(usize::MAX);
        }
    }
}
