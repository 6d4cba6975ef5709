//! Accessors: typed arrays in buffers, in all forms of the format.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

use super::buffers::Buffers;
use super::draco::Decoded;
use super::fault::{Place, Result, invalid, item};
use super::schema::{Accessor, Root};

/// Limit of elements without data (all zero), which take no space in the file: 16 Mi over all reads of all
/// accessors.
pub(super) const MAX_ZERO_COUNT: usize = 1 << 24;

/// Reads accessors.
pub(super) struct Accessors<'a> {
    pub root: &'a Root<'a>,
    pub buffers: &'a Buffers<'a>,
    /// Number of elements without data read so far.
    zero_count: Arc<AtomicUsize>,
    /// Content of accessors that are compressed with their primitive.
    decoded: Option<&'a Decoded>,
}

/// Storage type of one number.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn new(code: u32) -> Result<Self> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return Err(invalid(format!("componentType {code} is not one of the format's"))),
        })
    }

    /// Size, bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// Stored elements, checked to be within their buffer.
pub(super) struct Elements<'a> {
    /// From the first byte of the first element to the last byte of the last one.
    pub bytes: &'a [u8],
    /// Distance between elements, bytes.
    pub stride: usize,
    pub component: Component,
    pub normalized: bool,
}

/// Where the numbers of an accessor are stored, and how.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Source<'a> {
    view: usize,
    /// Offset in the view, bytes, and number of elements.
    place: [usize; 2],
    component_type: u32,
    normalized: bool,
    shape: &'a str,
}

impl<'a> Accessors<'a> {
    pub fn new(root: &'a Root<'a>, buffers: &'a Buffers<'a>) -> Self {
        Self { root, buffers, zero_count: Arc::default(), decoded: None }
    }

    /// The same, with the content of accessors that are compressed with their primitive.
    pub fn with<'b>(&'b self, decoded: &'b Decoded) -> Accessors<'b> {
        let Self { root, buffers, .. } = *self;
        Accessors { root, buffers, zero_count: self.zero_count.clone(), decoded: Some(decoded) }
    }

    /// Equal for accessors of the same numbers. `None` for an accessor that is not stored as one range of bytes.
    pub fn source(&self, index: usize) -> Option<Source<'a>> {
        let accessor = self.root.accessors.get(index).filter(|accessor| accessor.sparse.is_none())?;
        let Accessor { byte_offset, component_type, normalized, count, shape, .. } = accessor;
        let view = self.buffers.first_view(accessor.buffer_view?);
        Some(Source {
            view,
            place: [*byte_offset, *count],
            component_type: *component_type,
            normalized: *normalized,
            shape,
        })
    }

    /// Elements of `N` numbers as floats; integers are scaled to 0..=1 or -1..=1 if the accessor is normalised.
    pub fn vectors<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>> {
        self.read(index, N, [0.0; N], |elements, out| elements.copy_floats(out))
    }

    /// Colours as RGBA; alpha is 1 if only RGB is stored.
    pub fn colors(&self, index: usize) -> Result<Vec<[f32; 4]>> {
        let accessor = item(&self.root.accessors, index, "accessors")?;
        if accessor.shape == "VEC3" {
            let rgb = self.vectors::<3>(index)?;
            Ok(rgb.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect())
        } else {
            self.vectors::<4>(index)
        }
    }

    /// Vertex indices, not yet checked against a vertex count. The primitive restart value is refused.
    pub fn indices(&self, index: usize) -> Result<Vec<u32>> {
        let accessor = item(&self.root.accessors, index, "accessors")?;
        let place = || format!("accessors[{index}]");
        let component = Component::new(accessor.component_type).place(place)?;
        let restart = match component {
            Component::U8 => u32::from(u8::MAX),
            Component::U16 => u32::from(u16::MAX),
            Component::U32 => u32::MAX,
            _ => return Err(invalid("indices must be unsigned integers")).place(place),
        };
        let indices = self.read(index, 1, 0, |elements, out| elements.copy_integers(out))?;
        if let Some(at) = indices.iter().position(|i| *i == restart) {
            return Err(invalid(format!("element {at} is {restart}, which would restart the primitive"))).place(place);
        }
        Ok(indices)
    }

    /// All elements of `size` components each, with sparse replacements. Elements without data are `zero`.
    fn read<T: Clone>(&self, index: usize, size: usize, zero: T, copy: impl Fn(&Elements, &mut [T])) -> Result<Vec<T>> {
        let accessor = item(&self.root.accessors, index, "accessors")?;
        let decoded =
            self.decoded.and_then(|decoded| decoded.get(&index)).map(|array| array.elements(size, accessor.count));
        let read = decoded.transpose().and_then(|decoded| self.read_checked(accessor, decoded, size, zero, copy));
        read.place(|| format!("accessors[{index}]"))
    }

    fn read_checked<T: Clone>(
        &self,
        accessor: &Accessor,
        decoded: Option<Elements>,
        size: usize,
        zero: T,
        copy: impl Fn(&Elements, &mut [T]),
    ) -> Result<Vec<T>> {
        let shape = match size {
            16 => "MAT4",
            _ => ["SCALAR", "VEC2", "VEC3", "VEC4"][size - 1],
        };
        if accessor.shape != shape {
            return Err(invalid(format!("type {} where {shape} is expected", accessor.shape)));
        }
        let component = Component::new(accessor.component_type)?;
        let normalized = accessor.normalized;
        let mut elements = Vec::new();
        if let Some(decoded) = decoded {
            elements.resize(accessor.count, zero.clone());
            copy(&Elements { normalized, ..decoded }, &mut elements);
        } else if let Some(view) = accessor.buffer_view {
            let stored = self.locate(view, accessor.byte_offset, accessor.count, size, component, true)?;
            elements.resize(accessor.count, zero.clone());
            copy(&Elements { normalized, ..stored }, &mut elements);
        } else if accessor.count <= MAX_ZERO_COUNT
            && self.zero_count.fetch_add(accessor.count, Relaxed) + accessor.count <= MAX_ZERO_COUNT
        {
            elements.resize(accessor.count, zero.clone());
        } else {
            let count = accessor.count;
            return Err(invalid(format!(
                "{count} elements without a bufferView, or more than {MAX_ZERO_COUNT} in all"
            )));
        }
        if let Some(sparse) = &accessor.sparse {
            if sparse.count > accessor.count {
                return Err(invalid(format!("sparse: {} of {} elements", sparse.count, accessor.count)));
            }
            let (indices, values) = (&sparse.indices, &sparse.values);
            let index_component = Component::new(indices.component_type)?;
            let stored =
                self.locate(indices.buffer_view, indices.byte_offset, sparse.count, 1, index_component, false)?;
            let mut targets = vec![0; sparse.count];
            stored.copy_integers(&mut targets);
            let stored = self.locate(values.buffer_view, values.byte_offset, sparse.count, size, component, false)?;
            let mut replacements = vec![zero; sparse.count];
            copy(&Elements { normalized, ..stored }, &mut replacements);
            for (target, value) in targets.into_iter().zip(replacements) {
                let count = accessor.count;
                *elements
                    .get_mut(target as usize)
                    .ok_or_else(|| invalid(format!("sparse: element {target} of {count}")))? = value;
            }
        }
        Ok(elements)
    }

    /// Finds `count` elements of `size` components from `offset` in a buffer view.
    fn locate(
        &self,
        view: usize,
        offset: usize,
        count: usize,
        size: usize,
        component: Component,
        may_stride: bool,
    ) -> Result<Elements<'_>> {
        let (view, bytes) = self.buffers.view(view)?;
        let element = size * component.size();
        let stride = view.byte_stride.filter(|_| may_stride).unwrap_or(element);
        if stride < element {
            return Err(invalid(format!("byteStride {stride}, elements of {element} bytes")));
        }
        // From the first byte of the first element to the last byte of the last one; no padding follows it.
        let length = match count.checked_sub(1) {
            Some(steps) => steps.checked_mul(stride).and_then(|bytes| bytes.checked_add(element)),
            None => Some(0),
        };
        let end = length.and_then(|length| offset.checked_add(length)).filter(|end| *end <= bytes.len());
        let Some(end) = end else {
            let have = bytes.len();
            return Err(invalid(format!(
                "{count} elements of {element} bytes, {stride} apart, from {offset} exceed the bufferView of {have} bytes"
            )));
        };
        let bytes = if count == 0 { &[] } else { &bytes[offset..end] };
        Ok(Elements { bytes, stride, component, normalized: false })
    }
}

