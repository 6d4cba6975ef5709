//! Division of a frame's rows of blocks: into bands, whose words fit one buffer, and of each band into dispatches, which end in time.

use std::ops::Range;

use super::WORDS;
use crate::error::RenderError;

/// Greatest number of rays of a band, however large the device's bindings: they are counted in a u32.
pub const MOST_RAYS: u64 = 1 << 31;

/// Greatest number of rays of a dispatch, unless a single row of blocks has more. A display driver stops a dispatch after 2 s with usual
/// settings. 2²⁸ rays take 0.3 s at 10⁹ rays a second, and 2 s at an eighth of that. The words of a row bound its rays: ray culling leaves
/// out a half and more of them.
pub const MOST_RAYS_OF_DISPATCH: u64 = 1 << 28;

/// Words before each row of blocks; the total is last. Undoes the overflow of the device's sums at 2³².
pub fn row_starts(starts: &[u32], columns: usize) -> Vec<u64> {
    let by_row: Vec<u32> = starts.iter().copied().step_by(columns).collect();
    let words = by_row.windows(2).map(|pair| u64::from(pair[1].wrapping_sub(pair[0])));
    let sums = words.scan(0, |sum, words| {
        *sum += words;
        Some(*sum)
    });
    std::iter::once(0).chain(sums).collect()
}

/// The same for `rows` rows of equal length, of which the host only knows the sum.
pub fn even_row_starts(rows: u32, words: u64) -> Vec<u64> {
    (0..=u64::from(rows)).map(|row| words * row / u64::from(rows)).collect()
}

/// Divides rows into bands of at most `limit` words. `row_starts`: words before each row; the total is last.
pub fn bands(row_starts: &[u64], limit: u64) -> Result<Vec<Range<u32>>, RenderError> {
    if let Some(needed) = row_starts.windows(2).map(|pair| pair[1] - pair[0]).find(|words| *words > limit) {
        let remedy = "give the lights a shorter range, use `culling tiled`, or render a narrower image";
        return Err(RenderError::Overflow { list: WORDS, needed, limit, remedy });
    }
    Ok(split(row_starts, 0..row_starts.len() as u32 - 1, limit))
}

/// Divides these rows into ranges of at most `limit` words, or of a single row.
pub fn split(row_starts: &[u64], rows: Range<u32>, limit: u64) -> Vec<Range<u32>> {
    let mut ranges = Vec::new();
    let mut first = rows.start;
    for row in rows.start + 1..rows.end {
        if row_starts[row as usize + 1] - row_starts[first as usize] > limit {
            ranges.push(first..row);
            first = row;
        }
    }
    ranges.push(first..rows.end);
    ranges
}
