//! JPEG files of display values.

use std::path::Path;

use image::{ExtendedColorType, ImageEncoder as _, ImageError, codecs::jpeg::JpegEncoder};

use crate::{MetricsError, write_aside};

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

/// Width and height of a complete JPEG file, pixels. All pixels are decoded.
pub fn check_jpeg(path: &Path) -> Result<(usize, usize), MetricsError> {
    let invalid = |what: String| MetricsError::Invalid { path: path.to_owned(), what };
    let read = || image::open(path).map(|image| (image.width() as usize, image.height() as usize));
    lanternfish_limits::caught(read).map_err(invalid)?.map_err(|error| invalid(format!("not a JPEG image ({error})")))
}

#[cfg(test)]
#[test]
fn a_jpeg_file_is_nearly_the_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.jpg");
    let pixels: Vec<u8> = (0..48 * 32).flat_map(|i| [(i % 48 * 5) as u8, 100, 200]).collect();
    write_jpeg(&path, [48, 32], &pixels).unwrap();
    assert_eq!(check_jpeg(&path).unwrap(), (48, 32));
    let read = image::open(&path).unwrap().into_rgb8();
    let most = read.as_raw().iter().zip(&pixels).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    assert!(most <= 24, "{most}");
    assert!(write_jpeg(&path, [48, 31], &pixels).is_err());
    std::fs::write(&path, &std::fs::read(&path).unwrap()[..100]).unwrap();
    assert!(check_jpeg(&path).is_err());
}
