//! `KHR_draco_mesh_compression`: primitives whose attributes and indices are compressed together.

use std::collections::BTreeMap;

use draco_core::{
    DataType, decode_limits::DecodeLimits, decoder_buffer::DecoderBuffer, geometry_attribute::PointAttribute,
    geometry_indices::PointIndex, mesh::Mesh, mesh_decoder::MeshDecoder,
};
use lanternfish_limits::caught;

use super::accessor::{Component, Elements};
use super::fault::{Place, Result, invalid, item};
use super::schema::{self, Root};

/// Upper bound of the memory of decoding, bytes per stated vertex and triangle corner, besides the attributes' values.
const BYTES_PER_CORNER: u64 = 64;
/// Upper bound of the size of one attribute's value, bytes: four numbers of 4 bytes.
const BYTES_PER_VALUE: u64 = 16;

/// The decoded content of the accessors of one primitive, by accessor.
pub(super) type Decoded = BTreeMap<usize, Array>;

/// Tightly packed elements.
pub(super) struct Array {
    bytes: Vec<u8>,
    component: Component,
    /// Components of an element.
    size: usize,
}

impl Array {
    /// The elements, of `size` components each, of which there have to be `count`.
    pub fn elements(&self, size: usize, count: usize) -> Result<Elements<'_>> {
        let stride = self.size * self.component.size();
        if (self.size, Some(self.bytes.len())) != (size, count.checked_mul(stride)) {
            let have = self.bytes.len() / stride.max(1);
            return Err(invalid(format!(
                "{count} elements of {size} components stated, {have} of {} compressed",
                self.size
            )));
        }
        Ok(Elements { bytes: &self.bytes, stride, component: self.component, normalized: false })
    }
}

/// Upper bound of the size of the values of the stated vertices, bytes.
fn bytes_of_values(draco: &schema::Draco, vertices: u64) -> u64 {
    vertices.saturating_mul(BYTES_PER_VALUE * draco.attributes.len() as u64)
}

/// Upper bound of the temporary memory of [`decode`], bytes, from the stated number of vertices and corners.
pub(super) fn need(draco: &schema::Draco, vertices: u64, corners: u64) -> u64 {
    // The values are stored twice: by the decoder, and by vertex.
    let values = bytes_of_values(draco, vertices).saturating_mul(2);
    values.saturating_add(BYTES_PER_CORNER.saturating_mul(corners.saturating_add(vertices)))
}

/// Decodes a primitive. `compressed`: the bytes of its buffer view. What the accessors state limits what is decoded.
pub(super) fn decode(
    root: &Root,
    source: &schema::Primitive,
    draco: &schema::Draco,
    compressed: &[u8],
) -> Result<Decoded> {
    let count = |index: &usize| -> Result<u64> { Ok(item(&root.accessors, *index, "accessors")?.count as u64) };
    let indices = source.indices.ok_or_else(|| invalid("a compressed primitive without indices"))?;
    let corners = count(&indices)?;
    let vertices = source.attributes.get("POSITION").map_or(Ok(0), count)?;
    let most = bytes_of_values(draco, vertices);
    let limits = DecodeLimits::default().with_max_faces(corners / 3).with_max_decoded_bytes(most);
    let mesh = caught(|| {
        let mut mesh = Mesh::new();
        let status = MeshDecoder::new().decode(&mut DecoderBuffer::new(compressed).with_limits(limits), &mut mesh);
        status.map(|()| mesh).map_err(|error| error.to_string())
    });
    let mesh = mesh.and_then(|result| result).map_err(|what| invalid(format!("compressed data: {what}")))?;
    let mut decoded = Decoded::new();
    let faces = mesh.faces().iter().flatten().flat_map(|point| point.0.to_le_bytes()).collect();
    decoded.insert(indices, Array { bytes: faces, component: Component::U32, size: 1 });
    for (name, unique_id) in &draco.attributes {
        let Some(accessor) = source.attributes.get(name) else { continue };
        let attribute = mesh.attribute_by_unique_id(*unique_id);
        let attribute = attribute.ok_or_else(|| invalid(format!("compressed data: no attribute {unique_id}")));
        let array = attribute.and_then(|attribute| array(attribute, mesh.num_points()));
        decoded.insert(*accessor, array.place(|| name.clone())?);
    }
    Ok(decoded)
}

/// The value of an attribute at each point.
fn array(attribute: &PointAttribute, points: usize) -> Result<Array> {
    let component = match attribute.data_type() {
        DataType::Int8 => Component::I8,
        DataType::Uint8 => Component::U8,
        DataType::Int16 => Component::I16,
        DataType::Uint16 => Component::U16,
        DataType::Uint32 => Component::U32,
        DataType::Float32 => Component::F32,
        other => return Err(invalid(format!("compressed data: {other:?} is not one of the format's types"))),
    };
    let size = usize::from(attribute.num_components());
    let element = size * component.size();
    let stride = usize::try_from(attribute.byte_stride()).unwrap_or(0).max(element);
    let values = attribute.buffer().data();
    let mut bytes = Vec::with_capacity(points * element);
    for point in 0..points {
        let index = attribute.mapped_index(PointIndex(point as u32)).0 as usize;
        let value = index.checked_mul(stride).and_then(|at| values.get(at..)?.get(..element));
        bytes.extend_from_slice(value.ok_or_else(|| invalid(format!("compressed data: no value of point {point}")))?);
    }
    Ok(Array { bytes, component, size })
}
