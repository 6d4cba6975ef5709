//! Cells read each other: what they send of light that comes from other cells (`relax.wesl`).

use lanternfish_gpu::Frame;

use super::{Bounces, CacheOfFrame, RadianceCache, table::Change};
use crate::common::workgroups;

/// Bounces that each half of the cells takes, by turns, where every one is asked for: in a frame that all cells are new in, and in those after a change.
const TURNS_OF_NEW: u32 = 18;
const TURNS_OF_CHANGED: u32 = 12;
/// While the scene changes in every frame: what comes by more bounces is of the frames before, as most of a cell's samples are.
const TURNS_OF_CHANGING: u32 = 2;
/// Where all cells do not take more of them, those that get another sample take a bounce with it, and so many with the second to fourth one of a frame:
/// those cells are new, and so may be what they read.
const TURNS_OF_FEW: u32 = 6;

/// Which cells take bounces in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    /// Bounces that each half of all cells takes, where every one is asked for. None: only cells that get another sample take any.
    turns_of_all: Option<u32>,
    /// Whether cells take bounces with their samples: with the first ones of the frame, and with further ones, which only new cells get.
    with_first_samples: bool,
    with_further_samples: bool,
}

impl Reading {
    /// `change`: of the scene, for the frame's first view.
    pub fn of(is_new: bool, change: Option<Change>) -> Self {
        let of_all = |turns, with_further_samples| Self {
            turns_of_all: Some(turns),
            with_first_samples: false,
            with_further_samples,
        };
        match change {
            _ if is_new => of_all(TURNS_OF_NEW, false),
            Some(Change::Alone | Change::Recent) => of_all(TURNS_OF_CHANGED, false),
            Some(Change::Ongoing) => of_all(TURNS_OF_CHANGING, true),
            Some(Change::Long) | None => {
                Self { turns_of_all: None, with_first_samples: true, with_further_samples: true }
            }
        }
    }

    /// `is_first`: of the rounds of samples in the frame.
    pub fn is_with_samples(&self, is_first: bool) -> bool {
        if is_first { self.with_first_samples } else { self.with_further_samples }
    }
}

impl RadianceCache {
    /// In the frame that all cells are new in, and in those after a change: brings what all cells send of light from other cells up to date, by way of
    /// the rays that they have sent.
    pub fn relax(&self, frame: &mut Frame<'_>, cache: &CacheOfFrame) {
        let Some(turns) = cache.reading.turns_of_all else { return };
        for step in self.bounces.steps(turns) {
            let uniform = frame.uniform(&step.parameters(&cache.parameters));
            let bindings = cache.slots.bindings().part("radiance_cache", &uniform);
            frame.dispatch(&self.kernels.relax, &bindings, workgroups(self.slots));
        }
    }

    /// Where [`Reading::is_with_samples`]: what those cells send that have got another sample, with the first round of samples or a further one. `due`:
    /// which they are, and workgroups for all of them.
    pub(super) fn relax_due(
        &self,
        frame: &mut Frame<'_>,
        cache: &CacheOfFrame,
        is_first: bool,
        [due, workgroups_due]: [&wgpu::Buffer; 2],
    ) {
        for step in self.bounces.steps_of_some(if is_first { 1 } else { TURNS_OF_FEW }) {
            let uniform = frame.uniform(&step.parameters(&cache.parameters));
            let bindings = cache.slots.bindings().part("radiance_cache", &uniform).buffer("due", due);
            frame.dispatch_indirect(&self.kernels.relax_due, &bindings, workgroups_due);
            if self.bounces == Bounces::All {
                frame.dispatch_indirect(&self.kernels.put_back, &bindings, workgroups_due);
            }
        }
    }
}