impl Elements<'_> {
    /// Converts all elements to floats; `out` is as long as the list of elements.
    fn copy_floats<const N: usize>(&self, out: &mut [[f32; N]]) {
        match (self.component, self.normalized) {
            (Component::F32, _) => self.copy(out, f32::from_le_bytes),
            (Component::U8, false) => self.copy(out, |[b]| f32::from(b)),
            (Component::U8, true) => self.copy(out, |[b]| f32::from(b) / 255.0),
            (Component::I8, false) => self.copy(out, |b| f32::from(i8::from_le_bytes(b))),
            (Component::I8, true) => self.copy(out, |b| (f32::from(i8::from_le_bytes(b)) / 127.0).max(-1.0)),
            (Component::U16, false) => self.copy(out, |b| f32::from(u16::from_le_bytes(b))),
            (Component::U16, true) => self.copy(out, |b| f32::from(u16::from_le_bytes(b)) / 65_535.0),
            (Component::I16, false) => self.copy(out, |b| f32::from(i16::from_le_bytes(b))),
            (Component::I16, true) => self.copy(out, |b| (f32::from(i16::from_le_bytes(b)) / 32_767.0).max(-1.0)),
            (Component::U32, _) => self.copy(out, |b| u32::from_le_bytes(b) as f32),
        }
    }

    fn copy<const N: usize, const B: usize>(&self, out: &mut [[f32; N]], convert: impl Fn([u8; B]) -> f32) {
        for (i, element) in out.iter_mut().enumerate() {
            let bytes = &self.bytes[i * self.stride..][..N * B];
            let (components, _) = bytes.as_chunks::<B>();
            *element = std::array::from_fn(|c| convert(components[c]));
        }
    }

    /// Copies scalars of an unsigned type. Other types are a caller's error and give zero.
    fn copy_integers(&self, out: &mut [u32]) {
        let starts = |i: usize| &self.bytes[i * self.stride..];
        for (i, value) in out.iter_mut().enumerate() {
            *value = match (self.component, starts(i)) {
                (Component::U8, [a, ..]) => u32::from(*a),
                (Component::U16, [a, b, ..]) => u32::from(u16::from_le_bytes([*a, *b])),
                (Component::U32, [a, b, c, d, ..]) => u32::from_le_bytes([*a, *b, *c, *d]),
                _ => 0,
            };
        }
    }
}
