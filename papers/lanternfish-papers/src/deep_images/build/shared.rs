//! The data that the builders' shaders share with the host.

use lanternfish_gpu::gpu_struct;

gpu_struct! {
    /// A fragment of a layer.
    pub struct PeeledFragment {
        /// Index of its list in the chunk.
        list: u32,
        /// Depth along the image's axis from the scene's middle, m.
        depth: f32,
        /// Index of its triangle, in the order of the BVH's leaves.
        triangle: u32,
    }
}
