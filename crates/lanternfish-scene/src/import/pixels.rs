//! Decoding of PNG, JPEG and WebP images, detected by their content.

use std::io::Cursor;

use image::{ImageDecoder, ImageReader, Limits};
use lanternfish_limits::caught;
use lanternfish_limits::memory::{Budget, TooMuch};

use crate::Image;

/// Largest width and height, pixels.
const MAX_SIDE: u32 = 16_384;
/// Memory limit for decoding one image, bytes: exactly an 8-bit RGBA image of the largest sides.
const MAX_BYTES: u64 = 1 << 30;

/// Size of an image, from its header.
#[derive(Clone, Copy, Debug)]
pub(super) struct Size {
    pub width: u32,
    pub height: u32,
    /// Size of the decoder's output, bytes.
    decoded: u64,
}

impl Size {
    /// Size of the stored RGBA pixels, bytes.
    fn kept(&self) -> u64 {
        4 * u64::from(self.width) * u64::from(self.height)
    }
}

/// Reads the header of an image.
pub(super) fn size(encoded: &[u8]) -> Result<Size, String> {
    caught(|| {
        let decoder = reader(encoded)?.into_decoder().map_err(|error| error.to_string())?;
        let (width, height) = decoder.dimensions();
        Ok(Size { width, height, decoded: decoder.total_bytes() })
    })?
}

/// Takes the memory of decoding from the budget: the pixels of every image, and on each thread twice the decoder's output.
/// `sizes` holds the names and sizes of the images to decode.
pub(super) fn reserve(sizes: &[(String, Size)], budget: &Budget) -> Result<(), TooMuch> {
    let kept: u64 = sizes.iter().map(|(_, size)| size.kept()).sum();
    let mut decoders: Vec<u64> = sizes.iter().map(|(_, size)| 2 * size.decoded).collect();
    decoders.sort_unstable_by(|a, b| b.cmp(a));
    let transient: u64 = decoders.iter().take(rayon::current_num_threads()).sum();
    budget.check(kept + transient, || {
        let largest = sizes.iter().max_by_key(|(_, size)| size.kept());
        let of = |(name, Size { width, height, .. }): &(String, Size)| format!("{name}, of {width} × {height} pixels");
        match (sizes.len(), largest.map(of)) {
            (1, Some(largest)) => format!("{largest}, needs"),
            (count, largest) => format!("{count} images (the largest is {}) need", largest.unwrap_or_default()),
        }
    })?;
    budget.take(kept, String::new)
}

/// Decodes an image.
pub(super) fn decode(name: &str, encoded: &[u8]) -> Result<Image, String> {
    caught(|| {
        let pixels = reader(encoded)?.decode().map_err(|error| error.to_string())?.into_rgba8();
        let (width, height) = pixels.dimensions();
        if width == 0 || height == 0 {
            return Err("no pixels".to_owned());
        }
        Ok(Image { name: name.to_owned(), width, height, rgba: pixels.into_raw() })
    })?
}

fn reader(encoded: &[u8]) -> Result<ImageReader<Cursor<&[u8]>>, String> {
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    let mut reader = ImageReader::new(Cursor::new(encoded));
    reader.limits(limits);
    let reader = reader.with_guessed_format().map_err(|error| error.to_string())?;
    if reader.format().is_none() {
        return Err("neither PNG, JPEG nor WebP".to_owned());
    }
    Ok(reader)
}
