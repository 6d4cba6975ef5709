//! Capacity of lists whose length only the device knows.
//!
//! - [`Growth::Blocking`]: the device counts a list, the host reads the count and allocates, and the device writes the list. Every frame is
//!   complete.
//! - [`Growth::Deferred`]: no frame waits. A list's capacity is 3/2 of the largest count of recent frames; the counts of this frame are read
//!   when they arrive. A frame in which a list overflows marks itself as incomplete and is not shown.

mod capacity;
mod staging;
mod state;
#[cfg(all(test, feature = "testing"))]
mod tests;

pub(crate) use self::{staging::MOST_IN_FLIGHT, state::CapacityPolicy};
#[cfg(test)]
use crate::primitives::SHADERS;
use crate::{Bindings, Frame, GpuError, gpu_struct};

gpu_struct! {
    /// Parameters of the overflow check of a list.
    struct NoteParameters {
        /// Index of the list in the frame, from 0.
        list: u32,
        /// Capacity, elements.
        capacity: u32,
    }
}

/// When the capacity of lists grows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Growth {
    /// In the frame that needs it, with a blocking readback.
    #[default]
    Blocking,
    /// In a later frame, with a deferred readback.
    Deferred,
}

/// A list whose length the device has counted.
#[derive(Clone, Copy)]
pub struct Counted<'a> {
    /// Its name. Lists of the same name have the same capacity.
    pub list: &'static str,
    /// Four words: number of elements, and three more values for the host.
    pub words: &'a wgpu::Buffer,
    /// Starts of its parts, and their number. The last one is the end of the last part.
    pub starts: (&'a wgpu::Buffer, usize),
    /// True if, given these words, the number of elements may have wrapped at 2³². The host then adds up the parts.
    pub may_wrap: &'a dyn Fn(&[u32; LIST_WORDS]) -> bool,
    /// Initial capacity, elements.
    pub guess: u64,
    /// Maximum capacity, elements.
    pub limit: u64,
}

/// The capacity of a list.
#[derive(Clone, Copy, Debug)]
pub struct ListCapacity {
    /// Capacity, elements: at most the limit.
    pub capacity: u64,
    /// Number of elements, possibly above the limit: of this frame, or with deferred readback of the last frame that has arrived.
    pub elements: u64,
    /// The words of the same frame.
    pub words: [u32; LIST_WORDS],
}

/// Numbers of frames with deferred readback that have arrived.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arrived {
    /// All frames.
    pub frames: u64,
    /// Incomplete frames.
    pub held: u64,
}

/// The outcome of a frame with deferred readback.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// [`Frame::number`].
    pub frame: u64,
    /// True if no list overflowed. An incomplete frame has drawn nothing.
    pub is_complete: bool,
    /// True if the readback failed, most likely because the device is lost.
    pub is_lost: bool,
    /// Its lists by name, each with its number of elements.
    pub lists: Vec<(&'static str, u64)>,
    /// Names of the lists whose capacity changes.
    pub resized: Vec<&'static str>,
}

/// Words per list in the buffer of the capacity policy. `FIRST_LIST` words come before the first list; see `note.wesl`.
pub(crate) const LIST_WORDS: usize = 4;
const FIRST_LIST: usize = 8;
/// Index of the word with the number of accumulated frames.
const FRAMES: usize = 4;
/// Maximum number of lists in a frame.
const MOST_LISTS: usize = 1022;
const CAPACITY_POLICY_BYTES: u64 = 4 * (FIRST_LIST + LIST_WORDS * MOST_LISTS) as u64;

