//! Loading of images: PNG, JPEG and WebP.

use std::borrow::Cow;

use rayon::prelude::*;

use super::buffers::{Buffers, firsts};
use super::fault::{Fault, Place, Result, invalid};
use super::schema::{self, Root};
use super::uri;
use crate::{
    Image,
    import::{
        files::Files,
        pixels::{self, Size},
    },
};

/// For each of the file's images the first one of the same bytes: of the same view, or of the same URI.
pub(super) fn first_of_same(root: &Root, buffers: &Buffers) -> Vec<usize> {
    firsts(root.images.iter().map(|image| match (&image.uri, image.buffer_view) {
        (Some(uri), _) => (Some(&*uri.0), None),
        (None, view) => (None, view.map(|view| buffers.first_view(view))),
    }))
}

/// The bytes of an image and its size, or why they cannot be read.
type Encoded<'a> = std::result::Result<(Cow<'a, [u8]>, Size), String>;

/// Decodes the file's images at `indices` on all cores. An inner error says why an image is missing or damaged. An outer error, before decoding, if
/// they exceed the memory budget, or if one is in a place that may not be read.
pub(super) fn decode_all(
    root: &Root,
    indices: &[usize],
    buffers: &Buffers,
    files: &Files,
) -> Result<Vec<std::result::Result<Image, String>>> {
    let name = |index: usize| match root.images[index].name.as_str() {
        "" => format!("images[{index}]"),
        name => format!("images[{index}] ({name})"),
    };
    let read = |index: &usize| -> Result<Encoded> {
        match encoded(&root.images[*index], buffers, files).place(|| name(*index)) {
            Ok(bytes) => Ok(pixels::size(&bytes).map(|size| (bytes, size))),
            Err(Fault::Invalid(what) | Fault::Unsupported(what)) => Ok(Err(what)),
            Err(Fault::Io { path, source }) => Ok(Err(format!("{}: {source}", path.display()))),
            Err(fault) => Err(fault),
        }
    };
    let read: Vec<_> = indices.iter().map(read).collect::<Result<_>>()?;
    let named = |(index, read): (&usize, &Encoded)| read.as_ref().ok().map(|(_, size)| (name(*index), *size));
    let sizes: Vec<_> = indices.iter().zip(&read).filter_map(named).collect();
    pixels::reserve(&sizes, files.budget)?;
    let decode = |(index, read): (&usize, Encoded)| {
        let image = read.and_then(|(bytes, _)| pixels::decode(&root.images[*index].name, &bytes));
        image.map_err(|what| format!("{}: {what}", name(*index)))
    };
    Ok(indices.par_iter().zip(read).map(decode).collect())
}

fn encoded<'a>(image: &schema::Image, buffers: &'a Buffers, files: &Files) -> Result<Cow<'a, [u8]>> {
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) => Ok(uri::read(&uri.0, files)?.into()),
        (None, Some(view)) => Ok(buffers.view(view)?.1.into()),
        (None, None) => Err(invalid("neither uri nor bufferView")),
    }
}
