//! PNG: what a display shows.

use std::{io, path::Path};

use image::{ExtendedColorType, ImageEncoder, ImageError, codecs::png::PngEncoder};

use crate::{MetricsError, write_aside};

/// What the bytes of a pixel mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorType {
    /// Red, green, blue.
    Rgb,
    /// Red, green, blue, and opacity that the others are not multiplied by.
    Rgba,
}

impl ColorType {
    /// Bytes a pixel.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Rgb => 3,
            Self::Rgba => 4,
        }
    }
}

/// Writes sRGB-encoded 8-bit pixels, rows from the top, whole or not at all.
pub fn write_png(path: &Path, width: u32, height: u32, color: ColorType, pixels: &[u8]) -> Result<(), MetricsError> {
    let expected = width as usize * height as usize * color.bytes();
    if pixels.len() != expected {
        return Err(MetricsError::PixelCount { got: pixels.len(), expected });
    }
    let color = match color {
        ColorType::Rgb => ExtendedColorType::Rgb8,
        ColorType::Rgba => ExtendedColorType::Rgba8,
    };
    write_aside(path, |file| {
        PngEncoder::new(file).write_image(pixels, width, height, color).map_err(|error| match error {
            ImageError::IoError(error) => error,
            error => io::Error::other(error),
        })
    })
    .map_err(|source| MetricsError::Io { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_come_back_as_they_were() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        for color in [ColorType::Rgb, ColorType::Rgba] {
            let pixels: Vec<u8> = (0..7 * 5 * color.bytes()).map(|i| (i * 37) as u8).collect();
            write_png(&path, 7, 5, color, &pixels).unwrap();
            let read = image::open(&path).unwrap();
            assert_eq!((read.width(), read.height()), (7, 5));
            assert_eq!(read.as_bytes(), pixels);
        }
    }

    #[test]
    fn too_few_bytes_are_refused_and_nothing_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        assert!(matches!(
            write_png(&path, 7, 5, ColorType::Rgba, &[0; 7 * 5 * 3]),
            Err(MetricsError::PixelCount { got: 105, expected: 140 })
        ));
        assert!(!path.exists());
    }
}
