//! Timing of passes.

use std::collections::VecDeque;

use wgpu_profiler::{GpuProfiler, GpuProfilerSettings, GpuTimerQueryResult};

use crate::capacity_policy::MOST_IN_FLIGHT;

/// Device time of a pass.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// The pass's label, a path.
    pub name: String,
    /// Milliseconds on the device.
    pub ms: f64,
}

/// The commands of all passes of one label in a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PassCommands {
    /// The label, a path.
    pub name: String,
    /// Number of dispatches; 0 for render passes.
    pub dispatches: u32,
    /// Number of those dispatches whose number of workgroups the device reads from a buffer.
    pub indirect: u32,
}

/// A pass of a frame that is about to run.
#[derive(Clone, Copy, Debug)]
pub struct PassProgress<'a> {
    /// The pass's label, a path.
    pub label: &'a str,
    /// Its index in the frame, or in a part of the frame that ends where the host reads a result.
    pub index: usize,
    /// Number of passes of the frame, or of this part.
    pub count: usize,
}

/// Called before each pass of a frame runs.
pub type PassWatcher = Box<dyn FnMut(PassProgress<'_>) + Send + Sync>;

/// Times passes if the device has timestamp queries, and does nothing otherwise.
pub struct Profiler {
    pub(super) inner: GpuProfiler,
    period: f32,
    /// True if dispatches may share a pass: each can be timed alone, or nothing is timed at all.
    pub(super) is_shared_pass: bool,
    pub(super) compute_passes: u64,
    pub(super) watcher: Option<PassWatcher>,
    /// Frames whose times have not arrived yet.
    pending: VecDeque<u64>,
    /// Commands of the frame that is being recorded, in the order of each label's first pass.
    pub(super) recorded: Vec<PassCommands>,
    /// Commands of submitted frames that nobody has asked for.
    commands: VecDeque<(u64, Vec<PassCommands>)>,
}

impl std::fmt::Debug for Profiler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Profiler").field("period", &self.period).finish_non_exhaustive()
    }
}

impl Profiler {
    /// A profiler for frames of this device.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        let settings = GpuProfilerSettings {
            enable_debug_groups: false,
            max_num_pending_frames: MOST_IN_FLIGHT,
            ..Default::default()
        };
        let inner = GpuProfiler::new(device, settings).expect("the settings are valid");
        let has = |feature| device.features().contains(feature);
        let is_shared_pass =
            has(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES) || !has(wgpu::Features::TIMESTAMP_QUERY);
        Self {
            inner,
            period: queue.get_timestamp_period(),
            is_shared_pass,
            compute_passes: 0,
            watcher: None,
            pending: VecDeque::new(),
            recorded: Vec::new(),
            commands: VecDeque::new(),
        }
    }

    /// Discards all frames whose times have not arrived yet.
    pub(super) fn renew(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) {
        let watcher = self.watcher.take();
        *self = Self { compute_passes: self.compute_passes, watcher, ..Self::new(device, queue) };
    }

    /// Calls `watcher` before each pass of the frames that submit their own commands. The host then waits for every pass, which costs time on a
    /// graphics card.
    pub fn watch(&mut self, watcher: Option<PassWatcher>) {
        self.watcher = watcher;
    }

    /// Number of compute passes in all frames so far. Consecutive dispatches share a pass unless that prevents timing them.
    pub fn compute_passes(&self) -> u64 {
        self.compute_passes
    }

    /// Times of the oldest finished frame, in the order of its passes; empty when none is finished or nothing is timed.
    pub fn finished(&mut self) -> Vec<PassTime> {
        self.next().map(|(_, times)| times).unwrap_or_default()
    }

    /// Times of the frame of this number, in the order of its passes; empty if it is not finished or nothing is timed. Drops the times of
    /// earlier frames.
    pub fn times_of(&mut self, frame: u64) -> Vec<PassTime> {
        while self.pending.front().is_some_and(|number| *number <= frame) {
            match self.next() {
                Some((number, times)) if number == frame => return times,
                Some(_) => (),
                None => break,
            }
        }
        Vec::new()
    }

    /// Commands of the submitted frame of this number, by label, whether or not the device can time them. Drops those of earlier frames.
    pub fn commands_of(&mut self, frame: u64) -> Vec<PassCommands> {
        while self.commands.front().is_some_and(|(number, _)| *number < frame) {
            self.commands.pop_front();
        }
        self.commands.pop_front_if(|(number, _)| *number == frame).map(|(_, commands)| commands).unwrap_or_default()
    }

    /// Counts a pass: a render pass if it is no dispatch.
    pub(super) fn count(&mut self, label: &str, is_dispatch: bool, is_indirect: bool) {
        let index = self.recorded.iter().position(|pass| pass.name == label).unwrap_or_else(|| {
            self.recorded.push(PassCommands { name: label.to_owned(), dispatches: 0, indirect: 0 });
            self.recorded.len() - 1
        });
        self.recorded[index].dispatches += u32::from(is_dispatch);
        self.recorded[index].indirect += u32::from(is_indirect);
    }

    /// Notes that a frame was submitted.
    pub(super) fn submitted(&mut self, frame: u64) {
        if self.commands.len() == MOST_IN_FLIGHT {
            self.commands.pop_front();
        }
        self.commands.push_back((frame, std::mem::take(&mut self.recorded)));
        if self.pending.len() == MOST_IN_FLIGHT {
            // `end_frame` then drops the most recent pending frame.
            self.pending.pop_back();
        }
        // Fails only if a query is open; `dispatch` and `render` close theirs.
        self.inner.end_frame().expect("every query is closed");
        self.pending.push_back(frame);
    }

    fn next(&mut self) -> Option<(u64, Vec<PassTime>)> {
        let results: Vec<GpuTimerQueryResult> = self.inner.process_finished_frame(self.period)?;
        let frame = self.pending.pop_front()?;
        let ms = |r: &GpuTimerQueryResult| r.time.as_ref().map(|t| 1e3 * (t.end - t.start));
        let times = results.iter().filter_map(|r| Some(PassTime { name: r.label.clone(), ms: ms(r)? })).collect();
        Some((frame, times))
    }
}
