//! State across frames: capacities, and outcomes of frames with deferred readback.

use std::collections::{HashMap, VecDeque};

use super::{
    Arrived, CAPACITY_POLICY_BYTES, FIRST_LIST, Growth, LIST_WORDS, Outcome,
    capacity::Capacity as History,
    staging::{MOST_IN_FLIGHT, Received, Staging},
};
use crate::{ComputeKernel, GpuError, buffer::STORAGE, made, primitives::SHADERS};

/// Capacities of all lists.
#[derive(Debug, Default)]
pub(crate) struct CapacityPolicy {
    pub(super) lists: HashMap<&'static str, History>,
    growth: Growth,
    /// Present once deferred readback was selected.
    pub(super) deferred: Option<Deferred>,
}

/// Resources of frames with deferred readback.
#[derive(Debug)]
pub(super) struct Deferred {
    pub note: ComputeKernel,
    pub count_frame: ComputeKernel,
    pub words: wgpu::Buffer,
    staging: Staging,
    /// Names of the lists noted by the current frame.
    pub noted: Vec<&'static str>,
    arrived: Arrived,
    /// Outcomes of the last [`MOST_IN_FLIGHT`] frames that have arrived and were not read by the caller.
    outcomes: VecDeque<Outcome>,
}

impl CapacityPolicy {
    /// Sets when lists grow from now on.
    pub fn set_growth(&mut self, device: &wgpu::Device, growth: Growth) -> Result<(), GpuError> {
        if growth == Growth::Deferred && self.deferred.is_none() {
            self.deferred = Some(Deferred::new(device)?);
        }
        self.growth = growth;
        Ok(())
    }

    pub fn growth(&self) -> Growth {
        self.growth
    }

    /// The resources for deferred readback, if it is selected.
    fn deferred(&self) -> Option<&Deferred> {
        self.deferred.as_ref().filter(|_| self.growth == Growth::Deferred)
    }

    fn deferred_mut(&mut self) -> Option<&mut Deferred> {
        self.deferred.as_mut().filter(|_| self.growth == Growth::Deferred)
    }

    /// The capacity of every list, elements, by name.
    pub fn capacities(&self) -> Vec<(&'static str, u64)> {
        let mut capacities: Vec<_> = self.lists.iter().map(|(name, capacity)| (*name, capacity.capacity())).collect();
        capacities.sort_unstable();
        capacities
    }

    pub fn completeness_buffer(&self) -> Option<wgpu::Buffer> {
        self.deferred().map(|deferred| deferred.words.clone())
    }

    pub fn arrived(&self) -> Arrived {
        self.deferred.as_ref().map_or_else(Arrived::default, |deferred| deferred.arrived)
    }

    /// Collects the frames that have arrived, without waiting.
    pub fn collect(&mut self, device: &wgpu::Device) {
        let Some(deferred) = &mut self.deferred else { return };
        // Errors of the device show at the next submission.
        let _ = device.poll(wgpu::PollType::Poll);
        while let Some(received) = deferred.staging.received() {
            let outcome = outcome(&mut self.lists, received);
            deferred.arrived.frames += u64::from(!outcome.is_lost);
            deferred.arrived.held += u64::from(!outcome.is_lost && !outcome.is_complete);
            deferred.outcomes.push_back(outcome);
            if deferred.outcomes.len() > MOST_IN_FLIGHT {
                deferred.outcomes.pop_front();
            }
        }
    }

    /// Takes the outcome of the oldest frame that has arrived.
    pub fn outcome(&mut self) -> Option<Outcome> {
        self.deferred.as_mut()?.outcomes.pop_front()
    }

    /// Begins a frame.
    pub fn begin(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) {
        self.collect(device);
        let Some(deferred) = self.deferred_mut() else { return };
        deferred.noted.clear();
        // Three vertices, one instance: the image is drawn unless a list overflows.
        queue.write_buffer(&deferred.words, 0, bytemuck::bytes_of(&[3u32, 1, 0, 0]));
    }

    /// Ends a frame: copies its words for the readback.
    pub fn end(&mut self, frame: u64, encoder: &mut wgpu::CommandEncoder) {
        if let Some(deferred) = self.deferred_mut() {
            deferred.staging.copy(frame, &deferred.words, &deferred.noted, encoder);
        }
    }

    /// Notes that the frame was submitted.
    pub fn submitted(&mut self) {
        if let Some(deferred) = &mut self.deferred {
            deferred.staging.map();
        }
    }

    /// Notes that the frame will never be submitted.
    pub fn discarded(&mut self) {
        if let Some(deferred) = &mut self.deferred {
            deferred.staging.give_up();
        }
    }
}

/// Adapts capacities to the counts of a frame, and returns its outcome.
fn outcome(histories: &mut HashMap<&'static str, History>, received: Received) -> Outcome {
    let Received { frame, lists, words } = received;
    let Some(words) = words else { return Outcome { frame, is_lost: true, ..Outcome::default() } };
    let mut counted: Vec<(&'static str, u64)> = Vec::new();
    for (name, words) in lists.iter().zip(words[FIRST_LIST..].chunks_exact(LIST_WORDS)) {
        let words: [u32; LIST_WORDS] = words.try_into().expect("a chunk has as many");
        histories.get_mut(name).expect("it was requested").arrives(words);
        match counted.iter_mut().find(|(other, _)| other == name) {
            Some((_, elements)) => *elements += u64::from(words[0]),
            None => counted.push((*name, words[0].into())),
        }
    }
    let resized = histories.iter_mut().filter_map(|(name, history)| history.adapt().then_some(*name)).collect();
    Outcome { frame, is_complete: words[1] == 1, is_lost: false, lists: counted, resized }
}

impl Deferred {
    fn new(device: &wgpu::Device) -> Result<Self, GpuError> {
        let shader = SHADERS.link("capacity_policy/note", &[])?;
        made::count(|made| made.buffers += 1);
        let words = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("capacity_policy"),
            size: CAPACITY_POLICY_BYTES,
            usage: STORAGE | wgpu::BufferUsages::INDIRECT,
            mapped_at_creation: false,
        });
        Ok(Self {
            note: ComputeKernel::new(device, &shader, "note", "capacity_policy/note"),
            count_frame: ComputeKernel::new(device, &shader, "count_frame", "capacity_policy/count_frame"),
            words,
            staging: Staging::new(device, CAPACITY_POLICY_BYTES),
            noted: Vec::new(),
            arrived: Arrived::default(),
            outcomes: VecDeque::new(),
        })
    }
}
