//! JPEG files of display values.

use std::path::Path;

use image::{
    ExtendedColorType, ImageEncoder as _, ImageError,
    codecs::jpeg::{JpegDecoder, JpegEncoder},
};

use crate::{MetricsError, RgbImage, png_file::read_display, write_aside};

/// Quality of the format's own scale up to 100: differences to the image are hardly visible.
const QUALITY: u8 = 92;

/// Writes sRGB-encoded pixels, three bytes each, rows from the top. `size`: width and height, pixels. The write is atomic.
pub fn write_jpeg(path: &Path, [width, height]: [u32; 2], pixels: &[u8]) -> Result<(), MetricsError> {
    let expected = width as usize * height as usize * 3;
    if pixels.len() != expected {
        return Err(MetricsError::PixelCount { got: pixels.len(), expected });
    }
    let invalid = |what: String| MetricsError::Invalid { path: path.to_owned(), what };
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, QUALITY)
        .write_image(pixels, width, height, ExtendedColorType::Rgb8)
        .map_err(|error: ImageError| invalid(format!("cannot be written as JPEG ({error})")))?;
    write_aside(path, |file| std::io::Write::write_all(file, &bytes))
        .map_err(|source| MetricsError::Io { path: path.to_owned(), source })
}

/// Reads display values: sRGB-encoded, 0..=1. A grey image gets three equal channels.
pub fn read_jpeg(path: &Path) -> Result<RgbImage, MetricsError> {
    read_display(path, "JPEG", JpegDecoder::new)
}

#[cfg(test)]
#[test]
fn a_jpeg_file_is_nearly_the_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.jpg");
    let pixels: Vec<u8> = (0..48 * 32).flat_map(|i| [(i % 48 * 5) as u8, 100, 200]).collect();
    write_jpeg(&path, [48, 32], &pixels).unwrap();
    let read = read_jpeg(&path).unwrap();
    assert_eq!((read.width, read.height), (48, 32));
    let most = read.pixels.as_flattened().iter().zip(&pixels).map(|(a, b)| (255.0 * a - f32::from(*b)).abs());
    assert!(most.fold(0.0, f32::max) <= 24.0);
    assert!(write_jpeg(&path, [48, 31], &pixels).is_err());
    std::fs::write(&path, &std::fs::read(&path).unwrap()[..100]).unwrap();
    assert!(read_jpeg(&path).is_err());
}
