//! The data that the shaders of this folder share with the host.

use lanternfish_gpu::gpu_struct;

gpu_struct! {
    /// The fragments of a chunk to draw, and their size.
    pub struct PointRange {
        /// First list to draw, counted from the chunk's first.
        first_list: u32,
        /// Number of lists that are drawn, from the first one on.
        list_count: u32,
        /// Radius of a point, m.
        radius: f32,
        /// Minimum radius of a point, pixels.
        least_pixels: f32,
    }
}

gpu_struct! {
    /// The query for every texel.
    pub struct TexelQuery {
        /// Index of the image, counted from the chunk's first.
        image: u32,
        /// Index of the fragment in a list: 0 is the first, -1 the last.
        layer: i32,
    }
}

gpu_struct! {
    /// Mapping from numbers to colours.
    pub struct TexelScale {
        /// Number shown as white (grey) or black (heat).
        lowest: f32,
        /// Number shown as the darkest grey or as red.
        highest: f32,
        /// Texels across and down the image.
        resolution: u32,
        /// Pixels of a texel across and down.
        upscale: u32,
        /// 1: the image is rotated by 180°.
        turned: u32,
        /// 0: grey; 1: heat.
        colors: u32,
    }
}
