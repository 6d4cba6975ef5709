//! NPZ files: arrays that `numpy.load` reads, stored in a ZIP archive without compression.

use std::path::Path;

use lanternfish_metrics::write_aside;

use crate::error::CliError;

/// Values of an image, rows from the top, those of a pixel side by side.
pub enum Array {
    Floats(Vec<f32>),
    Identities(Vec<u32>),
}

/// Writes arrays by name, as (height, width) or (height, width, channels), and `names` as `names.json`. Equal content
/// gives equal bytes.
pub fn write(path: &Path, size: [u32; 2], arrays: &[(&str, Array)], names: Option<&str>) -> Result<(), CliError> {
    let failed = |what: &dyn std::fmt::Display, hint: &str| CliError::new(format!("{}: {what}", path.display()), hint);
    let [width, height] = size;
    let mut files: Vec<(String, Vec<u8>, &[u8])> = Vec::new();
    for (name, array) in arrays {
        let (kind, count, bytes): (_, _, &[u8]) = match array {
            Array::Floats(values) => ("<f4", values.len(), bytemuck::cast_slice(values)),
            Array::Identities(values) => ("<u4", values.len(), bytemuck::cast_slice(values)),
        };
        let shape = match count / (width as usize * height as usize) {
            1 => format!("({height}, {width})"),
            channels => format!("({height}, {width}, {channels})"),
        };
        files.push((format!("{name}.npy"), header(kind, &shape), bytes));
    }
    files.extend(names.map(|names| ("names.json".to_owned(), Vec::new(), names.as_bytes())));
    let total: usize =
        files.iter().map(|(name, header, bytes)| 2 * (name.len() + 46) + header.len() + bytes.len()).sum();
    if u32::try_from(total).is_err() {
        return Err(failed(&"more than 4 GiB, which an .npz file cannot hold", "choose .exr, or a smaller --size"));
    }
    write_aside(path, |file| {
        let (mut directory, mut offset) = (Vec::new(), 0u32);
        for (name, header, bytes) in &files {
            // Version 2.0, no flags, stored, 1 January 1980.
            let mut about = [20u16, 0, 0, 0, 33].map(u16::to_le_bytes).concat();
            let size = (header.len() + bytes.len()) as u32;
            about.extend([checksum(&[header, bytes]), size, size].map(u32::to_le_bytes).concat());
            about.extend([name.len() as u16, 0].map(u16::to_le_bytes).concat());
            for part in [&b"PK\x03\x04"[..], &about[..], name.as_bytes(), header, bytes] {
                file.write_all(part)?;
            }
            directory.extend(
                [&b"PK\x01\x02\x14\x00"[..], &about[..], &[0; 10], &offset.to_le_bytes(), name.as_bytes()].concat(),
            );
            offset += (4 + about.len() + name.len()) as u32 + size;
        }
        let count = (files.len() as u16).to_le_bytes();
        let ends = [directory.len() as u32, offset].map(u32::to_le_bytes).concat();
        for part in [&directory[..], b"PK\x05\x06\0\0\0\0", &count, &count, &ends, &[0; 2]] {
            file.write_all(part)?;
        }
        Ok::<(), std::io::Error>(())
    })
    .map_err(|error| failed(&error, "check that the disk has free space"))
}

/// True if a file has an image of this size, and arrays of these names. Files are written completely or not at all.
pub fn holds(path: &Path, [width, height]: [usize; 2], names: impl Iterator<Item = &'static str>) -> bool {
    let Ok(bytes) = std::fs::read(path) else { return false };
    let has = |part: &[u8], text: String| part.windows(text.len()).any(|window| window == text.as_bytes());
    // The directory at the end has 61 bytes and less of text for each array.
    let (start, end) = (&bytes[..bytes.len().min(256)], &bytes[bytes.len().saturating_sub(2048)..]);
    has(start, "image.npy".to_owned()) && has(start, format!("({height}, {width}, 3)")) && { names }
        .all(|name| has(end, format!("{name}.npy")))
}

/// The header of an array file, version 1.0.
fn header(kind: &str, shape: &str) -> Vec<u8> {
    let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    // With the ten bytes before it, a multiple of 64.
    let length = (text.len() + 11).next_multiple_of(64) - 10;
    let text = format!("{text:<width$}\n", width = length - 1);
    [&b"\x93NUMPY\x01\x00"[..], &(length as u16).to_le_bytes(), text.as_bytes()].concat()
}

/// CRC-32 of the parts together, as ZIP has it.
fn checksum(parts: &[&[u8]]) -> u32 {
    let table: [u32; 256] = std::array::from_fn(|byte| {
        (0..8).fold(byte as u32, |crc, _| if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 })
    });
    !parts.iter().copied().flatten().fold(!0, |crc, byte| table[((crc ^ u32::from(*byte)) & 255) as usize] ^ (crc >> 8))
}

#[cfg(test)]
#[test]
fn checksums_and_headers_are_those_of_the_formats() {
    // The check value of the catalogue of checksums.
    assert_eq!(checksum(&[b"1234", b"56789"]), 0xcbf4_3926);
    let header = header("<f4", "(720, 1280, 3)");
    assert_eq!((header.len() % 64, header.last(), &header[..8]), (0, Some(&b'\n'), &b"\x93NUMPY\x01\x00"[..]));
    assert_eq!(usize::from(u16::from_le_bytes([header[8], header[9]])), header.len() - 10);
}
