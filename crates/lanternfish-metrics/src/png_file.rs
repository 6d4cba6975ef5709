//! PNG files of display values.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufReader},
    path::Path,
};

use image::{DynamicImage, ImageDecoder, ImageError, ImageResult, codecs::png::PngDecoder};
use lanternfish_limits::{caught, memory::Budget};

use crate::{MetricsError, RgbImage, open_file::open_file, write_aside};

/// The channels of a pixel, and their bytes: one, or two with the higher first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorType {
    /// Red, green, blue.
    Rgb,
    /// Red, green, blue and alpha, not premultiplied.
    Rgba,
    /// One channel of 16 bits: a number.
    Number16,
    /// Three channels of 16 bits: numbers.
    Numbers16,
}

impl ColorType {
    /// Bytes per pixel.
    #[doc(hidden)]
    pub const fn bytes(self) -> usize {
        match self {
            Self::Rgb => 3,
            Self::Rgba => 4,
            Self::Number16 => 2,
            Self::Numbers16 => 6,
        }
    }
}

/// Writes sRGB-encoded 8-bit pixels, or numbers of 16 bits, rows from the top. `size`: width and height, pixels. The write is atomic.
pub fn write_png(path: &Path, size: [u32; 2], color: ColorType, pixels: &[u8]) -> Result<(), MetricsError> {
    write_png_with_texts(path, size, color, pixels, &[])
}

