//! Storage of fragments, from a builder's output to sorted lists.

mod linear_array;
mod linked_list;

use lanternfish::RenderError;
use lanternfish_gpu::{Bindings, Counted, Feature, Frame, gpu_constants, storage_buffer, uniform_buffer_of};

#[cfg(test)]
pub(crate) use self::linear_array::sort_feature;
use self::{linear_array::LinearArray, linked_list::LinkedLists};
use super::{
    images::Chunk,
    settings::{DeepImageSettings, DeepStore},
    shaders::{APPEND, DeepGrid, LINKED_LIST, PAYLOAD, SORTED_LINKED_LIST},
};

/// Features of `store/put_fragment.wesl`, with which every builder's pass ends.
pub(crate) fn put_features(settings: &DeepImageSettings) -> Vec<Feature> {
    let mut features = vec![match settings.store {
        DeepStore::LinearArray => APPEND,
        DeepStore::LinkedList => LINKED_LIST,
        DeepStore::SortedLinkedList => SORTED_LINKED_LIST,
    }];
    features.extend(settings.payload.then_some(PAYLOAD));
    features
}

/// Adds the passes that put every fragment of a chunk's images, once, into its list; the bindings are the source's and
/// the store's.
pub(crate) type Gather<'g> = dyn FnMut(&mut Frame<'_>, &DeepGrid, &Bindings<'_>) -> Result<(), RenderError> + 'g;

/// The source of a chunk's fragments.
pub(crate) struct Source<'s> {
    /// The scene, `deep_frames`, and the builder's own bindings.
    pub bindings: Bindings<'s>,
    /// The builder.
    pub gather: &'s mut Gather<'s>,
}

/// Capacity of the first chunk, fragments per texel; grown to the count.
const FIRST_GUESS: u64 = 4;

/// Slots for fragments, in the order of arrival.
struct Slots {
    depths: wgpu::Buffer,
    triangles: Option<wgpu::Buffer>,
    /// List of each, or link.
    links: wgpu::Buffer,
}

impl Slots {
    fn new(device: &wgpu::Device, capacity: u64, payload: bool) -> Result<Self, RenderError> {
        let buffer = |label| storage_buffer(device, label, 4 * capacity);
        Ok(Self {
            depths: buffer("deep_images/put_depths")?,
            triangles: payload.then(|| buffer("deep_images/put_triangles")).transpose()?,
            links: buffer("deep_images/put_links")?,
        })
    }

    fn bind<'b>(&'b self, bindings: &Bindings<'b>) -> Bindings<'b> {
        let bindings = bindings.clone().buffer("put_depths", &self.depths).buffer("put_links", &self.links);
        match &self.triangles {
            Some(triangles) => bindings.buffer("put_triangles", triangles),
            None => bindings,
        }
    }
}

/// The passes of a store.
#[derive(Debug)]
pub(crate) enum Store {
    /// Contiguous lists.
    LinearArray(Box<LinearArray>),
    /// Linked lists, sorted or not.
    Linked(LinkedLists),
}

impl Store {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        Ok(match settings.store {
            DeepStore::LinearArray => Self::LinearArray(Box::new(LinearArray::new(device, settings)?)),
            DeepStore::LinkedList | DeepStore::SortedLinkedList => Self::Linked(LinkedLists::new(device, settings)?),
        })
    }

    /// Builds the lists of a chunk.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        grid: DeepGrid,
        source: &mut Source<'_>,
    ) -> Result<Chunk, RenderError> {
        match self {
            Self::LinearArray(store) => store.record(frame, grid, source),
            Self::Linked(store) => store.record(frame, grid, source),
        }
    }
}

/// Capacity of the first chunk, fragments, before any are counted.
fn first_guess(limits: &wgpu::Limits, lists: u32) -> u64 {
    (FIRST_GUESS * u64::from(lists)).min(most_fragments(limits))
}

/// Name of the slot list of a chunk.
pub(super) const SLOTS: &str = "deep_images/fragments";

/// Number of taken slots of a chunk, in the first word of `words`; the second is the number of its images.
fn counted_slots(words: &wgpu::Buffer, guess: u64, limit: u64) -> Counted<'_> {
    Counted { list: SLOTS, words, starts: (words, 1), may_wrap: &|_| false, guess, limit }
}

/// With deferred readback: records in this frame, which reads a chunk of an earlier one, if the chunk's capacity held
/// all of its fragments.
pub(super) fn note_again(frame: &mut Frame<'_>, chunk: &Chunk) -> Result<(), RenderError> {
    if let Some(counted) = &chunk.counted {
        let limit = most_fragments(&frame.device.limits());
        frame.counted_capacity(&counted_slots(counted, 0, limit), chunk.grid.capacity.into())?;
    }
    Ok(())
}

/// An error if no binding holds this many fragments.
fn check_capacity(taken: u64, limit: u64) -> Result<(), RenderError> {
    if taken <= limit {
        return Ok(());
    }
    Err(RenderError::Overflow { list: SLOTS, needed: taken, limit, remedy: "use coarser deep images" })
}

gpu_constants! {
    /// Maximum slot count: further requests do not wrap to zero.
    pub(super) const MOST_SLOTS: u32 = 1 << 30;
}

fn most_fragments(limits: &wgpu::Limits) -> u64 {
    (limits.max_storage_buffer_binding_size / 4).min(MOST_SLOTS.into())
}

#[test]
fn the_first_guess_fits_a_binding() {
    let limits = wgpu::Limits { max_storage_buffer_binding_size: 4000, ..Default::default() };
    assert_eq!(first_guess(&limits, 10), 40);
    assert_eq!(first_guess(&limits, 250), 1000);
    // An image of 2,897 texels per side has more lists than a quarter of the entries of a 128 MiB binding.
    assert_eq!(first_guess(&limits, 251), 1000);
    assert_eq!(first_guess(&limits, u32::MAX), 1000);
    // The count is limited for any binding size.
    let limits = wgpu::Limits { max_storage_buffer_binding_size: 1 << 40, ..Default::default() };
    assert_eq!(most_fragments(&limits), u64::from(MOST_SLOTS));
}

/// The grid with this capacity, fragments, on the device.
fn with_capacity(grid: &mut DeepGrid, device: &wgpu::Device, capacity: u64) -> wgpu::Buffer {
    grid.capacity = capacity as u32;
    uniform_buffer_of(device, "deep_images/grid", grid)
}
