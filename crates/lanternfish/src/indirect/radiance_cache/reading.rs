//! Propagation of radiance between entries (`propagate.wesl`).

use lanternfish_gpu::{Bindings, Frame};

use super::{Bounces, CacheOfFrame, FEWEST_IN_BUDGET, Kernels, RadianceCache, parameters::CacheSweep, table::Change};
use crate::{common::workgroups, error::RenderError};

/// Red-black propagation sweeps per half of the entries, with all bounces: in a frame in which all entries are new.
const SWEEPS_OF_NEW: u32 = 18;
/// Sweeps per half in the reset window after a change.
const SWEEPS_OF_CHANGED: u32 = 12;
/// Sweeps per half in each frame while the scene keeps changing. Light of later bounces is then from earlier frames, as
/// are most of an entry's samples.
const SWEEPS_OF_CHANGING: u32 = 2;
/// Sweeps over scheduled entries with each of up to three further samples of an update; the first sample has one.
/// Entries with further samples are new, and the entries that they read may be, too: if there is but one further
/// sample, it has as many sweeps as three.
const SWEEPS_OF_FEW: u32 = 6;

/// Entries that propagation updates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Readers {
    /// All entries; with all bounces in this many red-black sweeps.
    All(u32),
    /// All entries, and also new entries after each further sample.
    AllAndNew(u32),
    /// Scheduled entries, after their sample.
    Sampled,
}

impl Readers {
    /// The readers of a frame. `change`: of the scene, for the frame's first view.
    pub fn of(is_new: bool, change: Option<Change>) -> Self {
        match change {
            _ if is_new => Self::All(SWEEPS_OF_NEW),
            Some(Change::Alone | Change::Recent) => Self::All(SWEEPS_OF_CHANGED),
            Some(Change::Ongoing) => Self::AllAndNew(SWEEPS_OF_CHANGING),
            Some(Change::Long) | None => Self::Sampled,
        }
    }

    /// Sweeps over all entries; `None` if only scheduled entries read.
    fn sweeps_of_all(self) -> Option<u32> {
        match self {
            Self::All(sweeps) | Self::AllAndNew(sweeps) => Some(sweeps),
            Self::Sampled => None,
        }
    }

    /// True if entries read after their sample. `is_first`: it is the first of the update.
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
fn all_entries_read_after_changes_and_sampled_ones_otherwise() {
    let table = [
        (true, None, 18, [false, false]),
        (true, Some(Change::Ongoing), 18, [false, false]),
        (false, Some(Change::Alone), 12, [false, false]),
        (false, Some(Change::Recent), 12, [false, false]),
        (false, Some(Change::Ongoing), 2, [false, true]),
        (false, Some(Change::Long), 0, [true, true]),
        // Later views of a frame.
        (false, None, 0, [true, true]),
    ];
    for (is_new, change, sweeps_of_all, of_samples) in table {
        let readers = Readers::of(is_new, change);
        assert_eq!(readers.sweeps_of_all().unwrap_or(0), sweeps_of_all, "{is_new}, {change:?}");
        assert_eq!([true, false].map(|is_first| readers.include_sampled(is_first)), of_samples, "{is_new}, {change:?}");
    }
}

impl CacheOfFrame {
    /// After a propagation: further rays of the frame add few entries, which alone read then.
    pub fn has_propagated(&mut self) {
        if !self.is_new {
            self.readers = Readers::Sampled;
        }
    }
}

impl RadianceCache {
    /// Propagates radiance along the hit lists of all entries, if the [`Readers`] of the frame are all entries.
    pub fn propagate(&self, frame: &mut Frame<'_>, cache: &CacheOfFrame) -> Result<(), RenderError> {
        let Some(sweeps) = cache.readers.sweeps_of_all() else { return Ok(()) };
        // Sweeps that follow pairs in which nothing changed are left out, but in an image's first frame.
        let may_end = self.bounces == Bounces::All && !cache.is_new;
        let mut zeroed = || frame.zeroed("radiance_cache/next_sweeps", 12 * (1 + u64::from(sweeps)));
        let next_sweeps = [zeroed()?, zeroed()?];
        for (index, sweep) in (0..).zip(self.bounces.steps(sweeps)) {
            let pair = index / 2;
            let next = if may_end { 3 * (pair + 1) } else { 0 };
            let uniform = frame.uniform(&CacheSweep { next, ..sweep });
            let [of_pair, of_next] = [pair, pair + 1].map(|pair| &next_sweeps[pair as usize % 2]);
            let bindings = cache.frame_bindings().part("cache_sweep", &uniform).buffer("next_sweeps", of_next);
            if may_end && pair > 0 {
                frame.dispatch_indirect(&self.kernels.propagate, &bindings, of_pair, 12 * u64::from(pair));
            } else {
                frame.dispatch(&self.kernels.propagate, &bindings, workgroups(self.slots));
            }
        }
        if self.bounces == Bounces::All {
            self.kernels.pack(frame, self.bounces, self.slots, cache.frame_bindings());
        }
        Ok(())
    }

    /// Propagates radiance to the entries that have got another sample, and packs it. `is_first`: it was the first sample of the update; `scheduled`:
    /// the list of these entries.
    pub(super) fn propagate_scheduled(
        &self,
        frame: &mut Frame<'_>,
        cache: &CacheOfFrame,
        is_first: bool,
        scheduled: &wgpu::Buffer,
    ) {
        let sweeps = match cache.parameters.fewest {
            _ if is_first => 1,
            FEWEST_IN_BUDGET => 3 * SWEEPS_OF_FEW,
            _ => SWEEPS_OF_FEW,
        };
        let sweeps = self.bounces.steps_of_some(sweeps);
        let copy = self.bounces.copy_after(&sweeps);
        let sweeps = sweeps.iter().map(|sweep| (&self.kernels.propagate_scheduled, sweep));
        for (kernel, sweep) in sweeps.chain([(&self.kernels.pack_scheduled, &copy)]) {
            let uniform = frame.uniform(sweep);
            let bindings = cache.frame_bindings().part("cache_sweep", &uniform).buffer("scheduled", scheduled);
            frame.dispatch_indirect(kernel, &bindings, scheduled, 0);
        }
    }
}

impl Kernels {
    /// Packs the radiance of all entries; with all bounces, both of their totals are equal afterwards. `bindings`: the table, and the parameters of the
    /// frame.
    pub(super) fn pack(&self, frame: &mut Frame<'_>, bounces: Bounces, slots: u32, bindings: Bindings<'_>) {
        let uniform = frame.uniform(&bounces.copy_after(&[]));
        frame.dispatch(&self.pack, &bindings.part("cache_sweep", &uniform), workgroups(slots));
    }
}