impl Frame<'_> {
    /// When the capacity of this frame's lists grows.
    #[doc(hidden)]
    pub fn growth(&self) -> Growth {
        self.pool.capacity_policy.growth()
    }

    /// Capacity for a list that the commands so far have counted. With deferred readback the frame checks the capacity when it runs. The
    /// caller must refuse more elements than the limit.
    #[doc(hidden)]
    pub fn capacity_for(&mut self, counted: &Counted<'_>) -> Result<ListCapacity, GpuError> {
        let capacity = self.planned_capacity(counted.list, counted.guess, counted.limit);
        self.counted_capacity(counted, capacity)
    }

    /// Capacity, elements, for a list that is counted while it is written, from earlier frames. Call [`Self::counted_capacity`] after the
    /// write to check it.
    #[doc(hidden)]
    pub fn planned_capacity(&mut self, list: &'static str, guess: u64, limit: u64) -> u64 {
        let growth = self.growth();
        let list = self.pool.capacity_policy.lists.entry(list).or_default();
        match growth {
            Growth::Blocking => list.before_counting(guess, limit),
            Growth::Deferred => list.planned(guess, limit),
        }
    }

    /// The words of the longest list of this name in the last frame that has arrived. Zeros with blocking readback.
    #[doc(hidden)]
    pub fn last_counted(&self, list: &'static str) -> [u32; LIST_WORDS] {
        let capacity_policy = &self.pool.capacity_policy;
        let history = capacity_policy.lists.get(list).filter(|_| capacity_policy.growth() == Growth::Deferred);
        history.map_or([0; LIST_WORDS], |history| history.last)
    }

    /// Checks `capacity` (elements) against the length of a list that the commands so far have counted. With blocking readback the caller
    /// must write the list again if it exceeds `capacity`, with the capacity returned here. With deferred readback the frame checks the
    /// capacity when it runs.
    #[doc(hidden)]
    pub fn counted_capacity(&mut self, counted: &Counted<'_>, capacity: u64) -> Result<ListCapacity, GpuError> {
        match self.growth() {
            Growth::Blocking => {
                let words: [u32; LIST_WORDS] =
                    self.read_now(counted.words, LIST_WORDS)?.try_into().expect("as many as were requested");
                let (starts, count) = counted.starts;
                let elements = match (counted.may_wrap)(&words) {
                    false => u64::from(words[0]),
                    true => sum_of_parts(&self.read_now::<u32>(starts, count)?),
                };
                let list = self.pool.capacity_policy.lists.entry(counted.list).or_default();
                Ok(ListCapacity {
                    capacity: list.grow_for(counted.list, counted.guess, counted.limit, elements),
                    elements,
                    words,
                })
            }
            Growth::Deferred => {
                let list = self.pool.capacity_policy.lists.entry(counted.list).or_default();
                let words = list.last;
                if u64::from(words[0]) > counted.limit {
                    // The caller learns of it once; the next frame counts again.
                    list.last = [0; LIST_WORDS];
                }
                self.note(counted, capacity)?;
                Ok(ListCapacity { capacity, elements: words[0].into(), words })
            }
        }
    }

    fn note(&mut self, counted: &Counted<'_>, capacity: u64) -> Result<(), GpuError> {
        let Some(mut deferred) = self.pool.capacity_policy.deferred.take() else { return Ok(()) };
        let list = deferred.noted.len();
        if list >= MOST_LISTS {
            self.pool.capacity_policy.deferred = Some(deferred);
            let needed = CAPACITY_POLICY_BYTES + 4 * LIST_WORDS as u64;
            return Err(GpuError::TooLarge {
                what: "lists of a frame".to_owned(),
                needed,
                limit: CAPACITY_POLICY_BYTES,
            });
        }
        deferred.noted.push(counted.list);
        let capacity = u32::try_from(capacity).unwrap_or(u32::MAX);
        let parameters = self.uniform(&NoteParameters { list: list as u32, capacity });
        let bindings = Bindings::new().part("note_parameters", &parameters).buffer("counted", counted.words);
        self.dispatch(&deferred.note, &bindings.buffer("capacity_policy", &deferred.words), [1, 1, 1]);
        self.pool.capacity_policy.deferred = Some(deferred);
        Ok(())
    }

    /// With deferred readback: a buffer with the arguments of an indirect draw of three vertices, which draws nothing if the frame is
    /// incomplete. Word 1 is 1 if the frame is complete, word 4 is the number of accumulated frames ([`Self::count_frame`]).
    #[doc(hidden)]
    pub fn completeness_buffer(&self) -> Option<wgpu::Buffer> {
        self.pool.capacity_policy.completeness_buffer()
    }

    /// With deferred readback, adds this frame to the number of accumulated frames if it is complete. `is_first` resets the number first.
    #[doc(hidden)]
    pub fn count_frame(&mut self, is_first: bool) {
        if self.growth() == Growth::Blocking {
            return;
        }
        let Some(deferred) = self.pool.capacity_policy.deferred.take() else { return };
        if is_first {
            self.encoder().clear_buffer(&deferred.words, 4 * FRAMES as u64, Some(4));
        }
        self.dispatch(&deferred.count_frame, &Bindings::new().buffer("capacity_policy", &deferred.words), [1, 1, 1]);
        self.pool.capacity_policy.deferred = Some(deferred);
    }
}

/// The sum of the lengths of parts, given their starts modulo 2³². The last start is the end of the last part.
fn sum_of_parts(starts: &[u32]) -> u64 {
    starts.windows(2).map(|pair| u64::from(pair[1].wrapping_sub(pair[0]))).sum()
}

#[test]
fn a_sum_beyond_32_bits_does_not_wrap() {
    let counts = [u32::MAX, 7, 0, u32::MAX - 1, 12];
    let mut sum = 0u32;
    let mut starts = vec![0];
    starts.extend(counts.iter().map(|count| {
        sum = sum.wrapping_add(*count);
        sum
    }));
    assert_eq!(sum_of_parts(&starts), counts.iter().map(|count| u64::from(*count)).sum::<u64>());
}

#[test]
fn host_and_shader_agree_on_the_words_of_the_capacity_policy() {
    let shader = SHADERS.link("capacity_policy/note", &[]).unwrap();
    crate::check_layout::<NoteParameters>(&shader).unwrap();
    let source = include_str!("note.wesl");
    for (name, value) in [("FRAMES", FRAMES), ("FIRST_LIST", FIRST_LIST), ("LIST_WORDS", LIST_WORDS)] {
        assert!(source.contains(&format!("const {name} = {value}u;")), "{name}");
    }
}
