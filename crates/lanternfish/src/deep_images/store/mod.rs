//! Where the fragments of deep images are kept: what becomes of them once a builder has put them into lists.

mod linear_array;
mod linked_list;

use lanternfish_gpu::{Bindings, Frame, uniform_buffer_of};

use self::{linear_array::LinearArray, linked_list::LinkedLists};
use super::{Chunk, DeepGrid};
use crate::{
    error::RenderError,
    settings::{DeepImageSettings, DeepStore},
};

/// What is asked of a builder: to put every fragment of a chunk's images, once, into its list (`store/put_fragment.wesl`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Turn {
    /// It is counted only.
    Count,
    /// It is kept.
    Put,
}

/// One builder's pass for each turn that its store asks for.
#[derive(Debug)]
pub(crate) struct Turns<P> {
    count: Option<P>,
    put: P,
}

impl<P> Turns<P> {
    /// Compiles the passes: `compile` is given the features of `store/put_fragment.wesl`, and the pass's label.
    pub fn new(
        settings: &DeepImageSettings,
        compile: impl Fn(&[&str], &str) -> Result<P, RenderError>,
    ) -> Result<Self, RenderError> {
        let is_array = settings.store == DeepStore::LinearArray;
        let mut features = vec![match settings.store {
            DeepStore::LinearArray => "fill",
            DeepStore::LinkedList => "linked_list",
            DeepStore::SortedLinkedList => "sorted_linked_list",
        }];
        features.extend(settings.payload.then_some("payload"));
        Ok(Self {
            count: is_array.then(|| compile(&[], "deep_images/count")).transpose()?,
            put: compile(&features, "deep_images/fill")?,
        })
    }

    /// The pass for this turn.
    ///
    /// Panics when the store never asks for it.
    pub fn pass(&self, turn: Turn) -> &P {
        match turn {
            Turn::Count => self.count.as_ref().expect("linear arrays count, and compile the pass"),
            Turn::Put => &self.put,
        }
    }
}

/// Adds the passes of a turn; the bindings are the source's and the store's.
pub(crate) type Gather<'g> = dyn FnMut(&mut Frame<'_>, Turn, &DeepGrid, &Bindings<'_>) -> Result<(), RenderError> + 'g;

/// Where the fragments of a chunk come from.
pub(crate) struct Source<'s> {
    /// The scene, `deep_frames`, and the builder's own.
    pub bindings: Bindings<'s>,
    /// The builder.
    pub gather: &'s mut Gather<'s>,
}

/// The passes of a store.
#[derive(Debug)]
pub(crate) enum Store {
    /// Lists behind each other.
    LinearArray(Box<LinearArray>),
    /// Lists of links, sorted or not.
    Linked(LinkedLists),
}

impl Store {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        if !settings.store.holds(settings.depth) {
            return Err(RenderError::Together {
                setting: "a depth of deep images in 16 bits",
                needed: "the store linear_array",
            });
        }
        Ok(match settings.store {
            DeepStore::LinearArray => Self::LinearArray(Box::new(LinearArray::new(device, settings)?)),
            DeepStore::LinkedList | DeepStore::SortedLinkedList => Self::Linked(LinkedLists::new(device, settings)?),
        })
    }

    /// Builds the lists of a chunk. Also gives how many fragments were put into them.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        grid: DeepGrid,
        source: &mut Source<'_>,
    ) -> Result<(Chunk, u64), RenderError> {
        match self {
            Self::LinearArray(store) => store.record(frame, grid, source),
            Self::Linked(store) => store.record(frame, grid, source),
        }
    }
}

/// The grid with room for so many fragments, on the device.
fn with_capacity(device: &wgpu::Device, grid: &mut DeepGrid, capacity: u64) -> Result<wgpu::Buffer, RenderError> {
    let limit = device.limits().max_storage_buffer_binding_size / 4;
    if capacity > limit {
        return Err(RenderError::Overflow {
            list: "deep_images/fragments",
            needed: capacity,
            limit,
            remedy: "use fewer or coarser deep images, or less supersampling",
        });
    }
    grid.capacity = capacity as u32;
    Ok(uniform_buffer_of(device, "deep_images/grid", grid))
}
