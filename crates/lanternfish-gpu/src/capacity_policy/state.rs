//! State that lasts from frame to frame: capacities, and notes of frames with deferred readback.

use std::collections::{HashMap, VecDeque};

use super::{
    Arrived, CAPACITY_POLICY_BYTES, FIRST_LIST, Growth, LIST_WORDS, Outcome,
    capacity::Capacity as History,
    staging::{MOST_IN_FLIGHT, Received, Staging},
};
use crate::{ComputeKernel, GpuError, buffer::STORAGE, made, primitives::SHADERS};

/// Capacity of all lists, kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct CapacityPolicy {
    pub(super) lists: HashMap<&'static str, History>,
    growth: Growth,
    /// There from the first frame on that does not wait.
    pub(super) later: Option<Deferred>,
}

/// What frames that do not wait need.
#[derive(Debug)]
pub(super) struct Deferred {
    pub note: ComputeKernel,
    pub count_frame: ComputeKernel,
    pub words: wgpu::Buffer,
    staging: Staging,
    /// The lists of the frame in hand.
    pub noted: Vec<&'static str>,
    arrived: Arrived,
    /// Of the frames that have arrived, the last [`MOST_IN_FLIGHT`] that nobody has asked for.
    outcomes: VecDeque<Outcome>,
}

impl CapacityPolicy {
    /// From now on.
    pub fn set_growth(&mut self, device: &wgpu::Device, growth: Growth) -> Result<(), GpuError> {
        if growth == Growth::Deferred && self.later.is_none() {
            self.later = Some(Deferred::new(device)?);
        }
        self.growth = growth;
        Ok(())
    }

    pub fn growth(&self) -> Growth {
        self.growth
    }

    /// What is needed of frames that do not wait, if they do not.
    fn later(&self) -> Option<&Deferred> {
        self.later.as_ref().filter(|_| self.growth == Growth::Deferred)
    }

    fn deferred_mut(&mut self) -> Option<&mut Deferred> {
        self.later.as_mut().filter(|_| self.growth == Growth::Deferred)
    }

    /// Every list, by name, and the elements that it has room for.
    pub fn capacities(&self) -> Vec<(&'static str, u64)> {
        let mut capacities: Vec<_> = self.lists.iter().map(|(name, capacity)| (*name, capacity.capacity())).collect();
        capacities.sort_unstable();
        capacities
    }

    pub fn whole(&self) -> Option<wgpu::Buffer> {
        self.later().map(|later| later.words.clone())
    }

    pub fn arrived(&self) -> Arrived {
        self.later.as_ref().map_or_else(Arrived::default, |later| later.arrived)
    }

    /// Reads what has arrived, without waiting.
    pub fn collect(&mut self, device: &wgpu::Device) {
        let Some(later) = &mut self.later else { return };
        // What is wrong with the device shows where the frame is handed to it.
        let _ = device.poll(wgpu::PollType::Poll);
        while let Some(received) = later.staging.received() {
            let outcome = outcome(&mut self.lists, received);
            later.arrived.frames += u64::from(!outcome.is_lost);
            later.arrived.held += u64::from(!outcome.is_lost && !outcome.is_complete);
            later.outcomes.push_back(outcome);
            if later.outcomes.len() > MOST_IN_FLIGHT {
                later.outcomes.pop_front();
            }
        }
    }

    /// What has become of the oldest frame that has arrived and was not asked for yet.
    pub fn outcome(&mut self) -> Option<Outcome> {
        self.later.as_mut()?.outcomes.pop_front()
    }

    /// What comes first in a frame.
    pub fn begin(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) {
        self.collect(device);
        let Some(later) = self.deferred_mut() else { return };
        later.noted.clear();
        // Three vertices, one instance: as long as nothing is noted, the image is drawn.
        queue.write_buffer(&later.words, 0, bytemuck::bytes_of(&[3u32, 1, 0, 0]));
    }

    /// What comes last in a frame's commands.
    pub fn end(&mut self, frame: u64, encoder: &mut wgpu::CommandEncoder) {
        if let Some(later) = self.deferred_mut() {
            later.staging.copy(frame, &later.words, &later.noted, encoder);
        }
    }

    /// The commands are on their way.
    pub fn submitted(&mut self) {
        if let Some(later) = &mut self.later {
            later.staging.map();
        }
    }

    /// The commands will never be handed to the device.
    pub fn discarded(&mut self) {
        if let Some(later) = &mut self.later {
            later.staging.give_up();
        }
    }
}

/// Notes what a frame has counted.
fn outcome(histories: &mut HashMap<&'static str, History>, received: Received) -> Outcome {
    let Received { frame, lists, words } = received;
    let Some(words) = words else { return Outcome { frame, is_lost: true, ..Outcome::default() } };
    let mut counted: Vec<(&'static str, u64)> = Vec::new();
    for (name, words) in lists.iter().zip(words[FIRST_LIST..].chunks_exact(LIST_WORDS)) {
        let words: [u32; LIST_WORDS] = words.try_into().expect("a chunk has as many");
        histories.get_mut(name).expect("it was requested").arrives(words);
        match counted.iter_mut().find(|(known, _)| known == name) {
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
