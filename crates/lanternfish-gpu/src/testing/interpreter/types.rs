//! Types in memory.

use naga::{ArraySize, Expression, Handle, Scalar, TypeInner, VectorSize, proc::Alignment};

use super::{Call, Machine, Pointer, Value};

impl<'a> Machine<'a> {
    fn inner(&self, ty: Handle<naga::Type>) -> &'a TypeInner {
        &self.shader.module.types[ty].inner
    }

    /// The type of an expression.
    pub(super) fn type_of(&self, call: &Call<'a>, expression: Handle<Expression>) -> &'a TypeInner {
        call.info[expression].ty.inner_with(&self.shader.module.types)
    }

    /// The type of what an expression points to.
    pub(super) fn pointee(&self, call: &Call<'a>, pointer: Handle<Expression>) -> TypeInner {
        match self.type_of(call, pointer) {
            TypeInner::Pointer { base, .. } => self.inner(*base).clone(),
            TypeInner::ValuePointer { size: Some(size), scalar, .. } => {
                TypeInner::Vector { size: *size, scalar: *scalar }
            }
            TypeInner::ValuePointer { size: None, scalar, .. } => TypeInner::Scalar(*scalar),
            other => panic!("{other:?} is no pointer"),
        }
    }

    /// Byte offset of an element of a composite. Checks `index` against the number of elements.
    pub(super) fn element_offset(&self, ty: &TypeInner, index: usize) -> usize {
        let (stride, count) = match ty {
            TypeInner::Vector { size, scalar } => (usize::from(scalar.width), Some(*size as usize)),
            TypeInner::Matrix { columns, rows, scalar } => (column_stride(*rows, *scalar), Some(*columns as usize)),
            TypeInner::Array { size, stride, .. } => (*stride as usize, constant(*size)),
            TypeInner::Struct { members, .. } => return members[index].offset as usize,
            other => panic!("{other:?} has no elements"),
        };
        assert!(count.is_none_or(|count| index < count), "index {index} of {count:?} elements");
        index * stride
    }

    /// Number of scalars of a type.
    pub(super) fn count(&self, ty: &TypeInner) -> usize {
        match ty {
            TypeInner::Scalar(_) | TypeInner::Atomic(_) => 1,
            TypeInner::Vector { size, .. } => *size as usize,
            TypeInner::Matrix { columns, rows, .. } => *columns as usize * *rows as usize,
            TypeInner::Array { base, size, .. } => {
                self.count(self.inner(*base)) * constant(*size).expect("a value has a size")
            }
            TypeInner::Struct { members, .. } => members.iter().map(|member| self.count(self.inner(member.ty))).sum(),
            other => panic!("{other:?} is not supported"),
        }
    }

    /// Range of the scalars of an element of a composite value.
    pub(super) fn element_scalars(&self, ty: &TypeInner, index: usize) -> std::ops::Range<usize> {
        let of_size = |size| index * size..(index + 1) * size;
        match ty {
            TypeInner::Vector { .. } => of_size(1),
            TypeInner::Matrix { rows, .. } => of_size(*rows as usize),
            TypeInner::Array { base, .. } => of_size(self.count(self.inner(*base))),
            TypeInner::Struct { members, .. } => {
                let count = |member: &naga::StructMember| self.count(self.inner(member.ty));
                let first = members[..index].iter().map(count).sum();
                first..first + count(&members[index])
            }
            other => panic!("{other:?} has no elements"),
        }
    }

    /// Calls `visit` with the byte offset and the width of each scalar.
    fn each_scalar(&self, ty: &TypeInner, offset: usize, visit: &mut dyn FnMut(usize, usize)) {
        match ty {
            TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => visit(offset, usize::from(scalar.width)),
            TypeInner::Vector { size, scalar } => {
                let width = usize::from(scalar.width);
                (0..*size as usize).for_each(|i| visit(offset + i * width, width));
            }
            TypeInner::Matrix { columns, rows, scalar } => {
                let column = TypeInner::Vector { size: *rows, scalar: *scalar };
                let stride = column_stride(*rows, *scalar);
                (0..*columns as usize).for_each(|i| self.each_scalar(&column, offset + i * stride, visit));
            }
            TypeInner::Array { base, size, stride } => {
                let count = constant(*size).expect("a value has a size");
                (0..count).for_each(|i| self.each_scalar(self.inner(*base), offset + i * *stride as usize, visit));
            }
            TypeInner::Struct { members, .. } => {
                for member in members {
                    self.each_scalar(self.inner(member.ty), offset + member.offset as usize, visit);
                }
            }
            other => panic!("{other:?} is not supported"),
        }
    }

    pub(super) fn load(&self, ty: &TypeInner, at: Pointer) -> Value {
        let memory = &self.memories[at.memory];
        let mut words = Vec::new();
        self.each_scalar(ty, at.offset, &mut |offset, width| {
            let mut word = [0; 4];
            word[..width].copy_from_slice(&memory[offset..offset + width]);
            words.push(u32::from_le_bytes(word));
        });
        words.into_iter().collect()
    }

    pub(super) fn store(&mut self, ty: &TypeInner, at: Pointer, words: &[u32]) {
        let mut memory = std::mem::take(&mut self.memories[at.memory]);
        let mut words = words.iter();
        self.each_scalar(ty, at.offset, &mut |offset, width| {
            let word = words.next().expect("as many scalars as the type has");
            memory[offset..offset + width].copy_from_slice(&word.to_le_bytes()[..width]);
        });
        self.memories[at.memory] = memory;
    }

    /// Number of elements of a runtime-sized array, which reaches to the end of its buffer.
    pub(super) fn array_length(&self, ty: &TypeInner, at: Pointer) -> u32 {
        let TypeInner::Array { stride, .. } = ty else { panic!("{ty:?} is no array") };
        ((self.memories[at.memory].len() - at.offset) / *stride as usize) as u32
    }
}

fn column_stride(rows: VectorSize, scalar: Scalar) -> usize {
    Alignment::from(rows).round_up(1) as usize * usize::from(scalar.width)
}

fn constant(size: ArraySize) -> Option<usize> {
    match size {
        ArraySize::Constant(count) => Some(count.get() as usize),
        ArraySize::Dynamic => None,
        ArraySize::Pending(_) => panic!("overrides are not supported"),
    }
}
