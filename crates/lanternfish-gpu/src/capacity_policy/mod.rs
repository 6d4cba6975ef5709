//! Capacity for lists whose length is known on the device alone.
//!
//! - [`Growth::Blocking`]: a list is counted, the host reads how long it is, makes room, and it is written. Every frame is whole.
//! - [`Growth::Deferred`]: no frame waits. Lists have the room that earlier frames have shown to be enough, and half as much again; what
//!   this frame counts is read when it arrives. A frame that is full notes that it is not whole, and is not shown.

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
    /// A list of the frame.
    struct NoteParameters {
        /// Which it is, from 0.
        list: u32,
        /// Elements that it has room for.
        capacity: u32,
    }
}

/// When lists get more room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Growth {
    /// In the frame that needs it, which waits for the device.
    #[default]
    Blocking,
    /// In a later frame.
    Deferred,
}

/// A list that the device has counted.
#[derive(Clone, Copy)]
pub struct Counted<'a> {
    /// Its name. Lists of one name have the same room.
    pub list: &'static str,
    /// Four words: elements of it, and what else the host wants to know.
    pub words: &'a wgpu::Buffer,
    /// Where its parts start, and how many starts there are, the last being where the last part ends.
    pub starts: (&'a wgpu::Buffer, usize),
    /// Whether with these words the number of elements may have started over at 2³²: then the parts are added up.
    pub may_wrap: &'a dyn Fn(&[u32; LIST_WORDS]) -> bool,
    /// Elements that there is room for before anything was counted.
    pub guess: u64,
    /// Elements at most.
    pub limit: u64,
}

/// The room for a list.
#[derive(Clone, Copy, Debug)]
pub struct ListCapacity {
    /// Elements that there is room for: at most the limit.
    pub capacity: u64,
    /// Elements of the list, more than the limit too: in this frame, or where frames do not wait in the last one that has arrived.
    pub elements: u64,
    /// The words of the same frame.
    pub words: [u32; LIST_WORDS],
}

/// What has arrived of frames that did not wait.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arrived {
    /// Frames.
    pub frames: u64,
    /// Those of them that were not whole.
    pub held: u64,
}

/// What has become of a frame that did not wait.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// [`Frame::number`].
    pub frame: u64,
    /// Whether there was room for all of its lists: else it has drawn nothing.
    pub is_complete: bool,
    /// Whether the device has lost it, and most likely itself.
    pub is_lost: bool,
    /// Its lists by name, each with the number of elements that it needed room for.
    pub lists: Vec<(&'static str, u64)>,
    /// Those that get other room from now on.
    pub resized: Vec<&'static str>,
}

/// Words a list in the capacity policy, and those before the first: `note.wesl`.
pub(crate) const LIST_WORDS: usize = 4;
const FIRST_LIST: usize = 8;
/// Where the number of frames of a mean lies.
const FRAMES: usize = 4;
/// Lists of a frame at most.
const MOST_LISTS: usize = 1022;
const CAPACITY_POLICY_BYTES: u64 = 4 * (FIRST_LIST + LIST_WORDS * MOST_LISTS) as u64;

