//! Bytes of buffers and buffer views.

use std::borrow::Cow;
use std::collections::HashMap;
use std::hash::Hash;
use std::sync::OnceLock;

use lanternfish_limits::caught;

use super::fault::{Place, Result, invalid, item};
use super::schema::{Buffer, BufferView, CompressedView, Root};
use super::{meshopt, uri};
use crate::import::files::Files;

/// The bytes of all buffers. The BIN chunk is borrowed from the file.
pub(super) struct Buffers<'a> {
    root: &'a Root<'a>,
    files: &'a Files<'a>,
    /// As long as `root.buffers`; `None` for a buffer without content, whose views are compressed in another buffer.
    buffers: Vec<Option<Cow<'a, [u8]>>>,
    /// Content of compressed views, decoded on first use: once for all views of the same compressed bytes.
    decoded: HashMap<&'a CompressedView, OnceLock<Result<Vec<u32>>>>,
    /// As long as `root.buffer_views`: the first view of the same bytes.
    first_views: Vec<usize>,
}

impl<'a> Buffers<'a> {
    /// Reads every buffer of the file.
    pub fn load(root: &'a Root<'a>, bin: Option<&'a [u8]>, files: &'a Files<'a>) -> Result<Self> {
        let load_one = |index: usize| -> Result<Option<Cow<'a, [u8]>>> {
            let buffer = &root.buffers[index];
            let bytes: Cow<'a, [u8]> = match (&buffer.uri, bin) {
                _ if is_fallback(buffer) => return Ok(None),
                (Some(uri), _) => uri::read(&uri.0, files)?.into(),
                (None, Some(bin)) if index == 0 => bin.into(),
                (None, _) => return Ok(None),
            };
            if bytes.len() < buffer.byte_length {
                return Err(invalid(format!("{} bytes stated, {} there", buffer.byte_length, bytes.len())));
            }
            Ok(Some(bytes))
        };
        let buffers = (0..root.buffers.len()).map(|i| load_one(i).place(|| format!("buffers[{i}]")));
        let buffers = buffers.collect::<Result<_>>()?;
        let compressed = root.buffer_views.iter().filter_map(|view| view.extensions.compressed());
        let decoded = compressed.map(|compressed| (compressed, OnceLock::new())).collect();
        let place = |view: &'a BufferView| {
            (view.buffer, view.byte_offset, view.byte_length, view.byte_stride, view.extensions.compressed())
        };
        let first_views = firsts(root.buffer_views.iter().map(place));
        Ok(Self { root, files, buffers, decoded, first_views })
    }

    /// The first view of the same bytes as this one; itself if there is no such view.
    pub fn first_view(&self, index: usize) -> usize {
        self.first_views.get(index).copied().unwrap_or(index)
    }

    /// A buffer view and its bytes.
    pub fn view(&self, index: usize) -> Result<(&BufferView, &[u8])> {
        let view = item(&self.root.buffer_views, index, "bufferViews")?;
        let bytes = match view.extensions.compressed() {
            Some(compressed) => self.decoded(view, compressed),
            None => self.stored(view.buffer, view.byte_offset, view.byte_length),
        };
        Ok((view, bytes.place(|| format!("bufferViews[{index}]"))?))
    }

    /// The bytes of a compressed view. The first thread that requests them decodes them; others wait.
    fn decoded(&self, view: &BufferView, compressed: &CompressedView) -> Result<&[u8]> {
        let decode = || {
            let stored = self.stored(compressed.buffer, compressed.byte_offset, compressed.byte_length)?;
            caught(|| meshopt::decode(compressed, stored, self.files.budget)).map_err(invalid)?
        };
        let (length, have) = (view.byte_length, compressed.count.saturating_mul(compressed.byte_stride));
        if length > have {
            return Err(invalid(format!("{length} bytes stated, {have} compressed")));
        }
        let words = self.decoded[compressed].get_or_init(decode).as_ref().map_err(|fault| fault.copy())?;
        Ok(&bytemuck::cast_slice(words)[..length])
    }

    /// Bytes of a buffer.
    fn stored(&self, buffer: usize, offset: usize, count: usize) -> Result<&[u8]> {
        let Some(bytes) = item(&self.buffers, buffer, "buffers")? else {
            return Err(invalid(format!("buffers[{buffer}] has no content")));
        };
        let length = self.root.buffers[buffer].byte_length;
        let end = offset.checked_add(count).filter(|end| *end <= length);
        let end = end.ok_or_else(|| {
            invalid(format!("{count} bytes from {offset} exceed buffers[{buffer}] of {length} bytes"))
        })?;
        Ok(&bytes[offset..end])
    }
}

/// For each value the index of the first equal one.
pub(super) fn firsts<T: Eq + Hash>(values: impl Iterator<Item = T>) -> Vec<usize> {
    let mut first = HashMap::new();
    values.enumerate().map(|(index, value)| *first.entry(value).or_insert(index)).collect()
}

/// True if a buffer is only the uncompressed fallback of compressed data; it may have no content.
fn is_fallback(buffer: &Buffer) -> bool {
    let (ext, khr) = (&buffer.extensions.ext_meshopt, &buffer.extensions.khr_meshopt);
    ext.as_ref().or(khr.as_ref()).is_some_and(|extension| extension.fallback)
}
