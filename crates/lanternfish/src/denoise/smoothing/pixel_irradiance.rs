//! Sums of the rays of sampled pixels, of all rows of an image or of a band of them.

use std::{iter, ops::Range};

use glam::UVec2;
use lanternfish_gpu::{Bindings, BufferPart, Frame};

use super::{IndirectResolution, Smoothed, SmoothingParameters};
use crate::error::RenderError;

/// Size of `PackedIrradiance`, the sums of a pixel, bytes.
const IRRADIANCE_BYTES: u64 = 48;

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

/// Irradiance sums of the sampled pixels, for one frame.
#[derive(Debug)]
pub struct PixelIrradiance {
    /// One element per sampled pixel of the rows, row by row. Shaders bind it under names of their own.
    pub irradiance: wgpu::Buffer,
    /// Number of sampled pixels, across and down: of the rows.
    pub size: UVec2,
    /// Size of the image.
    pub(super) rendering: UVec2,
    pub(super) parameters: SmoothingParameters,
    /// The parameters of resolve, as a uniform: the passes that trace rays read the scale.
    uniform: BufferPart,
}

impl PixelIrradiance {
    /// Allocates the sums for an image of this size. `smoothed`: how the image is smoothed.
    pub fn new(
        frame: &mut Frame<'_>,
        rendering: UVec2,
        resolution: IndirectResolution,
        smoothed: Smoothed,
    ) -> Result<Self, RenderError> {
        let rows = rendering.y.div_ceil(resolution.scale());
        Self::of_rows(frame, rendering, resolution, smoothed, 0..rows)
    }

    /// Allocates the sums of some rows of sampled pixels.
    pub(crate) fn of_rows(
        frame: &mut Frame<'_>,
        rendering: UVec2,
        resolution: IndirectResolution,
        Smoothed(parameters): Smoothed,
        rows: Range<u32>,
    ) -> Result<Self, RenderError> {
        let scale = resolution.scale();
        let size = UVec2::new(rendering.x.div_ceil(scale), rows.end - rows.start);
        let parameters = SmoothingParameters { scale, first_row: rows.start, row_count: size.y, ..parameters };
        let irradiance = frame.scratch("indirect/irradiance", IRRADIANCE_BYTES * u64::from(size.element_product()))?;
        Ok(Self { irradiance, size, rendering, parameters, uniform: frame.uniform(&parameters) })
    }

    /// The bands of rows in which an image is processed, from top to bottom. At half resolution each has the first row of the next one too, from
    /// which its last pixels are interpolated.
    pub(crate) fn bands(rendering: UVec2, resolution: IndirectResolution) -> Vec<Range<u32>> {
        bands(rendering.map(|side| side.div_ceil(resolution.scale())), resolution.scale() - 1)
    }

    /// Bindings of `pixel.wesl`, beside the view's and the surface's.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().part("smoothing", &self.uniform)
    }
}

/// The bands of an image of this size, in sampled pixels, from top to bottom. `overlap`: rows that each shares with the next one.
fn bands(size: UVec2, overlap: u32) -> Vec<Range<u32>> {
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
    let rows_of = |most| bands_of(UVec2::new(100, 70), 0, most).into_iter().map(|rows| (rows.start, rows.end));
    assert!(rows_of(48 * 100 * 70).eq([(0, 70)]));
    assert!(rows_of(48 * 100 * 69).eq([(0, 64), (64, 70)]));
    assert_eq!(bands_of(UVec2::new(100, 70), 1, 48 * 100 * 64), [0..33, 32..65, 64..70]);
    // 4K, of which all would need 398 MB.
    let of_4k = bands_of(UVec2::new(3840, 2160), 0, MOST_BYTES);
    assert_eq!((of_4k.len(), of_4k.last().unwrap().end), (4, 2160));
    assert!(of_4k.iter().all(|rows| IRRADIANCE_BYTES * 3840 * u64::from(rows.end - rows.start) <= MOST_BYTES));
}
