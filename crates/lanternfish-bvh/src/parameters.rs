//! What the host and the shaders share.

use lanternfish_gpu::{gpu_constants, gpu_struct};

gpu_constants! {
    /// Invocations of a workgroup.
    pub(crate) const WORKGROUP: u32 = 256;
    /// Most levels of a tree: the capacity of the renderer's traversal stack.
    pub(crate) const MAX_LEVELS: u32 = 32;
}

/// Most iterations of clustering, and so the greatest height of the binary tree. Three levels of it fit in one level of wide nodes, so it
/// must not exceed 3 × [`MAX_LEVELS`].
pub(crate) const MAX_ITERATIONS: u32 = 96;

gpu_struct! {
    /// Parameters of a pass.
    pub(crate) struct BvhStep {
        /// Number of primitives.
        count: u32,
        /// Iteration of clustering, or level.
        index: u32,
        /// Number of iterations.
        end: u32,
        _pad: u32,
    }
}
