//! The two forms of a file: JSON text, and GLB (a header, a JSON chunk and an optional BIN chunk).

use super::fault::{Fault, Result, invalid};

/// The parts of a file.
#[derive(Debug)]
pub(super) struct Parts<'a> {
    /// JSON text.
    pub json: &'a [u8],
    /// Content of buffer 0 when it names no file.
    pub bin: Option<&'a [u8]>,
}

/// Splits a file into its parts; the first bytes tell the form.
pub(super) fn split(file: &[u8]) -> Result<Parts<'_>> {
    if file.starts_with(b"glTF") {
        return split_glb(file);
    }
    // A byte order mark is not allowed, but harmless.
    let json = file.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file);
    match json.trim_ascii_start().first() {
        Some(b'{') => Ok(Parts { json, bin: None }),
        Some(_) => Err(invalid("not glTF: starts like neither GLB (\"glTF\") nor JSON (\"{\")")),
        None => Err(invalid("the file is empty")),
    }
}

fn split_glb(file: &[u8]) -> Result<Parts<'_>> {
    let (Some(version), Some(length)) = (u32_at(file, 4), u32_at(file, 8)) else {
        return Err(invalid("GLB: ends within the header"));
    };
    if version != 2 {
        return Err(Fault::Unsupported(format!("GLB version {version}")));
    }
    // Bytes after the stated length are allowed and ignored.
    let content = file
        .get(12..length as usize)
        .ok_or_else(|| invalid(format!("GLB: {length} bytes stated, {} present: the file is truncated", file.len())))?;
    let (kind, json, mut rest) = split_chunk(content)?;
    if kind != b"JSON" {
        return Err(invalid("GLB: the first chunk is not JSON"));
    }
    // The BIN chunk, if any, is the second; the format requires readers to ignore chunks of unknown kinds.
    let mut bin = None;
    while bin.is_none() && !rest.is_empty() {
        let (kind, data, behind) = split_chunk(rest)?;
        bin = (kind == b"BIN\0").then_some(data);
        rest = behind;
    }
    Ok(Parts { json, bin })
}

/// Kind and data of the first chunk, and what follows it.
fn split_chunk(bytes: &[u8]) -> Result<(&[u8], &[u8], &[u8])> {
    let cut = || invalid("GLB: ends within a chunk");
    let length = u32_at(bytes, 0).ok_or_else(cut)? as usize;
    let kind = bytes.get(4..8).ok_or_else(cut)?;
    let (data, rest) = bytes[8..].split_at_checked(length).ok_or_else(cut)?;
    Ok((kind, data, rest))
}

fn u32_at(bytes: &[u8], offset: usize) -> Option<u32> {
    let bytes = bytes.get(offset..offset + 4)?;
    Some(u32::from_le_bytes(bytes.try_into().expect("four bytes")))
}
