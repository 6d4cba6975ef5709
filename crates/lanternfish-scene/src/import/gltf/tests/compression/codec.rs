//! meshoptimizer's codec: encoders for tests, and what the original library, in C++, encodes and decodes.

use bytemuck::{NoUninit, cast_slice};
use meshoptimizer::{
    encode_index_buffer, encode_index_buffer_bound, encode_index_sequence, encode_index_sequence_bound,
    encode_vertex_buffer, encode_vertex_buffer_bound,
};
use serde_json::json;

use super::super::super::{meshopt::decode, schema::CompressedView};

/// Vertices as a stream of mode `ATTRIBUTES`.
pub(super) fn vertices_encoded<T: NoUninit>(vertices: &[T]) -> Vec<u8> {
    let most = encode_vertex_buffer_bound(vertices.len(), size_of::<T>()).expect("a valid size");
    encoded(most, |to| encode_vertex_buffer(to, most, cast_slice(vertices), vertices.len(), size_of::<T>()))
}

/// Triangles over this number of vertices as a stream of mode `TRIANGLES`.
pub(super) fn indices_encoded(indices: &[u32], vertices: usize) -> Vec<u8> {
    let most = encode_index_buffer_bound(indices.len(), vertices).expect("whole triangles");
    encoded(most, |to| encode_index_buffer(to, most, indices, indices.len()))
}

/// Indices over this number of vertices as a stream of mode `INDICES`.
pub(super) fn sequence_encoded(indices: &[u32], vertices: usize) -> Vec<u8> {
    let most = encode_index_sequence_bound(indices.len(), vertices);
    encoded(most, |to| encode_index_sequence(to, most, indices, indices.len()))
}

fn encoded(most: usize, encode: impl FnOnce(&mut [u8]) -> meshoptimizer::Result<usize>) -> Vec<u8> {
    let mut bytes = vec![0; most];
    let length = encode(&mut bytes).expect("it fits");
    bytes.truncate(length);
    bytes
}

fn hex(text: &str) -> Vec<u8> {
    let digits = text.as_bytes().as_chunks::<2>().0;
    digits.iter().map(|pair| u8::from_str_radix(str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

fn decoded(mode: &str, filter: &str, stride: usize, count: usize, stream: &[u8]) -> Vec<u8> {
    let length = stream.len();
    let view = json!({
        "buffer": 0, "byteLength": length, "byteStride": stride, "count": count, "mode": mode, "filter": filter,
    });
    let view: CompressedView = serde_json::from_value(view).unwrap();
    let budget = lanternfish_limits::memory::Budget::of(1 << 20);
    let Ok(words) = decode(&view, stream, &budget) else { panic!("{mode}, {filter}: the stream is refused") };
    cast_slice(&words)[..stride * count].to_vec()
}

/// Streams that version 0.7 of the crate `meshopt` (meshoptimizer in C++) has encoded.
#[test]
fn streams_of_the_original_library_are_decoded() {
    let vertex = |i: u32| [(i * i * 7) as u16, (1000 + i * 3) as u16, (65535 - i) as u16, (i % 3) as u16];
    let vertices: Vec<[u16; 4]> = (0..20).map(vertex).collect();
    assert_eq!(decoded("ATTRIBUTES", "NONE", 8, 20, &hex(VERTICES)), cast_slice::<_, u8>(&vertices));
    // The codec of triangles rotates the corners of the third.
    let triangles = [0, 1, 2, 2, 1, 3, 0, 2, 4, 7, 8, 4];
    let sequence = [0, 1, 2, 2, 1, 3, 4, 0, 2, 7, 8, 4];
    for (mode, text, expected) in [("TRIANGLES", INDICES, triangles), ("INDICES", SEQUENCE, sequence)] {
        let narrow = decoded(mode, "NONE", 2, 12, &hex(text));
        let wide = decoded(mode, "NONE", 4, 12, &hex(text));
        let narrow = narrow.as_chunks::<2>().0.iter().map(|bytes| u16::from_le_bytes(*bytes).into());
        let wide: Vec<u32> = wide.as_chunks::<4>().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
        assert_eq!(narrow.collect::<Vec<u32>>(), wide, "{mode}");
        assert_eq!(wide, expected, "{mode}");
    }
    for (filter, stride, filtered, expected) in FILTERED {
        let (count, bytes) = (expected.len() / 2 / stride, hex(filtered));
        let stream = match stride {
            4 => vertices_encoded(bytes.as_chunks::<4>().0),
            8 => vertices_encoded(bytes.as_chunks::<8>().0),
            _ => vertices_encoded(bytes.as_chunks::<16>().0),
        };
        assert_eq!(decoded("ATTRIBUTES", filter, stride, count, &stream), hex(expected), "{filter}, {stride}");
    }
}

const VERTICES: &str = "a19799000e2a46627e9ab6d2ee0a26425e7a96b2ceea060500000555560000000206666666666666660f0006060606051555555555000000060223223223223223ae0000000300000000000000000000000000000000e803ffff00000100";
const INDICES: &str = "e1f01020fff10e02007687566778a9866589689801690000";
const SEQUENCE: &str = "d1000404000208040e0814040e00000000";

/// Filter, bytes of an element, and elements before and after the original library has reverted the filter.
const FILTERED: [(&str, usize, &str, &str); 6] = [
    ("OCTAHEDRAL", 4, "36007f004f727f00d8187f00a1a37f0016d67f00", "4c006600144a9b00bf276600c8cb9b0023bc6500"),
    (
        "OCTAHEDRAL",
        8,
        "6d030000ff070000fe042907ff07000078fd8601ff07000002fa1efaff07000065015ffdff070000",
        "c54c00006b6600009814004a9d9900003abe96276b6600003cc81fcba5990000f62336bc71660000",
    ),
    (
        "QUATERNION",
        8,
        "000000000000ff07070751050000fe076efd9c060000fe071afd000022fcff07010300000104ff07",
        "000000000000ff7f2d3c000038508b4fd04a0000b363e8e231df00003ad4b87300220000522dc672",
    ),
    (
        "EXPONENTIAL",
        16,
        "662600f2000000f2333300f2000000f2162900f0002500f2cdccfff2000000f218dffff2972700f1333300f2000000f240c8fff12ecbfff1cdccfff2000000f2fb2300f113defff2333300f2000000f2",
        "0098193f0000000000cc4c3f000000000058243e0000143f00cc4cbf0000000000a003bf005c9e3e00cc4c3f000000000000dfbe0048d3be00cc4cbf0000000000ec8f3e00b407bf00cc4c3f00000000",
    ),
    ("COLOR", 4, "6400fa807803f9858c06f88aa009f78fb40cf694", "6a5e6a0082717c0b9a848e14b297a01fcaaab228"),
    (
        "COLOR",
        8,
        "10270000e8fd0080e02e2c01e7fdf481b0365802e6fde883803e8403e5fddc855046b004e4fdd087",
        "2829f824282900002532c72ccd2fe803223b96347236d0071f44653c173db80b1c4d3444bc43a00f",
    ),
];
