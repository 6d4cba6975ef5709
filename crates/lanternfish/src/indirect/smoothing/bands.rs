//! The bands of rows in which large images are processed.

use std::{iter, ops::Range};

use glam::UVec2;

/// Size of `PackedIrradiance`, the sums of a pixel, bytes.
pub(super) const IRRADIANCE_BYTES: u64 = 48;

/// Largest buffer of irradiance sums, bytes, which fits a storage binding of the default limits: the rows of larger images are processed in
/// bands.
const MOST_BYTES: u64 = 128 << 20;
/// Rows of a band are a multiple of this: the edge of the blocks in which rays are ordered.
const BAND_STEP: u32 = 32;

#[cfg(test)]
thread_local! {
    /// Replaces [`MOST_BYTES`] in tests.
    pub(crate) static MOST_IRRADIANCE_BYTES_IN_TESTS: std::cell::Cell<u64> = const { std::cell::Cell::new(MOST_BYTES) };
}

fn most_bytes() -> u64 {
    #[cfg(test)]
    return MOST_IRRADIANCE_BYTES_IN_TESTS.get();
    #[cfg(not(test))]
    MOST_BYTES
}

/// The bands of an image of this size, in sampled pixels, from top to bottom. `overlap`: rows that each shares with the next one.
pub(super) fn bands(size: UVec2, overlap: u32) -> Vec<Range<u32>> {
    bands_of(size, overlap, most_bytes())
}

/// Bands of rows whose sums have at most `most` bytes, if 32 rows have so few.
fn bands_of(size: UVec2, overlap: u32, most: u64) -> Vec<Range<u32>> {
    let fitting = most / (IRRADIANCE_BYTES * u64::from(size.x.max(1)));
    if u64::from(size.y) <= fitting {
        return iter::once(0..size.y).collect();
    }
    let rows = (fitting.saturating_sub(u64::from(overlap)) as u32 / BAND_STEP).max(1) * BAND_STEP;
    (0..size.y).step_by(rows as usize).map(|first| first..(first + rows + overlap).min(size.y)).collect()
}

#[cfg(test)]
#[test]
fn bands_cover_all_rows_and_fit() {
    assert_eq!(bands_of(UVec2::new(100, 70), 0, 48 * 100 * 70), [0..70]);
    assert_eq!(bands_of(UVec2::new(100, 70), 0, 48 * 100 * 69), [0..64, 64..70]);
    assert_eq!(bands_of(UVec2::new(100, 70), 1, 48 * 100 * 64), [0..33, 32..65, 64..70]);
    // 4K, of which all would need 398 MB.
    let of_4k = bands_of(UVec2::new(3840, 2160), 0, MOST_BYTES);
    assert_eq!((of_4k.len(), of_4k.last().unwrap().end), (4, 2160));
    assert!(of_4k.iter().all(|rows| IRRADIANCE_BYTES * 3840 * u64::from(rows.end - rows.start) <= MOST_BYTES));
}
