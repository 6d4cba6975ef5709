//! PNG files of display values.

use std::{
    io::{self, BufReader},
    path::Path,
};

use image::{
    DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, codecs::png::PngDecoder,
    codecs::png::PngEncoder,
};
use lanternfish_limits::{caught, memory::Budget};

use crate::{MetricsError, RgbImage, open_file::open_file, write_aside};

/// The channels of a pixel, one byte each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorType {
    /// Red, green, blue.
    Rgb,
    /// Red, green, blue and alpha, not premultiplied.
    Rgba,
}

impl ColorType {
    /// Bytes per pixel.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Rgb => 3,
            Self::Rgba => 4,
        }
    }
}

/// Writes sRGB-encoded 8-bit pixels, rows from the top. The write is atomic.
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

/// Reads display values: **sRGB-encoded**, 0..=1, not linear. A grey image gets three equal channels.
///
/// Channels have 8 or 16 bits. Alpha is dropped, and the colours are used as stored. A gamma or colour profile in the
/// file is ignored.
pub fn read_png(path: &Path) -> Result<RgbImage, MetricsError> {
    let failed = |error| match error {
        ImageError::IoError(source) if source.kind() != io::ErrorKind::UnexpectedEof => {
            MetricsError::Io { path: path.to_owned(), source }
        }
        error => {
            MetricsError::Invalid { path: path.to_owned(), what: format!("not a PNG image that can be read ({error})") }
        }
    };
    let file = open_file(path).map_err(|error| failed(error.into()))?;
    let decode = || {
        let decoder = PngDecoder::new(BufReader::new(file)).map_err(failed)?;
        let (width, height) = decoder.dimensions();
        // The decoded bytes, plus 12 bytes per pixel as floats and 12 as stored.
        let bytes = decoder.total_bytes().saturating_add(24 * u64::from(width) * u64::from(height));
        Budget::of_process()
            .check(bytes, || format!("{width} × {height} pixels need"))
            .map_err(|need| MetricsError::TooMuch { path: path.to_owned(), need })?;
        let image = DynamicImage::from_decoder(decoder).map_err(failed)?;
        let pixels = image.into_rgb32f().pixels().map(|pixel| pixel.0).collect();
        RgbImage::new(width as usize, height as usize, pixels)
    };
    caught(decode).unwrap_or_else(|what| Err(MetricsError::Invalid { path: path.to_owned(), what }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_round_trip() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.png");
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
        let path = folder.path().join("image.png");
        assert!(matches!(
            write_png(&path, 7, 5, ColorType::Rgba, &[0; 7 * 5 * 3]),
            Err(MetricsError::PixelCount { got: 105, expected: 140 })
        ));
        assert!(!path.exists());
    }

    #[test]
    fn bytes_are_read_as_display_values() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.png");
        for color in [ColorType::Rgb, ColorType::Rgba] {
            let pixels: Vec<u8> = (0..7 * 5 * color.bytes()).map(|i| (i * 37) as u8).collect();
            write_png(&path, 7, 5, color, &pixels).unwrap();
            let read = read_png(&path).unwrap();
            assert_eq!((read.width, read.height), (7, 5));
            for (read, bytes) in read.pixels.iter().zip(pixels.chunks(color.bytes())) {
                assert_eq!(read.map(|v| v * 255.0), [0, 1, 2].map(|c| f32::from(bytes[c])));
            }
        }
        // 16 bits, and grey.
        image::ImageBuffer::from_pixel(3, 2, image::Luma([0x8000u16])).save(&path).unwrap();
        assert_eq!(read_png(&path).unwrap(), RgbImage::new(3, 2, vec![[32768.0 / 65535.0; 3]; 6]).unwrap());
    }

    #[test]
    fn an_invalid_png_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.png");
        assert!(matches!(read_png(&path), Err(MetricsError::Io { .. })));
        write_png(&path, 40, 40, ColorType::Rgb, &[77; 4800]).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        for broken in [&b"this is no image"[..], b"", &bytes[..bytes.len() / 2]] {
            std::fs::write(&path, broken).unwrap();
            let error = read_png(&path).unwrap_err();
            assert!(matches!(error, MetricsError::Invalid { .. }), "{error:?}");
            assert!(error.to_string().contains("image.png"));
        }
    }
}
