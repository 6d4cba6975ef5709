//! Loading of images: PNG, JPEG and WebP.

use std::borrow::Cow;

use rayon::prelude::*;

use super::buffers::Buffers;
use super::fault::{Place, Result, invalid};
use super::schema::{self, Root};
use super::uri;
use crate::{
    Image,
    import::{files::Files, pixels},
};

/// Decodes the file's images at `indices` on all cores. An error, before decoding, if they exceed the memory budget.
pub(super) fn decode_all(root: &Root, indices: &[usize], buffers: &Buffers, files: &Files) -> Result<Vec<Image>> {
    let name = |index: usize| match root.images[index].name.as_str() {
        "" => format!("images[{index}]"),
        name => format!("images[{index}] ({name})"),
    };
    let encoded = |index: &usize| encoded(&root.images[*index], buffers, files).place(|| name(*index));
    let encoded: Vec<Cow<[u8]>> = indices.iter().map(encoded).collect::<Result<_>>()?;
    let size = |(index, bytes): (&usize, &Cow<[u8]>)| {
        let size = pixels::size(bytes).map_err(invalid).place(|| name(*index))?;
        Ok((name(*index), size))
    };
    let sizes: Vec<_> = indices.iter().zip(&encoded).map(size).collect::<Result<_>>()?;
    pixels::reserve(&sizes, files.budget)?;
    let decode = |(index, bytes): (&usize, &Cow<[u8]>)| {
        pixels::decode(&root.images[*index].name, bytes).map_err(invalid).place(|| name(*index))
    };
    // Gather all results first, so that the same fault of several is always reported.
    let images: Vec<_> = indices.par_iter().zip(&encoded).map(decode).collect();
    images.into_iter().collect()
}

fn encoded<'a>(image: &schema::Image, buffers: &'a Buffers, files: &Files) -> Result<Cow<'a, [u8]>> {
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) => Ok(uri::read(&uri.0, files)?.into()),
        (None, Some(view)) => Ok(buffers.view(view)?.1.into()),
        (None, None) => Err(invalid("neither uri nor bufferView")),
    }
}
