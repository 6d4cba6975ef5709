//! The bytes of buffers and buffer views.

use std::borrow::Cow;
use std::path::Path;

use super::fault::{Place, Result, invalid, item};
use super::schema::{BufferView, Root};
use super::uri;

/// The bytes of all buffers. The BIN chunk is borrowed from the file.
pub(super) struct Buffers<'a> {
    root: &'a Root<'a>,
    /// As long as `root.buffers`; `None` for a buffer that some extension would fill.
    buffers: Vec<Option<Cow<'a, [u8]>>>,
}

impl<'a> Buffers<'a> {
    /// Reads every buffer of the file.
    pub fn load(root: &'a Root<'a>, bin: Option<&'a [u8]>, folder: &Path) -> Result<Self> {
        let load_one = |index: usize| -> Result<Option<Cow<'a, [u8]>>> {
            let buffer = &root.buffers[index];
            let bytes: Cow<'a, [u8]> = match (&buffer.uri, bin) {
                (Some(uri), _) => uri::read(&uri.0, folder)?.into(),
                (None, Some(bin)) if index == 0 => bin.into(),
                (None, _) => return Ok(None),
            };
            if bytes.len() < buffer.byte_length {
                return Err(invalid(format!("{} bytes stated, {} there", buffer.byte_length, bytes.len())));
            }
            Ok(Some(bytes))
        };
        let buffers = (0..root.buffers.len()).map(|i| load_one(i).place(|| format!("buffers[{i}]")));
        Ok(Self { root, buffers: buffers.collect::<Result<_>>()? })
    }

    /// A buffer view and its bytes.
    pub fn view(&self, index: usize) -> Result<(&BufferView, &[u8])> {
        let view = item(&self.root.buffer_views, index, "bufferViews")?;
        let bytes = self.view_bytes(view).place(|| format!("bufferViews[{index}]"))?;
        Ok((view, bytes))
    }

    fn view_bytes(&self, view: &BufferView) -> Result<&[u8]> {
        let Some(bytes) = item(&self.buffers, view.buffer, "buffers")? else {
            return Err(invalid(format!("buffers[{}] has no content", view.buffer)));
        };
        let length = self.root.buffers[view.buffer].byte_length;
        let end = view.byte_offset.checked_add(view.byte_length).filter(|end| *end <= length);
        let end = end.ok_or_else(|| {
            let (offset, count) = (view.byte_offset, view.byte_length);
            invalid(format!("{count} bytes from {offset} exceed buffers[{}] of {length} bytes", view.buffer))
        })?;
        Ok(&bytes[view.byte_offset..end])
    }
}
