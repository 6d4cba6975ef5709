//! Entries read each other: what they send of light that comes from other entries (`propagate.wesl`).

use lanternfish_gpu::Frame;

use super::{Bounces, CacheOfFrame, RadianceCache, table::Change};
use crate::common::workgroups;

/// Bounces that each half of the entries takes, by turns, where every one is requested: in a frame that all entries are new in, and in those after a change.
const SWEEPS_OF_NEW: u32 = 18;
const SWEEPS_OF_CHANGED: u32 = 12;
/// While the scene changes again and again: what comes by more bounces is of the frames before, as most of an entry's samples are.
const SWEEPS_OF_CHANGING: u32 = 2;
/// Entries that take bounces with their samples take one with the first sample of an update, and so many with each of up to three more: entries that get
/// those are new, and so may be what they read.
const SWEEPS_OF_FEW: u32 = 6;

/// Which entries read what others send in an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Readers {
    /// All entries, each half of them so often where every bounce is requested.
    All(u32),
    /// All of them, and new entries with each further sample, too.
    AllAndNew(u32),
    /// Entries that get a sample, with it.
    Sampled,
}

impl Readers {
    /// `change`: of the scene, for the frame's first view.
    pub fn of(is_new: bool, change: Option<Change>) -> Self {
        match change {
            _ if is_new => Self::All(SWEEPS_OF_NEW),
            Some(Change::Alone | Change::Recent) => Self::All(SWEEPS_OF_CHANGED),
            Some(Change::Ongoing) => Self::AllAndNew(SWEEPS_OF_CHANGING),
            Some(Change::Long) | None => Self::Sampled,
        }
    }

    /// How often each half of all entries reads; none where not all do.
    fn sweeps_of_all(self) -> Option<u32> {
        match self {
            Self::All(sweeps) | Self::AllAndNew(sweeps) => Some(sweeps),
            Self::Sampled => None,
        }
    }

    /// Whether entries read when they have got a sample: `is_first` of the update.
    pub fn include_sampled(self, is_first: bool) -> bool {
        match self {
            Self::All(_) => false,
            Self::AllAndNew(_) => !is_first,
            Self::Sampled => true,
        }
    }
}

#[cfg(test)]
#[test]
fn all_cells_read_after_changes_and_sampled_ones_else() {
    let table = [
        (true, None, 18, [false, false]),
        (true, Some(Change::Ongoing), 18, [false, false]),
        (false, Some(Change::Alone), 12, [false, false]),
        (false, Some(Change::Recent), 12, [false, false]),
        (false, Some(Change::Ongoing), 2, [false, true]),
        (false, Some(Change::Long), 0, [true, true]),
        // A frame's later views.
        (false, None, 0, [true, true]),
    ];
    for (is_new, change, sweeps_of_all, of_samples) in table {
        let readers = Readers::of(is_new, change);
        assert_eq!(readers.sweeps_of_all().unwrap_or(0), sweeps_of_all, "{is_new}, {change:?}");
        assert_eq!([true, false].map(|is_first| readers.include_sampled(is_first)), of_samples, "{is_new}, {change:?}");
    }
}

impl RadianceCache {
    /// Where all entries are [`Readers`]: brings what they send of light from other entries up to date, by way of the rays that they have sent.
    pub fn propagate(&self, frame: &mut Frame<'_>, cache: &CacheOfFrame) {
        let Some(sweeps) = cache.readers.sweeps_of_all() else { return };
        for sweep in self.bounces.steps(sweeps) {
            let uniform = frame.uniform(&sweep);
            let bindings = cache.told().part("cache_sweep", &uniform);
            frame.dispatch(&self.kernels.propagate, &bindings, workgroups(self.slots));
        }
    }

    /// Where [`Readers::include_sampled`]: what those entries send that have got another sample, with the first round of samples or a further one. `scheduled`:
    /// which they are, and workgroups for all of them.
    pub(super) fn propagate_scheduled(
        &self,
        frame: &mut Frame<'_>,
        cache: &CacheOfFrame,
        is_first: bool,
        scheduled: &wgpu::Buffer,
        workgroups_scheduled: &wgpu::Buffer,
    ) {
        for sweep in self.bounces.steps_of_some(if is_first { 1 } else { SWEEPS_OF_FEW }) {
            let uniform = frame.uniform(&sweep);
            let bindings = cache.told().part("cache_sweep", &uniform).buffer("scheduled", scheduled);
            frame.dispatch_indirect(&self.kernels.propagate_scheduled, &bindings, workgroups_scheduled);
            if self.bounces == Bounces::All {
                frame.dispatch_indirect(&self.kernels.copy_back, &bindings, workgroups_scheduled);
            }
        }
    }
}
