//! Counts of what is made on devices, so that a test can say that a frame makes nothing.

use std::cell::Cell;

/// Number of things this crate has made for a thread so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Made {
    /// Buffers.
    pub buffers: u64,
    /// Textures.
    pub textures: u64,
    /// Bind groups.
    pub bind_groups: u64,
    /// Pipelines, of compute and of drawing.
    pub pipelines: u64,
}

thread_local! {
    static MADE: Cell<Made> = const { Cell::new(Made { buffers: 0, textures: 0, bind_groups: 0, pipelines: 0 }) };
}

/// What the calling thread has made so far; tests that run at the same time in other threads are not counted.
pub fn made() -> Made {
    MADE.get()
}

pub(crate) fn count(add: impl FnOnce(&mut Made)) {
    let mut made = MADE.get();
    add(&mut made);
    MADE.set(made);
}

impl std::ops::Sub for Made {
    type Output = Self;

    fn sub(self, before: Self) -> Self {
        Self {
            buffers: self.buffers - before.buffers,
            textures: self.textures - before.textures,
            bind_groups: self.bind_groups - before.bind_groups,
            pipelines: self.pipelines - before.pipelines,
        }
    }
}