/// As [`write_png`], with texts by keyword, before the pixels. A keyword has 1 to 79 ASCII letters; `Software` is one
/// of the format's own. Equal content gives equal bytes.
pub fn write_png_with_texts(
    path: &Path,
    [width, height]: [u32; 2],
    color: ColorType,
    pixels: &[u8],
    texts: &[(&str, &str)],
) -> Result<(), MetricsError> {
    let expected = width as usize * height as usize * color.bytes();
    if pixels.len() != expected {
        return Err(MetricsError::PixelCount { got: pixels.len(), expected });
    }
    let is_keyword = |name: &str| matches!(name.len(), 1..80) && name.bytes().all(|b| b.is_ascii_graphic());
    if let Some((name, _)) = texts.iter().find(|(name, text)| !is_keyword(name) || text.contains('\0')) {
        let what = format!("{name:?} cannot be written: a keyword has 1 to 79 ASCII letters, a text no zero");
        return Err(MetricsError::Invalid { path: path.to_owned(), what });
    }
    write_aside(path, |file| {
        let mut encoder = png::Encoder::new(file, width, height);
        encoder.set_color(match color {
            ColorType::Rgb | ColorType::Numbers16 => png::ColorType::Rgb,
            ColorType::Rgba => png::ColorType::Rgba,
            ColorType::Number16 => png::ColorType::Grayscale,
        });
        encoder.set_depth(match color {
            ColorType::Rgb | ColorType::Rgba => png::BitDepth::Eight,
            ColorType::Number16 | ColorType::Numbers16 => png::BitDepth::Sixteen,
        });
        encoder.set_compression(png::Compression::Fast);
        encoder.set_filter(png::Filter::Adaptive);
        for (name, text) in texts {
            // The older kind of chunk, which every program reads, is Latin-1.
            match text.is_ascii() {
                true => encoder.add_text_chunk((*name).to_owned(), (*text).to_owned())?,
                false => encoder.add_itxt_chunk((*name).to_owned(), (*text).to_owned())?,
            }
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(pixels)?;
        Ok(writer.finish()?)
    })
    .map_err(|source| MetricsError::Io { path: path.to_owned(), source })
}

/// The texts of a PNG file by keyword: those that stand before the pixels and are not compressed.
pub fn read_png_texts(path: &Path) -> Result<BTreeMap<String, String>, MetricsError> {
    let invalid = |what: String| MetricsError::Invalid { path: path.to_owned(), what };
    let file = open_file(path).map_err(|source| MetricsError::Io { path: path.to_owned(), source })?;
    let read = || {
        // The decoder takes at most 64 MiB.
        let reader = png::Decoder::new(BufReader::new(file)).read_info()?;
        let latin =
            reader.info().uncompressed_latin1_text.iter().map(|chunk| (chunk.keyword.clone(), chunk.text.clone()));
        let mut texts: BTreeMap<_, _> = latin.collect();
        for chunk in reader.info().utf8_text.iter().filter(|chunk| !chunk.compressed) {
            texts.insert(chunk.keyword.clone(), chunk.get_text()?);
        }
        Ok(texts)
    };
    let texts: Result<_, png::DecodingError> = caught(read).map_err(invalid)?;
    texts.map_err(|error| invalid(format!("not a PNG image that can be read ({error})")))
}

/// Reads display values: **sRGB-encoded**, 0..=1, not linear. A grey image gets three equal channels.
///
/// Channels have 8 or 16 bits. Alpha is dropped, and the colours are used as stored. A gamma or colour profile in the
/// file is ignored.
pub fn read_png(path: &Path) -> Result<RgbImage, MetricsError> {
    read_display(path, "PNG", PngDecoder::new)
}

/// The same of a file of another format.
pub(crate) fn read_display<D: ImageDecoder>(
    path: &Path,
    format: &str,
    decoder: impl FnOnce(BufReader<File>) -> ImageResult<D>,
) -> Result<RgbImage, MetricsError> {
    let failed = |error| match error {
        ImageError::IoError(source) if source.kind() != io::ErrorKind::UnexpectedEof => {
            MetricsError::Io { path: path.to_owned(), source }
        }
        error => {
            let what = format!("not a {format} image that can be read ({error})");
            MetricsError::Invalid { path: path.to_owned(), what }
        }
    };
    let file = open_file(path).map_err(|error| failed(error.into()))?;
    let decode = || {
        let decoder = decoder(BufReader::new(file)).map_err(failed)?;
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
            write_png(&path, [7, 5], color, &pixels).unwrap();
            let read = image::open(&path).unwrap();
            assert_eq!((read.width(), read.height()), (7, 5));
            assert_eq!(read.as_bytes(), pixels);
        }
        let numbers = [0u16, 1, 0x1234, 65535, 300, 7];
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_be_bytes()).collect();
        write_png(&path, [3, 2], ColorType::Number16, &bytes).unwrap();
        assert_eq!(image::open(&path).unwrap().as_luma16().unwrap().as_raw(), &numbers);
        write_png(&path, [1, 2], ColorType::Numbers16, &bytes).unwrap();
        assert_eq!(image::open(&path).unwrap().as_rgb16().unwrap().as_raw(), &numbers);
    }

    /// The chunks of a PNG file, by the format's specification: length, type, data, checksum.
    fn chunks(mut bytes: &[u8]) -> Vec<(&[u8], &[u8])> {
        let mut chunks = Vec::new();
        bytes = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n").unwrap();
        while let Some(length) = bytes.first_chunk::<4>() {
            let end = 8 + u32::from_be_bytes(*length) as usize;
            chunks.push((&bytes[4..8], &bytes[8..end]));
            bytes = &bytes[end + 4..];
        }
        chunks
    }

    #[test]
    fn texts_are_chunks_before_the_same_pixels() {
        let folder = tempfile::tempdir().unwrap();
        let (plain, path) = (folder.path().join("plain.png"), folder.path().join("image.png"));
        let pixels: Vec<u8> = (0..7 * 5 * 3).map(|i| (i * 37) as u8).collect();
        write_png(&plain, [7, 5], ColorType::Rgb, &pixels).unwrap();
        let plain = std::fs::read(&plain).unwrap();
        // What another encoder makes of these pixels.
        let mut other = Vec::new();
        let encoder = image::codecs::png::PngEncoder::new(&mut other);
        image::ImageEncoder::write_image(encoder, &pixels, 7, 5, image::ExtendedColorType::Rgb8).unwrap();
        assert!(plain == other);

        let texts = [("Software", "lanternfish 1"), ("lanternfish.a", "größe\n"), ("lanternfish.b", "")];
        write_png_with_texts(&path, [7, 5], ColorType::Rgb, &pixels, &texts).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let found = chunks(&bytes);
        assert_eq!(found[1], (&b"tEXt"[..], &b"Software\0lanternfish 1"[..]));
        // After the keyword: no compression (two bytes), no language, no translation.
        assert_eq!(found[3], (&b"iTXt"[..], "lanternfish.a\0\0\0\0\0größe\n".as_bytes()));
        assert_eq!(found[2], (&b"tEXt"[..], &b"lanternfish.b\0"[..]));
        assert_eq!([&found[..1], &found[4..]].concat(), chunks(&plain));
        assert_eq!(image::open(&path).unwrap().as_bytes(), pixels, "which checks the checksums");

        let read = read_png_texts(&path).unwrap();
        assert_eq!(read, texts.map(|(name, text)| (name.to_owned(), text.to_owned())).into());
        for wrong in [("", "x"), ("größe", "x"), (&*"x".repeat(80), "x"), ("a", "x\0y")] {
            let error = write_png_with_texts(&path, [7, 5], ColorType::Rgb, &pixels, &[wrong]).unwrap_err();
            assert!(matches!(error, MetricsError::Invalid { .. }), "{error:?}");
        }
        assert!(std::fs::read(&path).unwrap() == bytes, "what is refused is not written");
    }

    #[test]
    fn too_few_bytes_are_refused_and_nothing_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.png");
        assert!(matches!(
            write_png(&path, [7, 5], ColorType::Rgba, &[0; 7 * 5 * 3]),
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
            write_png(&path, [7, 5], color, &pixels).unwrap();
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
        write_png(&path, [40, 40], ColorType::Rgb, &[77; 4800]).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        for broken in [&b"this is no image"[..], b"", &bytes[..bytes.len() / 2]] {
            std::fs::write(&path, broken).unwrap();
            let error = read_png(&path).unwrap_err();
            assert!(matches!(error, MetricsError::Invalid { .. }), "{error:?}");
            assert!(error.to_string().contains("image.png"));
        }
        std::fs::write(&path, &bytes[..20]).unwrap();
        let error = read_png_texts(&path).unwrap_err();
        assert!(matches!(error, MetricsError::Invalid { .. }) && error.to_string().contains("image.png"), "{error:?}");
    }
}
