//! Images: PNG, JPEG and WebP, told apart by their content.

use std::borrow::Cow;
use std::io::Cursor;
use std::path::Path;

use image::{ImageReader, Limits};
use rayon::prelude::*;

use super::buffers::Buffers;
use super::fault::{Place, Result, invalid};
use super::schema::{self, Root};
use super::uri;
use crate::Image;

/// Most pixels a side.
const MAX_SIDE: u32 = 16_384;
/// Most bytes that decoding one image may take: RGBA of 8 bits and the largest sides is just within.
const MAX_BYTES: u64 = 1 << 30;

/// Decodes those of the file's images, on all cores.
pub(super) fn decode_all(root: &Root, indices: &[usize], buffers: &Buffers, folder: &Path) -> Result<Vec<Image>> {
    let decode = |index: &usize| {
        let image = &root.images[*index];
        decode(image, buffers, folder).place(|| match image.name.as_str() {
            "" => format!("images[{index}]"),
            name => format!("images[{index}] ({name})"),
        })
    };
    // Gather all results first, so that of several faults always the same one is reported.
    let images: Vec<_> = indices.par_iter().map(decode).collect();
    images.into_iter().collect()
}

fn decode(image: &schema::Image, buffers: &Buffers, folder: &Path) -> Result<Image> {
    let encoded: Cow<[u8]> = match (&image.uri, image.buffer_view) {
        (Some(uri), _) => uri::read(&uri.0, folder)?.into(),
        (None, Some(view)) => buffers.view(view)?.1.into(),
        (None, None) => return Err(invalid("neither uri nor bufferView")),
    };
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    let mut reader = ImageReader::new(Cursor::new(&encoded));
    reader.limits(limits);
    let reader = reader.with_guessed_format().expect("a cursor can be read");
    if reader.format().is_none() {
        return Err(invalid("neither PNG, JPEG nor WebP"));
    }
    let pixels = reader.decode().map_err(|error| invalid(error.to_string()))?.into_rgba8();
    Ok(Image { name: image.name.clone(), width: pixels.width(), height: pixels.height(), rgba: pixels.into_raw() })
}
