//! A contact sheet: rows of small images with narrow gaps.

use std::path::Path;

use lanternfish_cli::{error::CliError, parse::Size};
use lanternfish_metrics::{ColorType, write_png};

/// Pixels between images.
const GAP: usize = 4;
/// Greatest width of an image in a sheet, pixels.
const WIDEST: usize = 240;

/// Rows of images of one size.
pub struct Sheet {
    size: Size,
    rows: Vec<Vec<Vec<u8>>>,
}

impl Sheet {
    /// A sheet of so many rows, of images of this size.
    pub fn new(size: Size, rows: usize) -> Self {
        Self { size, rows: vec![Vec::new(); rows] }
    }

    /// Adds an image at the end of a row: RGB bytes.
    pub fn add(&mut self, row: usize, rgb: &[u8]) {
        let small = smaller(self.size, self.step(), rgb);
        self.rows[row].push(small);
    }

    /// Pixels of an image, across and down, that become one.
    fn step(&self) -> usize {
        (self.size.width as usize).div_ceil(WIDEST)
    }

    /// Writes the sheet. Nothing without images.
    pub fn write(&self, path: &Path) -> Result<(), CliError> {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        if columns == 0 {
            return Ok(());
        }
        let [width, height] = [self.size.width, self.size.height].map(|side| side as usize / self.step());
        let across = columns * (width + GAP) - GAP;
        let down = self.rows.len() * (height + GAP) - GAP;
        let mut sheet = vec![0u8; 3 * across * down];
        for (row, images) in self.rows.iter().enumerate() {
            for (column, image) in images.iter().enumerate() {
                for (y, line) in image.chunks_exact(3 * width).enumerate() {
                    let first = 3 * ((row * (height + GAP) + y) * across + column * (width + GAP));
                    sheet[first..first + line.len()].copy_from_slice(line);
                }
            }
        }
        Ok(write_png(path, [across as u32, down as u32], ColorType::Rgb, &sheet)?)
    }
}

/// The image with the mean of every box of `step` by `step` pixels; a rest at the right and below is cut off.
fn smaller(size: Size, step: usize, rgb: &[u8]) -> Vec<u8> {
    let [width, height] = [size.width, size.height].map(|side| side as usize / step);
    let mut small = Vec::with_capacity(3 * width * height);
    for i in 0..3 * width * height {
        let (x, y, channel) = (i / 3 % width, i / 3 / width, i % 3);
        let at = |k: usize| (y * step + k / step) * size.width as usize + x * step + k % step;
        let sum: usize = (0..step * step).map(|k| usize::from(rgb[3 * at(k) + channel])).sum();
        small.push((sum / (step * step)) as u8);
    }
    small
}

#[test]
fn images_keep_their_places() {
    let size = Size { width: 2, height: 1 };
    let mut sheet = Sheet::new(size, 2);
    sheet.add(0, &[10; 6]);
    sheet.add(1, &[20; 6]);
    sheet.add(1, &[1, 2, 3, 4, 5, 6]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sheet.png");
    sheet.write(&path).unwrap();
    let image = lanternfish_metrics::read_png(&path).unwrap();
    assert_eq!((image.width, image.height), (2 * 2 + GAP, 2 + GAP));
    let at = |x: usize, y: usize| image.pixels[y * image.width + x].map(|value| (255.0 * value).round() as u8);
    assert_eq!([at(0, 0), at(0, 1 + GAP), at(2 + GAP, 1 + GAP), at(3 + GAP, 0)], [[10; 3], [20; 3], [1, 2, 3], [0; 3]]);
    assert_eq!(smaller(Size { width: 4, height: 2 }, 2, &[8; 24]), [8; 6]);
}
