//! Order of the pixels of a block: `sample_order.wesl`.

use glam::UVec2;
use lanternfish_gpu::gpu_constants;

use crate::view::sobol_point;

/// Edge of a block, pixels: `NET_EDGE` of `sequence.wesl`.
pub(crate) const BLOCK: u32 = 32;

gpu_constants! {
    /// Workgroups across a block.
    const BLOCK_GROUPS: u32 = 4;
}

/// Words of the pixels of a block in order, and of the index in order of each pixel: two of either in a word.
const WORDS: usize = (BLOCK * BLOCK) as usize;

/// Workgroups for an image of this size, in complete blocks.
pub(crate) fn workgroups(size: UVec2) -> [u32; 3] {
    let blocks = BLOCK_GROUPS * size.map(|side| side.div_ceil(BLOCK));
    [blocks.x, blocks.y, 1]
}

/// The same by rows of blocks: the shader's `place_in_rows`.
pub(crate) fn workgroups_in_rows(size: UVec2) -> [u32; 3] {
    let blocks = size.map(|side| side.div_ceil(BLOCK));
    [BLOCK_GROUPS * BLOCK_GROUPS * blocks.x, blocks.y, 1]
}

/// Number of pixels of all blocks of an image of this size: the shader's `place_count`.
pub(crate) fn place_count(size: UVec2) -> u32 {
    size.map(|side| side.div_ceil(BLOCK)).element_product() * BLOCK * BLOCK
}

/// Contents of the uniform `sample_order`. The sequence shifts of two blocks differ by a constant, so that all blocks share one order.
pub(crate) fn words() -> [u32; WORDS] {
    let mut pixels: Vec<u32> = (0..BLOCK * BLOCK).collect();
    pixels.sort_by_key(|pixel| {
        // `shift_of` of `sequence.wesl`.
        let shift = sobol_point(morton_code(pixel % BLOCK, pixel / BLOCK));
        morton_code(shift.x >> 16, shift.y >> 16)
    });
    let mut indices = vec![0; pixels.len()];
    pixels.iter().zip(0..).for_each(|(pixel, index)| indices[*pixel as usize] = index);
    pixels.extend(indices);
    std::array::from_fn(|word| pixels[2 * word] | (pixels[2 * word + 1] << 16))
}

/// Interleaved bits of x and y, x first; each below 65,536.
fn morton_code(x: u32, y: u32) -> u32 {
    (0..16).map(|bit| (((x >> bit) & 1) << (2 * bit)) | (((y >> bit) & 1) << (2 * bit + 1))).sum()
}

#[cfg(test)]
#[test]
fn blocks_have_the_edge_of_a_net() {
    assert_eq!(crate::shaders::constant("common/sequence", "NET_EDGE"), f64::from(BLOCK));
}

#[cfg(test)]
#[test]
fn order_contains_every_pixel_of_a_block_once() {
    let halves = words().into_iter().flat_map(|word| [word & 0xffff, word >> 16]);
    let mut pixels: Vec<u32> = halves.take((BLOCK * BLOCK) as usize).collect();
    pixels.sort_unstable();
    assert!(pixels.into_iter().eq(0..BLOCK * BLOCK));
}
