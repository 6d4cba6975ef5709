//! Work of a change on the device.

/// Work of a change of the scene on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sent {
    /// Bytes that the host uploaded.
    pub bytes: u64,
    /// Number of dispatches.
    pub dispatches: u32,
    /// True if a tree built in the background replaced the one that rays were traced through.
    pub has_rebuilt: bool,
}
