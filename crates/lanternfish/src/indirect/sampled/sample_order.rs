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
        let shift = sobol_point(shuffled(morton_code(pixel % BLOCK, pixel / BLOCK)));
        morton_code(shift.x >> 16, shift.y >> 16)
    });
    let mut indices = vec![0; pixels.len()];
    pixels.iter().zip(0..).for_each(|(pixel, index)| indices[*pixel as usize] = index);
    pixels.extend(indices);
    std::array::from_fn(|word| pixels[2 * word] | (pixels[2 * word + 1] << 16))
}

/// `shuffled` of `sequence.wesl`.
pub(crate) fn shuffled(code: u32) -> u32 {
    let digit = |digit: u32| {
        let square = ((code >> (digit + 2)) << 4) + digit + 1;
        let mixed = (square ^ (square >> 7)).wrapping_mul(2_654_435_769);
        (((code >> digit) ^ ((mixed ^ (mixed >> 15)).wrapping_mul(2_246_822_519) >> 30)) & 3) << digit
    };
    (code & 15) + (4..10).step_by(2).map(digit).sum::<u32>()
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

/// Shifts of the pixels of a square with this corner and edge, as the shader has them without the offset of a block.
#[cfg(test)]
fn shifts(corner: [u32; 2], edge: u32) -> Vec<UVec2> {
    let pixels = (0..edge * edge).map(|i| [corner[0] + i % edge, corner[1] + i / edge]);
    pixels.map(|[x, y]| sobol_point(shuffled(morton_code(x, y)))).collect()
}

#[cfg(test)]
#[test]
fn squares_are_nets_whose_orders_differ() {
    let mut orders = std::collections::BTreeSet::new();
    for (edge, bits) in [(2, 1), (4, 2), (8, 3), (16, 4)] {
        for square in 0..(BLOCK / edge).pow(2) {
            let corner = [square % (BLOCK / edge), square / (BLOCK / edge)].map(|at| at * edge);
            let shifts = shifts(corner, edge);
            // One point in each cell of a grid as fine as the square.
            let mut cells: Vec<_> = shifts.iter().map(|shift| (*shift >> (32u32 - bits)).to_array()).collect();
            if edge == 16 {
                orders.insert(cells.iter().map(|[x, y]| [x ^ cells[0][0], y ^ cells[0][1]]).collect::<Vec<_>>());
            }
            cells.sort_unstable();
            cells.dedup();
            assert_eq!(cells.len() as u32, edge * edge, "{corner:?}");
        }
    }
    // All four squares had the same order, which showed as a weave.
    assert!(orders.len() > 1, "{}", orders.len());
}
