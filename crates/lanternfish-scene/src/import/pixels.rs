//! Decoding of PNG, JPEG, WebP and KTX2 images, detected by their content.

use std::io::Cursor;

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use image::{ImageDecoder, ImageFormat, ImageReader, Limits};
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
        if is_ktx2(encoded) {
            let (width, height) = stated_size(encoded)?;
            return Ok(Size { width, height, decoded: 4 * u64::from(width) * u64::from(height) });
        }
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
        if is_ktx2(encoded) {
            let (width, height) = stated_size(encoded)?;
            let rgba = transcode(encoded).map_err(|error| format!("not a Basis Universal texture: {error:?}"))?;
            if rgba.len() as u64 != 4 * u64::from(width) * u64::from(height) {
                return Err(format!("{} bytes instead of {width} × {height} pixels", rgba.len()));
            }
            return Ok(Image { name: name.to_owned(), width, height, rgba });
        }
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
    // Programs that write GIF files have its decoder, too.
    if reader.format().is_none_or(|format| format == ImageFormat::Gif) {
        return Err("neither PNG, JPEG, WebP nor KTX2".to_owned());
    }
    Ok(reader)
}

/// First bytes of a KTX2 file.
const KTX2: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

fn is_ktx2(encoded: &[u8]) -> bool {
    encoded.starts_with(KTX2)
}

/// Width and height from the header of a KTX2 file, before anything of it is unpacked. `KHR_texture_basisu` allows one image, without layers or faces.
fn stated_size(encoded: &[u8]) -> Result<(u32, u32), String> {
    let word = |at: usize| encoded.get(at..)?.first_chunk().map(|bytes| u32::from_le_bytes(*bytes));
    let header = [20, 24, 32, 36].map(word);
    // The first entry of the index of levels: offset, length, and length without supercompression.
    let unpacked = encoded.get(96..).and_then(|rest| rest.first_chunk()).map(|bytes| u64::from_le_bytes(*bytes));
    let ([Some(width), Some(height), Some(layers), Some(faces)], Some(unpacked)) = (header, unpacked) else {
        return Err("the file is cut".to_owned());
    };
    if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) || layers > 1 || faces != 1 {
        return Err(format!(
            "{layers} layers of {faces} faces of {width} × {height} pixels, where one image is expected"
        ));
    }
    // Blocks of 4 × 4 pixels have at most 16 bytes.
    if unpacked > 16 * u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4)) {
        return Err(format!("{unpacked} bytes stated for {width} × {height} pixels"));
    }
    Ok((width, height))
}

/// The pixels of the first level of a Basis Universal texture (ETC1S or UASTC), as `KHR_texture_basisu` requires.
fn transcode(encoded: &[u8]) -> Result<Vec<u8>, basisu::Error> {
    Transcoder::new(encoded)?.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE)
}
