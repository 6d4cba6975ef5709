//! Places many images on one sheet, each downsampled by an integer factor: the image of `docs/any-file.md`.
//!
//! `cargo run --release -p lanternfish-metrics --example sheet -- COLUMNS FACTOR SHEET.jpg IMAGE.png…`: images of one
//! size, row by row.

use std::{error::Error, path::Path};

use image::{ExtendedColorType, ImageEncoder, codecs::jpeg::JpegEncoder};
use lanternfish_metrics::{read_png, write_aside};

/// Pixels between images.
const GAP: usize = 4;
/// Quality of the JPEG file, 1 to 100.
const QUALITY: u8 = 88;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [columns, factor, sheet, renderings @ ..] = &words[..] else {
        return Err("COLUMNS FACTOR SHEET.jpg IMAGE.png…".into());
    };
    let (columns, factor): (usize, usize) = (columns.parse()?, factor.parse()?);
    let cells = renderings.iter().map(|path| Ok(read_png(Path::new(path))?.box_downsampled(factor)?));
    let cells = cells.collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    let first = cells.first().ok_or("no images")?;
    let (across, down) = (first.width + GAP, first.height + GAP);
    let (width, height) = (columns * across - GAP, cells.len().div_ceil(columns) * down - GAP);
    let mut pixels = vec![255u8; 3 * width * height];
    for (i, cell) in cells.iter().enumerate() {
        if (cell.width, cell.height) != (first.width, first.height) {
            return Err(format!("{} has another size than {}", renderings[i], renderings[0]).into());
        }
        for (y, row) in cell.pixels.chunks(cell.width).enumerate() {
            let start = 3 * ((i / columns * down + y) * width + i % columns * across);
            let bytes = row.iter().flatten().map(|value| (255.0 * value).round() as u8);
            pixels[start..start + 3 * cell.width].iter_mut().zip(bytes).for_each(|(pixel, byte)| *pixel = byte);
        }
    }
    write_aside(Path::new(sheet), |file| {
        let encoder = JpegEncoder::new_with_quality(file, QUALITY);
        Ok(encoder.write_image(&pixels, width as u32, height as u32, ExtendedColorType::Rgb8)?)
    })
}
