//! A sheet of images with text, in display colours.

use font8x8::legacy::BASIC_LEGACY;

/// Width and height of a glyph, glyph pixels.
pub const GLYPH: usize = 8;

const PAPER: [u8; 4] = [24, 24, 24, 255];
/// The colour of text.
pub const INK: [u8; 4] = [230, 230, 230, 255];

/// A sheet: rows from the top.
pub struct Sheet {
    pub width: usize,
    pub height: usize,
    /// Sheet pixels per glyph pixel, across and down.
    pub letters: usize,
    pub pixels: Vec<[u8; 4]>,
}

impl Sheet {
    pub fn new(width: usize, height: usize, letters: usize) -> Self {
        Self { width, height, letters, pixels: vec![PAPER; width * height] }
    }

    /// Copies an image of this width, which ends within the sheet.
    pub fn paste(&mut self, left: usize, top: usize, width: usize, image: &[[u8; 4]]) {
        for (row, texels) in image.chunks(width).enumerate() {
            self.pixels[(top + row) * self.width + left..][..width].copy_from_slice(texels);
        }
    }

    /// Fills a rectangle, as far as it is in the sheet.
    pub fn fill(&mut self, left: usize, top: usize, width: usize, height: usize, color: [u8; 4]) {
        for y in top..(top + height).min(self.height) {
            let end = (left + width).min(self.width);
            self.pixels[y * self.width + left.min(end)..y * self.width + end].fill(color);
        }
    }

    /// Writes a line of ASCII.
    pub fn write(&mut self, left: usize, top: usize, text: &str) {
        let unit = self.letters;
        for (i, byte) in text.bytes().enumerate() {
            let glyph = BASIC_LEGACY[usize::from(byte.min(127))];
            for (y, row) in glyph.into_iter().enumerate() {
                for x in (0..GLYPH).filter(|x| row >> x & 1 == 1) {
                    self.fill(left + (i * GLYPH + x) * unit, top + y * unit, unit, unit, INK);
                }
            }
        }
    }
}
