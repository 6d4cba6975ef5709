//! Counts of the objects created on devices, so that tests can check that a frame creates none.

use std::cell::Cell;

/// Numbers of device objects that this crate has created.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Made {
    /// Buffers.
    pub buffers: u64,
    /// Textures.
    pub textures: u64,
    /// Bind groups.
    pub bind_groups: u64,
    /// Compute and render pipelines.
    pub pipelines: u64,
}

thread_local! {
    static MADE: Cell<Made> = const { Cell::new(Made { buffers: 0, textures: 0, bind_groups: 0, pipelines: 0 }) };
}

/// Numbers of objects created by the calling thread so far. Other threads, such as parallel tests, are not counted.
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
