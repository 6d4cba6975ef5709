//! `EXT_meshopt_compression` and its successor `KHR_meshopt_compression`: compressed buffer views.

use lanternfish_limits::memory::Budget;
use meshoptimizer::{
    decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat, decode_index_buffer,
    decode_index_sequence, decode_vertex_buffer,
};

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
    let to = &mut bytemuck::cast_slice_mut(&mut words)[..length];
    let decoded = match (view.mode.as_str(), stride) {
        ("ATTRIBUTES", _) => decode_vertex_buffer(to, count, stride, compressed, compressed.len()),
        ("TRIANGLES", 2) => {
            decode_index_buffer::<u16>(bytemuck::cast_slice_mut(to), count, compressed, compressed.len())
        }
        ("TRIANGLES", _) => {
            decode_index_buffer::<u32>(bytemuck::cast_slice_mut(to), count, compressed, compressed.len())
        }
        (_, 2) => decode_index_sequence::<u16>(bytemuck::cast_slice_mut(to), count, compressed, compressed.len()),
        _ => decode_index_sequence::<u32>(bytemuck::cast_slice_mut(to), count, compressed, compressed.len()),
    };
    let unfiltered = decoded.and_then(|()| match view.filter.as_str() {
        "OCTAHEDRAL" => decode_filter_oct(to, count, stride),
        "COLOR" => decode_filter_color(to, count, stride),
        "QUATERNION" => decode_filter_quat(to, count, stride),
        "EXPONENTIAL" => decode_filter_exp(to, count, stride),
        _ => Ok(()),
    });
    unfiltered.map_err(|_| invalid(format!("its {} compressed bytes are damaged", compressed.len())))?;
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
