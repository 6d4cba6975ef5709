//! Cells read each other: what they send of light that comes from other cells (`relax.wesl`).

use lanternfish_gpu::Frame;

use super::{Bounces, CacheOfFrame, RadianceCache, table::Change};
use crate::common::workgroups;

/// Bounces that each half of the cells takes, by turns, where every one is asked for: in a frame that all cells are new in, and in those after a change.
const TURNS_OF_NEW: u32 = 18;
const TURNS_OF_CHANGED: u32 = 12;
/// While the scene changes in every frame: what comes by more bounces is of the frames before, as most of a cell's samples are.
const TURNS_OF_CHANGING: u32 = 3;
/// Where all cells do not take more of them, those that get another sample take a bounce with it, and so many with the second to fourth one of a frame:
/// those cells are new, and so may be what they read.
const TURNS_OF_FEW: u32 = 6;

/// Bounces that each half of the cells takes in a frame; none where only cells that get another sample take one. `change`: of the scene, for the
/// frame's first view.
pub(super) fn turns_of_all(is_new: bool, change: Option<Change>) -> Option<u32> {
    match change {
        _ if is_new => Some(TURNS_OF_NEW),
        Some(Change::Alone | Change::Recent) => Some(TURNS_OF_CHANGED),
        Some(Change::Ongoing) => Some(TURNS_OF_CHANGING),
        Some(Change::Long) | None => None,
    }
}

impl CacheOfFrame {
    /// Whether cells take bounces with their samples: the first ones of the frame, or further ones, which only new cells get.
    pub(super) fn relaxes_due(&self, is_first: bool) -> bool {
        self.turns.is_none_or(|turns| turns == TURNS_OF_CHANGING && !is_first)
    }
}

impl RadianceCache {
    /// In the frame that all cells are new in, and in those after a change: brings what all cells send of light from other cells up to date, by way of
    /// the rays that they have sent.
    pub fn relax(&self, frame: &mut Frame<'_>, cache: &CacheOfFrame) {
        let Some(turns) = cache.turns else { return };
        for step in self.bounces.steps(turns) {
            let uniform = frame.uniform(&step.parameters(&cache.parameters));
            let bindings = cache.slots.bindings().part("radiance_cache", &uniform);
            frame.dispatch(&self.kernels.relax, &bindings, workgroups(self.slots));
        }
    }

    /// Where [`CacheOfFrame::relaxes_due`]: what those cells send that have got another sample, with the first round of samples or a further one. `due`:
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
