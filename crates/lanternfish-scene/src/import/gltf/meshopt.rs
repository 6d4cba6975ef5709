//! `EXT_meshopt_compression` and its successor `KHR_meshopt_compression`: compressed buffer views.

use lanternfish_limits::memory::Budget;

use super::fault::{Result, invalid};
use super::schema::CompressedView;

/// Upper bound of the compression ratio: the vertex codec (version 1) needs one byte per four bytes of a vertex, for
/// 256 identical vertices. A view that claims more is refused before memory is allocated.
const MAX_RATIO: usize = 1024;

/// Decodes a view. The first `count * byte_stride` bytes of the result are its content. The result has words, so that it is
/// aligned for every component type.
pub(super) fn decode(view: &CompressedView, compressed: &[u8], budget: &Budget) -> Result<Vec<u32>> {
    let (count, stride) = (view.count, view.byte_stride);
    let length = count.checked_mul(stride).filter(|length| length / MAX_RATIO <= compressed.len());
    let Some(length) = length else {
        let have = compressed.len();
        return Err(invalid(format!("{count} elements of {stride} bytes cannot be in {have} compressed bytes")));
    };
    if !is_sound(view) {
        let (mode, filter) = (&view.mode, &view.filter);
        return Err(invalid(format!("mode {mode}, filter {filter}: {count} elements of {stride} bytes cannot be")));
    }
    budget.take(length as u64, || "a compressed bufferView needs".to_owned())?;
    let mut words = vec![0u32; length.div_ceil(4)];
    let (to, from) = (words.as_mut_ptr().cast::<std::ffi::c_void>(), compressed.as_ptr());
    // SAFETY: `to` is valid for `count * stride` bytes, and the decoders write no more. `from` is valid for the length that
    // is passed, and the decoders check their reads. `is_sound` checks the preconditions on count and stride.
    let code = unsafe {
        match view.mode.as_str() {
            "ATTRIBUTES" => ::meshopt::ffi::meshopt_decodeVertexBuffer(to, count, stride, from, compressed.len()),
            "TRIANGLES" => ::meshopt::ffi::meshopt_decodeIndexBuffer(to, count, stride, from, compressed.len()),
            _ => ::meshopt::ffi::meshopt_decodeIndexSequence(to, count, stride, from, compressed.len()),
        }
    };
    if code != 0 {
        return Err(invalid(format!("its {} compressed bytes are damaged", compressed.len())));
    }
    unfilter(view, &mut words);
    Ok(words)
}

/// True if the extension allows this combination of mode, filter, stride and count.
fn is_sound(view: &CompressedView) -> bool {
    let stride = view.byte_stride;
    let mode = match view.mode.as_str() {
        "ATTRIBUTES" => stride.is_multiple_of(4) && (4..=256).contains(&stride),
        "TRIANGLES" => matches!(stride, 2 | 4) && view.count.is_multiple_of(3),
        "INDICES" => matches!(stride, 2 | 4),
        _ => false,
    };
    let filter = match view.filter.as_str() {
        "NONE" => true,
        "OCTAHEDRAL" | "COLOR" => matches!(stride, 4 | 8),
        "QUATERNION" => stride == 8,
        "EXPONENTIAL" => true,
        _ => false,
    };
    mode && filter && (view.filter == "NONE" || view.mode == "ATTRIBUTES")
}

/// Reverts the filter that was applied to the elements before compression.
fn unfilter(view: &CompressedView, words: &mut [u32]) {
    match (view.filter.as_str(), view.byte_stride) {
        ("OCTAHEDRAL", 4) => ::meshopt::decode_filter_oct::<i8>(bytemuck::cast_slice_mut(words)),
        ("OCTAHEDRAL", _) => ::meshopt::decode_filter_oct::<i16>(bytemuck::cast_slice_mut(words)),
        ("COLOR", 4) => ::meshopt::decode_filter_color::<u8>(bytemuck::cast_slice_mut(words)),
        ("COLOR", _) => ::meshopt::decode_filter_color::<u16>(bytemuck::cast_slice_mut(words)),
        ("QUATERNION", _) => ::meshopt::decode_filter_quat(bytemuck::cast_slice_mut(words)),
        ("EXPONENTIAL", _) => ::meshopt::decode_filter_exp::<1>(bytemuck::cast_slice_mut(words)),
        _ => {}
    }
}
