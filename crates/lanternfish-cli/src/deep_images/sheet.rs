//! Images side by side.

use lanternfish::{RenderError, RenderedImage, Report};

use crate::parse::SIDES;

/// Gap between two images, pixels.
const GAP: u32 = 8;
const GAP_COLOR: [u8; 4] = [255; 4];

/// A display image, by rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sheet {
    width: u32,
    pixels: Vec<[u8; 4]>,
}

impl Sheet {
    /// Creates a sheet from complete rows.
    pub fn new(width: u32, pixels: Vec<[u8; 4]>) -> Self {
        assert_eq!(pixels.len() % width as usize, 0, "{width} wide");
        Self { width, pixels }
    }

    fn height(&self) -> u32 {
        self.pixels.len() as u32 / self.width
    }

    /// Columns of a grid of `count` images: rows are filled, with at most three images each.
    pub fn columns(count: u32) -> u32 {
        count.clamp(1, 3)
    }

    /// Width and height of a grid of `count` images of one size.
    fn size(count: u32, width: u32, height: u32) -> (u32, u32) {
        let columns = Self::columns(count);
        let total = |count: u32, edge: u32| count.saturating_mul(edge.saturating_add(GAP)).saturating_sub(GAP);
        (total(columns, width), total(count.div_ceil(columns), height))
    }

    /// Returns an error if a grid of `count` squares of `edge` pixels is too large.
    pub fn check(count: u32, edge: u32) -> Result<(), RenderError> {
        let (width, height) = Self::size(count, edge, edge);
        match width.max(height) > *SIDES.end() {
            true => Err(RenderError::Size { width, height, limit: *SIDES.end() }),
            false => Ok(()),
        }
    }

    /// Arranges images of one size, at least one, row by row.
    pub fn side_by_side(sheets: Vec<Self>) -> Self {
        let count = sheets.len() as u32;
        let columns = Self::columns(count);
        let (width, height) = (sheets[0].width, sheets[0].height());
        let (total, rows) = Self::size(count, width, height);
        let mut pixels = vec![GAP_COLOR; total as usize * rows as usize];
        for (i, sheet) in (0..).zip(&sheets) {
            let (left, top) = (i % columns * (width + GAP), i / columns * (height + GAP));
            for (y, row) in (0..).zip(sheet.pixels.chunks_exact(width as usize)) {
                pixels[((top + y) * total + left) as usize..][..width as usize].copy_from_slice(row);
            }
        }
        Self { width: total, pixels }
    }

    /// Converts to an image without radiance.
    pub fn into_image(self) -> RenderedImage {
        let (width, height) = (self.width, self.height());
        RenderedImage {
            width,
            height,
            radiance: Vec::new(),
            display: self.pixels,
            exposure: None,
            report: Report::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_arranged_in_rows_with_gaps() {
        let sheet = |value: u8| Sheet::new(2, vec![[value; 4]; 6]);
        assert_eq!(Sheet::side_by_side(vec![sheet(7)]), sheet(7));
        let four = Sheet::side_by_side((1..=4).map(sheet).collect()).into_image();
        assert_eq!((four.width, four.height), (3 * 2 + 2 * GAP, 2 * 3 + GAP));
        let at = |x: u32, y: u32| four.display[(y * four.width + x) as usize][0];
        let across = 2 + GAP;
        assert_eq!([at(0, 0), at(1, 2), at(across, 0), at(2 * across + 1, 1), at(1, 3 + GAP)], [1, 1, 2, 3, 4]);
        assert_eq!([at(2, 0), at(across - 1, 2), at(0, 3), at(across, 3 + GAP)], [255; 4]);
    }
    #[test]
    fn sheets_have_a_largest_size() {
        assert!(Sheet::check(1, 16384).is_ok() && Sheet::check(64, (16384 + GAP) / 22 - GAP).is_ok());
        for (count, edge) in [(1, 16385), (2, 8189), (64, (16384 + GAP) / 22 - GAP + 1), (64, u32::MAX)] {
            assert!(matches!(Sheet::check(count, edge), Err(RenderError::Size { .. })), "{count} of {edge}");
        }
    }
}