impl Frame<'_> {
    /// When lists of this frame get more room.
    pub fn growth(&self) -> Growth {
        self.pool.capacity_policy.growth()
    }

    /// Capacity for a list whose elements the commands so far have counted. Without waiting the frame notes, when it runs, whether the room
    /// is enough. More elements than the limit are left to the caller to refuse.
    pub fn capacity_for(&mut self, counted: &Counted<'_>) -> Result<ListCapacity, GpuError> {
        let capacity = self.planned_capacity(counted.list, counted.guess, counted.limit);
        self.counted_capacity(counted, capacity)
    }

    /// Capacity for a list that is counted while it is written: what was enough before, in elements. When it is written,
    /// [`Self::counted_capacity`] says whether it was enough.
    pub fn planned_capacity(&mut self, list: &'static str, guess: u64, limit: u64) -> u64 {
        let growth = self.growth();
        let list = self.pool.capacity_policy.lists.entry(list).or_default();
        match growth {
            Growth::Blocking => list.before_waiting(guess, limit),
            Growth::Deferred => list.later(guess, limit),
        }
    }

    /// The words of the longest list of this name in the last frame that has arrived, where frames do not wait.
    pub fn last_counted(&self, list: &'static str) -> [u32; LIST_WORDS] {
        let capacity_policy = &self.pool.capacity_policy;
        let history = capacity_policy.lists.get(list).filter(|_| capacity_policy.growth() == Growth::Deferred);
        history.map_or([0; LIST_WORDS], |history| history.last)
    }

    /// Whether room for `capacity` elements is enough for a list that the commands so far have counted: where the frame waits, it is
    /// the caller's to write the list again in the room that this returns; where it does not, the frame notes it when it runs.
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
                    capacity: list.waited_for(counted.list, counted.guess, counted.limit, elements),
                    elements,
                    words,
                })
            }
            Growth::Deferred => {
                let list = self.pool.capacity_policy.lists.entry(counted.list).or_default();
                let words = list.last;
                if u64::from(words[0]) > counted.limit {
                    // It is told once. Whether it is so still, the next frame finds out.
                    list.last = [0; LIST_WORDS];
                }
                self.note(counted, capacity)?;
                Ok(ListCapacity { capacity, elements: words[0].into(), words })
            }
        }
    }

    fn note(&mut self, counted: &Counted<'_>, capacity: u64) -> Result<(), GpuError> {
        let Some(mut later) = self.pool.capacity_policy.later.take() else { return Ok(()) };
        let list = later.noted.len();
        if list >= MOST_LISTS {
            self.pool.capacity_policy.later = Some(later);
            let needed = CAPACITY_POLICY_BYTES + 4 * LIST_WORDS as u64;
            return Err(GpuError::TooLarge {
                what: "lists of a frame".to_owned(),
                needed,
                limit: CAPACITY_POLICY_BYTES,
            });
        }
        later.noted.push(counted.list);
        let capacity = u32::try_from(capacity).unwrap_or(u32::MAX);
        let parameters = self.uniform(&NoteParameters { list: list as u32, capacity });
        let bindings = Bindings::new().part("note_parameters", &parameters).buffer("counted", counted.words);
        self.dispatch(&later.note, &bindings.buffer("capacity_policy", &later.words), [1, 1, 1]);
        self.pool.capacity_policy.later = Some(later);
        Ok(())
    }

    /// Where frames do not wait: what a draw of three vertices takes its numbers from, so that nothing is drawn where the frame is not
    /// whole. Word 1 is 1 where it is whole, word 4 the number of frames of a mean ([`Self::count_frame`]).
    pub fn whole(&self) -> Option<wgpu::Buffer> {
        self.pool.capacity_policy.whole()
    }

    /// Where frames do not wait, counts this one among the frames of a mean if it is whole; the first of a mean begins again.
    pub fn count_frame(&mut self, is_first: bool) {
        if self.growth() == Growth::Blocking {
            return;
        }
        let Some(later) = self.pool.capacity_policy.later.take() else { return };
        if is_first {
            self.encoder().clear_buffer(&later.words, 4 * FRAMES as u64, Some(4));
        }
        self.dispatch(&later.count_frame, &Bindings::new().buffer("capacity_policy", &later.words), [1, 1, 1]);
        self.pool.capacity_policy.later = Some(later);
    }
}

/// The sum of the lengths of parts, given their starts modulo 2³², the last being where the last part ends.
fn sum_of_parts(starts: &[u32]) -> u64 {
    starts.windows(2).map(|pair| u64::from(pair[1].wrapping_sub(pair[0]))).sum()
}

#[test]
fn a_sum_beyond_32_bits_is_added_up() {
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
fn the_ledgers_words_are_the_shaders() {
    let shader = SHADERS.link("capacity_policy/note", &[]).unwrap();
    crate::check_layout::<NoteParameters>(&shader).unwrap();
    let source = include_str!("note.wesl");
    for (name, value) in [("FRAMES", FRAMES), ("FIRST_LIST", FIRST_LIST), ("LIST_WORDS", LIST_WORDS)] {
        assert!(source.contains(&format!("const {name} = {value}u;")), "{name}");
    }
}
