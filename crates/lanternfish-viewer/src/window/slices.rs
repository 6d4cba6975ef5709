//! Slices of slow frames, and paints between them.

use super::Viewer;
use crate::{slice_scheduler::Turn, viewport::Viewport};

impl Viewer {
    /// True if commands of a frame in flight were not submitted yet.
    pub(super) fn has_slices(&self) -> bool {
        self.left() > 0
    }

    /// Number of command buffers of both sides that were not submitted.
    fn left(&self) -> usize {
        self.viewport.left() + self.comparison.viewport().map_or(0, Viewport::left)
    }

    /// Submits the next slice of a frame if it is due. Returns whether to repaint the window first.
    pub(super) fn proceed(&mut self, wants_paint: bool) -> bool {
        let now = 1e3 * self.opened.elapsed().as_secs_f64();
        let left = self.left();
        let is_idle = self.viewport.is_idle() && self.comparison.viewport().is_none_or(Viewport::is_idle);
        match self.slice_scheduler.turn(now, is_idle, wants_paint, left) {
            Turn::Paint => true,
            Turn::Wait => false,
            Turn::Submit(count) => {
                // B was recorded before A.
                match self.comparison.viewport_mut().filter(|viewport| viewport.left() > 0) {
                    Some(viewport) => viewport.submit(count),
                    None => self.viewport.submit(count),
                }
                self.slice_scheduler.submitted(now, left - self.left());
                false
            }
        }
    }
}
