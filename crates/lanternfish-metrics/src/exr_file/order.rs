//! Sorts a file's attributes, so that equal content gives equal bytes. The exr crate writes custom attributes in the order of a
//! hash map, which differs between processes; the format allows any order.

/// Sorts the attributes of a single-part file by name, in place. A file that cannot be parsed stays unchanged.
pub(super) fn sort_attributes(file: &mut [u8]) {
    // Magic number and version.
    let Some(header) = file.get_mut(8..) else { return };
    let Some(mut attributes) = split(header) else { return };
    attributes.sort();
    let sorted = attributes.concat();
    header[..sorted.len()].copy_from_slice(&sorted);
}

/// The bytes of each attribute: name, 0, type, 0, size in 4 bytes (little-endian), value. The list ends with an empty name.
fn split(header: &[u8]) -> Option<Vec<&[u8]>> {
    let (mut attributes, mut rest) = (Vec::new(), header);
    while *rest.first()? != 0 {
        let name = rest.iter().position(|byte| *byte == 0)? + 1;
        let kind = rest[name..].iter().position(|byte| *byte == 0)? + 1;
        let size = rest.get(name + kind..)?.first_chunk::<4>()?;
        let end = (name + kind + 4).checked_add(u32::from_le_bytes(*size) as usize)?;
        let (attribute, after) = rest.split_at_checked(end)?;
        attributes.push(attribute);
        rest = after;
    }
    Some(attributes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_are_sorted_and_the_rest_stays() {
        let mut file = b"MAGIC!!!b\0int\0\x01\0\0\0Xa\0string\0\x02\0\0\0yz\0pixels".to_vec();
        sort_attributes(&mut file);
        assert_eq!(file, b"MAGIC!!!a\0string\0\x02\0\0\0yzb\0int\0\x01\0\0\0X\0pixels");
        for broken in [&b"MAGIC!!!b\0int\0\xff\0\0\0Xa"[..], b"MAGIC!!!b", b"MAGIC!!!b\0int\0\x01", b"MAG"] {
            let mut file = broken.to_vec();
            sort_attributes(&mut file);
            assert_eq!(file, broken);
        }
    }
}
